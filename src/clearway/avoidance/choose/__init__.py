"""The choice among trajectories: candidates, tiers, and what leaves an escape."""
