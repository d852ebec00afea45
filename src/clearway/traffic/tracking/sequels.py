"""Whether one aircraft can have sent two reports, one after the other."""

from __future__ import annotations

import math

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic.intruder import Intruder
from clearway.traffic.tracking.screening import TrackerSettings

DATED_S = 1.0
"""Links state ages in whole seconds, so a time may be off by so much."""
GIVEN_M = 30.0
"""Places of satellite navigation jump by as much now and then."""
SUDDEN_MPS = 10.0
"""Velocities may differ by so much between two reports, however near in time."""
SIGMAS = 5.0
MOST_NAMESAKES = 3
"""Aircraft that are followed under one name."""
AGREED = 3
"""So many velocities in a row that fit each other are believed, however far off the one before."""
LOOKED_BACK_S = 3.0
"""Over this time, what an aircraft has flown must fit the velocity that it tells."""
_SETTINGS = TrackerSettings()


def farthest_m(elapsed_s: float, speed_mps: float = math.inf, std_m: float = 0.0) -> float:
    """Return how far an aircraft of a speed may be found from where it was."""
    speed = min(_SETTINGS.fastest_mps, speed_mps + _SETTINGS.hardest_mps2 * abs(elapsed_s))
    return speed * (abs(elapsed_s) + DATED_S) + GIVEN_M + SIGMAS * std_m


def can_follow(before: Intruder, after: Intruder) -> bool:
    """Return whether an aircraft can have flown from one report's position to the other's."""
    elapsed, speed = after.time_s - before.time_s, max(before.speed_mps, after.speed_mps)
    far = farthest_m(elapsed, speed, before.position_std_m + after.position_std_m)
    return float(np.linalg.norm(after.position_m - before.position_m)) <= far


def can_turn_to(before: Intruder, velocity_mps: FloatArray, after: Intruder) -> bool:
    """Return whether an aircraft of a velocity can have that of a later report."""
    elapsed = abs(after.time_s - before.time_s)
    stds = before.velocity_std_mps + after.velocity_std_mps
    most = _SETTINGS.hardest_mps2 * elapsed + SUDDEN_MPS + SIGMAS * stds
    return float(np.linalg.norm(after.velocity_mps - velocity_mps)) <= most


def can_have_flown(before: Intruder, after: Intruder) -> bool:
    """Return whether the way between two reports fits the velocity of the later one."""
    elapsed = after.time_s - before.time_s
    off = after.position_m - before.position_m - after.velocity_mps * elapsed
    most = 0.5 * _SETTINGS.hardest_mps2 * elapsed**2 + after.speed_mps * DATED_S + GIVEN_M
    most += SIGMAS * (before.position_std_m + after.position_std_m)
    return float(np.linalg.norm(off)) <= most
