"""What an attitude that may be off means for a sweep: where its returns are, and what it passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State

STEEPEST_RAD = 0.25 * np.pi
"""An attitude off by more is not known at all."""


def slope_of(angle_rad: float) -> float:
    """Metres off per metre of distance, of an attitude off by an angle."""
    return float(np.tan(min(angle_rad, STEEPEST_RAD))) if angle_rad else 0.0


def radii_unsure(
    points_m: FloatArray, radii_m: FloatArray, state: State, angle_rad: float
) -> FloatArray:
    """[n] radii of balls that hold all places where returns [n, 3] of the world frame may be.

    The error of a return is the angle times its distance, so that those from near stay sharp: a
    margin wider by the error of the farthest would close every way.
    """
    if angle_rad <= 0.0:
        return radii_m
    away_m = np.linalg.norm(points_m - state.position_m, axis=1)
    return np.asarray(radii_m + slope_of(angle_rad) * away_m)


def turn_by_doubt(state: State, angle_rad: float) -> list[State]:
    """The state, and those of attitudes off by an angle either way in pitch and in yaw."""
    if angle_rad <= 0.0:
        return [state]
    angle = min(angle_rad, STEEPEST_RAD)
    turns = ([0.0, angle, 0.0], [0.0, -angle, 0.0], [0.0, 0.0, angle], [0.0, 0.0, -angle])
    return [state, *(replace(state, attitude_rad=state.attitude_rad + turn) for turn in turns)]
