"""How an ownship at real scale moves: turns, climbs and speeds that take their time."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled


@compiled
def advance(
    state: Floats,
    course: float,
    speed: float,
    climb: float,
    across: float,
    along: float,
    turn_onset: float,
    climb_onset: float,
    step: float,
    floor: float,
    ceiling: float,
) -> None:
    """Move x, y, z, course, speed, climb and turn rate on by a step, towards what is commanded."""
    most = across / max(state[4], 1.0)
    off = (course - state[3] + np.pi) % (2.0 * np.pi) - np.pi
    # The rate from which the turn can be ended on the course, within its onset.
    asked = min(max(off / max(turn_onset + step, step), -most), most)
    state[6] += (asked - state[6]) * min(1.0, step / max(turn_onset, step))
    if (state[2] <= floor and climb < 0.0) or (state[2] >= ceiling and climb > 0.0):
        climb = 0.0
    state[5] += (climb - state[5]) * min(1.0, step / max(climb_onset, step))
    state[4] += min(max(speed - state[4], -along * step), along * step)
    turn = state[6] * step
    middle = state[3] + 0.5 * turn
    state[0] += state[4] * step * np.cos(middle)
    state[1] += state[4] * step * np.sin(middle)
    state[2] += state[5] * step
    state[3] += turn
