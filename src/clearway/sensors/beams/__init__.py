"""Beams: patterns, a LiDAR on a vehicle, simulated scans, and directions in bins."""
