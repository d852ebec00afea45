"""Model predictive shielding: a wish passes if braking from the next state is safe.

After Li and Bastani, "Robust model predictive shielding for safe reinforcement learning with
stochastic dynamics" (2020), written anew. A state is recoverable if the back-up policy leads from
it to a stop and stays safe. If the state that the wish leads to is recoverable, the wish passes;
otherwise the back-up policy acts. The back-up policy here brakes straight on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.filters.protocol import (
    TICK_S,
    Command,
    Copter,
    Looker,
    Own,
    Surroundings,
    accelerate,
    check_wish,
    pass_on,
    stand,
)
from benchmarks.filters.rollouts import Motion, Rolled, roll_to, roll_to_stop
from clearway.base.frames import FloatArray


class BackupTuning(NamedTuple):
    """Of filters that brake as a back-up."""

    spare_m: float = 0.0
    """Kept beside the margin, for what the model does not know."""
    ahead_s: float = 0.2
    """The state that a wish leads to is looked at so much later."""


TUNED = BackupTuning()


def is_safe(rolled: Rolled, known: Surroundings, copter: Copter, spare_m: float) -> bool:
    """Return whether a motion keeps its margin, and stays in space seen to be free."""
    if np.any(known.clearances_m(rolled.position_m) < copter.margin_m + spare_m):
        return False
    return bool(known.were_seen(rolled.position_m).all())


def brake(own: Own, most_mps2: float) -> Command:
    """Return the command of the back-up policy: brake, then stand."""
    speed = float(np.linalg.norm(own.velocity_mps))
    if speed <= most_mps2 * TICK_S:
        return stand()
    return accelerate(own, own.velocity_mps * (-most_mps2 / speed))


class ModelPredictiveShield(Looker):
    """The filter of one flight."""

    def __init__(self, copter: Copter, tuning: BackupTuning = TUNED) -> None:
        self.copter, self.tuning = copter, tuning

    def command(self, own: Own, wish_mps: FloatArray, known: Surroundings) -> Command:
        """Return the wish where it leaves the copter recoverable, else a brake."""
        wish, most = check_wish(wish_mps), self.copter.acceleration_mps2
        here = Motion(own.position_m, own.velocity_mps)
        steps = max(1, round(self.tuning.ahead_s / TICK_S))
        led = roll_to(here, wish, most, steps)
        led = led.then(roll_to_stop(led.end, most))
        if is_safe(led, known, self.copter, self.tuning.spare_m):
            return pass_on(wish)
        return brake(own, most)
