"""Point memory: what is remembered of returns, and what later sweeps say against it."""
