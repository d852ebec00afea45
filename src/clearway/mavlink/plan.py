"""A vehicle that follows its plan is taken to have the plan's direction of flight."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np

from clearway.base.frames import wrap_angle
from clearway.base.state import State

ON_PLAN_RAD = math.radians(45.0)
"""While the direction of flight is so close to the plan's, the vehicle is turning into it."""


def turned_onto(planned: State, state: State, counts: Counter[str]) -> State:
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
