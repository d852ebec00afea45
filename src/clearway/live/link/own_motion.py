"""Own place and motion as a link tells them, and the own state that decisions start from.

Sets and trajectories are those of a vehicle that flies where its nose points, (4.4). A multirotor
tilts to go forward, and wind sets a plane off its heading, so the attitude that decisions start
from is the direction of motion over ground; below a least speed it is the heading, level.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import State

ON_PLAN_RAD = math.radians(45.0)
"""While the direction of flight is so close to the plan's, the vehicle is turning into it."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnMotion:
    """Own place and motion as told, world frame."""

    time_s: float
    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""
    heading_rad: float
    """Yaw of the nose, left positive from x."""
    position_std_m: float = 0.0
    attitude_std_rad: float = 0.0
    attitude_rad: FloatArray | None = None
    """[3] of the body, where the link tells it: decisions then start from it as it is."""
    tilt_rad: float = 0.0
    """The most that the body was off the level lately, where only that is told."""

    def direction(self, least_mps: float) -> tuple[float, float]:
        """Pitch (nose down positive) and yaw of the flight path; of the nose when slower."""
        x, y, z = self.velocity_mps.tolist()
        level = math.hypot(x, y)
        if math.hypot(level, z) < least_mps:
            return 0.0, self.heading_rad
        yaw = math.atan2(y, x) if level >= 0.5 * least_mps else self.heading_rad
        return math.atan2(-z, level), yaw

    def state(self, least_mps: float) -> State:
        """The own state that decisions start from."""
        attitude = self.attitude_rad
        if attitude is None:
            attitude = np.array([0.0, *self.direction(least_mps)])
        return State(
            self.position_m,
            attitude,
            time_s=self.time_s,
            position_std_m=self.position_std_m,
            attitude_std_rad=self.attitude_std_rad,
        )


def turn_onto(planned: State, state: State, counts: Counter[str]) -> State:
    """The own state with the direction of flight that the plan has, while the vehicle follows it.

    It does so with lag: a decision that started from its own direction would ask for the
    beginning of a turn, over and over. counts grows where it does not follow.
    """
    off = wrap_angle(state.attitude_rad - planned.attitude_rad)
    if math.hypot(float(off[1]), float(off[2])) > ON_PLAN_RAD:
        counts["plan: not followed"] += 1
        return state
    _, pitch, yaw = planned.attitude_rad
    return replace(state, attitude_rad=np.array([0.0, pitch, wrap_angle(yaw)]))
