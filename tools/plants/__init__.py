"""Plants measured and flown at their own scale: the tables of docs/results/plants.md."""
