"""Where a double integrator goes: towards a wished velocity, and to a stop.

The model of every rival: velocity changes at the acceleration that the copter surely has.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.filters.protocol import TICK_S
from clearway.base.frames import FloatArray


class Motion(NamedTuple):
    """Position and velocity, each [3]."""

    position_m: FloatArray
    velocity_mps: FloatArray


class Rolled(NamedTuple):
    """A motion at times 0, TICK_S, 2 TICK_S, ..."""

    position_m: FloatArray
    """[n, 3]"""
    velocity_mps: FloatArray
    """[n, 3]"""

    @property
    def end(self) -> Motion:
        """The last."""
        return Motion(self.position_m[-1], self.velocity_mps[-1])

    def then(self, after: Rolled) -> Rolled:
        """Return both, one after the other; `after` begins where this one ends."""
        return Rolled(
            np.concatenate([self.position_m, after.position_m[1:]]),
            np.concatenate([self.velocity_mps, after.velocity_mps[1:]]),
        )


def roll_to(begin: Motion, wished_mps: FloatArray, most_mps2: float, steps: int) -> Rolled:
    """Return the motion that changes its velocity to a wished one, and keeps that."""
    change = wished_mps - begin.velocity_mps
    times = TICK_S * np.arange(steps + 1)[:, None]
    lasts_s = float(np.linalg.norm(change)) / most_mps2
    if lasts_s < 1e-9:
        velocity = np.tile(wished_mps, (steps + 1, 1))
        return Rolled(begin.position_m + times * wished_mps, velocity)
    changing = np.minimum(times, lasts_s)
    velocity = begin.velocity_mps + changing / lasts_s * change
    lag_s = changing - 0.5 * changing**2 / lasts_s
    return Rolled(begin.position_m + times * wished_mps - lag_s * change, velocity)


def roll_to_stop(begin: Motion, most_mps2: float) -> Rolled:
    """Return the motion that brakes straight on until it stands."""
    speed = float(np.linalg.norm(begin.velocity_mps))
    steps = int(np.ceil(speed / most_mps2 / TICK_S - 1e-9))
    return roll_to(begin, np.zeros(3), most_mps2, steps)
