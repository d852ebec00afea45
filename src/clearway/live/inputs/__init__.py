"""What comes in: readings and their times, own state estimates, scans, reports, the wind."""
