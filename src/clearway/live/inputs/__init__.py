"""What comes in: readings and their times, own states, scans, reports, the wind."""
