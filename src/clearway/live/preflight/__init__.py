"""Before take-off: whether an escape can be held, and what a flight asks for and may not get."""
