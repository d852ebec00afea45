"""A small campaign that tests fly."""

from __future__ import annotations

SMALL = """
name = "small"
planners = ["clearway", "straight", "potential-field"]
seeds = 4

[[family]]
family = "several"

[[family]]
family = "head-on"
label = "noisy"
parameters = { position_noise_m = 0.3, velocity_noise_mps = 0.1 }

[[family]]
family = "balls"
label = "balls-60"
parameters = { balls = 60 }
seeds = 2
leave_out = ["potential-field"]
changes.simulation = { scan_latency_s = 1.0, time_limit_s = 12.0 }
changes.lidar = { dropout = 0.5 }
"""
