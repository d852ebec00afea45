"""What trajectories keep clear of, and how far they are from it."""
