"""What a decision starts from: settings, reach sets with their costs, and what is known."""
