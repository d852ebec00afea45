"""Gatekeeper: a wish is followed as long as a committed trajectory ends in a safe stop.

After Agrawal, Chen and Panagou, "gatekeeper: online safety verification and control for nonlinear
systems in dynamic environments" (2024), written anew. A candidate follows the wish until a
switching time, and then a back-up trajectory to a stop. The valid candidate with the latest
switching time becomes the committed trajectory. Without one, the committed one is followed on.
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
    check_wish,
    pass_on,
    stand,
)
from benchmarks.filters.rollouts import Motion, Rolled, roll_to, roll_to_stop
from benchmarks.filters.shielding import is_safe
from clearway.base.frames import FloatArray
from clearway.live.link.set_point import SetPoint


class GatekeeperTuning(NamedTuple):
    """Of the search for a candidate."""

    spare_m: float = 0.1
    """Kept beside the margin, for what the model does not know."""
    horizon_s: float = 1.0
    """Latest switching time."""
    first_s: float = 0.1
    """A wish passes only if it can be followed for so long."""
    stride: int = 4
    """Ticks between two switching times."""


TUNED = GatekeeperTuning()


class Committed(NamedTuple):
    """A trajectory that was verified."""

    begins_s: float
    rolled: Rolled

    def set_point_at(self, time_s: float, most_mps2: float, yaw_rad: float) -> SetPoint | None:
        """Return where it has the copter; None after its end."""
        place, velocity = self.rolled
        at = round((time_s - self.begins_s) / TICK_S, 6)
        if at >= len(place) - 1:
            return None
        n, share = int(at), at - int(at)
        step = (velocity[n + 1] - velocity[n]) / TICK_S
        size = float(np.linalg.norm(step))
        step = step * min(1.0, most_mps2 / max(size, 1e-9))
        return SetPoint(
            (1.0 - share) * place[n] + share * place[n + 1],
            (1.0 - share) * velocity[n] + share * velocity[n + 1],
            yaw_rad,
            step,
        )


class Gatekeeper(Looker):
    """The filter of one flight."""

    def __init__(self, copter: Copter, tuning: GatekeeperTuning = TUNED) -> None:
        self.copter, self.tuning = copter, tuning
        self.committed: Committed | None = None

    def command(self, own: Own, wish_mps: FloatArray, known: Surroundings) -> Command:
        """Return the wish where a candidate follows it, else the committed trajectory."""
        wish = check_wish(wish_mps)
        here = Motion(own.position_m, own.velocity_mps)
        most, tuning = self.copter.acceleration_mps2, self.tuning
        latest, first = round(tuning.horizon_s / TICK_S), max(1, round(tuning.first_s / TICK_S))
        for steps in range(latest, first - 1, -tuning.stride):
            led = roll_to(here, wish, most, steps)
            if self._commit(led.then(roll_to_stop(led.end, most)), own, known):
                return pass_on(wish)
        if self.committed is None or not self._goes_on(own):
            self._commit(roll_to_stop(here, most), own, known)
        return self._follow(own)

    def _commit(self, rolled: Rolled, own: Own, known: Surroundings) -> bool:
        if not is_safe(rolled, known, self.copter, self.tuning.spare_m):
            return False
        self.committed = Committed(own.time_s, rolled)
        return True

    def _goes_on(self, own: Own) -> bool:
        """Whether the committed trajectory is not flown to its end."""
        assert self.committed is not None
        lasts_s = TICK_S * (len(self.committed.rolled.position_m) - 1)
        return own.time_s < self.committed.begins_s + lasts_s

    def _follow(self, own: Own) -> Command:
        if self.committed is None:
            return stand()
        most = self.copter.acceleration_mps2
        point = self.committed.set_point_at(own.time_s, most, own.yaw_rad)
        if point is None:
            # It stands where the committed trajectory ends.
            return Command(SetPoint(self.committed.rolled.position_m[-1], None, own.yaw_rad), False)
        return Command(point, False)
