"""The guardian of clearway behind the protocol of all filters."""

from __future__ import annotations

import numpy as np

from benchmarks.filters.protocol import TICK_S, Command, Own, Surroundings, check_wish
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.guard.guardian import Guardian
from clearway.live.link.lead import OwnSpeed
from clearway.mavlink.simulated_targets import VelocityTarget

LEAD_S = 0.5 * TICK_S
"""By which set-points are ahead, as in live sessions."""


class GuardianFilter:
    """The filter of one flight."""

    def __init__(self, guardian: Guardian) -> None:
        self.guardian = guardian
        self._own_speed = OwnSpeed(guardian.planner.speed_mps)

    def look(self, own: Own, known: Surroundings) -> None:
        """Tell it the own state and the newest scans."""
        attitude = np.array([0.0, 0.0, own.yaw_rad])
        self.guardian.update(
            State(own.position_m, attitude, time_s=own.time_s, velocity_mps=own.velocity_mps)
        )
        for scan in known.news:
            self.guardian.update(scan)
        self.guardian.catch_up(own.time_s)

    def command(self, own: Own, wish_mps: FloatArray, _known: Surroundings) -> Command:
        """Return the wish if it passes, else what the guardian flies."""
        wish = check_wish(wish_mps)
        told = self.guardian.guard_velocity(wish, own.time_s, own_velocity_mps=own.velocity_mps)
        if told.is_velocity:
            return Command(VelocityTarget(told.velocity_mps, told.yaw_rate_rps), told.passed)
        point = self.guardian.set_point_at(own.time_s + LEAD_S)
        assert point is not None  # It has just answered.
        here = State(own.position_m, time_s=own.time_s)
        counts_s = own.time_s + LEAD_S
        return Command(self._own_speed.limit(point, here, own.velocity_mps, counts_s), False)
