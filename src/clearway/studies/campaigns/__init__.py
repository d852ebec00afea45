"""Campaigns: families of cases x planners x seeds, flown on all cores, one row a flight."""
