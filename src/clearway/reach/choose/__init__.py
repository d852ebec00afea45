"""Which nodes and trajectories go on: keep rules, covers, and trajectories distinguished."""
