"""Whether one aircraft can have sent two reports, one after the other."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic.intruder import Intruder
from clearway.traffic.tracking.screening import TrackerSettings

DATED_S = 1.0
"""Links state ages in whole seconds, so a time may be off by so much."""
GIVEN_M = 30.0
"""Places of satellite navigation jump by as much now and then."""
SIGMAS = 5.0
MOST_NAMESAKES = 3
"""Aircraft that are followed under one name."""
AGREED = 3
"""So many velocities in a row that fit each other are believed, however far off the one before."""
_SETTINGS = TrackerSettings()


def can_follow(before: Intruder, after: Intruder) -> bool:
    """Return whether an aircraft can have flown from one report's position to the other's."""
    elapsed = abs(after.time_s - before.time_s)
    speed = max(before.speed_mps, after.speed_mps) + _SETTINGS.hardest_mps2 * elapsed
    stds = before.position_std_m + after.position_std_m
    far = min(_SETTINGS.fastest_mps, speed) * (elapsed + DATED_S) + GIVEN_M + SIGMAS * stds
    return float(np.linalg.norm(after.position_m - before.position_m)) <= far


def can_turn_to(before: Intruder, velocity_mps: FloatArray, after: Intruder) -> bool:
    """Return whether an aircraft of a velocity can have that of a later report."""
    elapsed = abs(after.time_s - before.time_s) + DATED_S
    stds = before.velocity_std_mps + after.velocity_std_mps
    most = _SETTINGS.hardest_mps2 * elapsed + SIGMAS * stds
    return float(np.linalg.norm(after.velocity_mps - velocity_mps)) <= most
