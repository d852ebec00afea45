"""What leads an aeroplane: the way that its movements ask for, as fast as it may roll and climb.

A turn is begun by rolling into it, a climb by pulling up. So the way bends no sooner than an
aeroplane can, and one that is held to it strays by what gusts do, not by what it cannot do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray

GRAVITY_MPS2 = 9.81
BANK_RATE_RPS = float(np.radians(20.0))
ROLL_S = 0.7
"""Of the bank behind what is asked for."""
CLIMB_MPS2 = 2.0
MOST_OFF_M = 60.0
"""What leads waits for who falls farther behind."""


@dataclass
class AeroplaneWay:
    """A place that goes along the way that movements ask for, in air that moves."""

    place_m: FloatArray
    """[3] world frame."""
    course_rad: float
    """Through the air."""
    rolled_rad: float = 0.0
    """Bank that is asked for, which the aircraft's own follows."""
    bank_rad: float = 0.0
    climb_mps: float = 0.0
    rate_rps: float = 0.0

    def on(
        self, speed_mps: float, climb_mps: float, rate_rps: float, wind_mps: FloatArray, dt: float
    ) -> None:
        """A step later, as fast as an aircraft may roll and change its climb."""
        bank = -float(np.arctan(speed_mps * rate_rps / GRAVITY_MPS2))
        most = BANK_RATE_RPS * dt
        self.rolled_rad += min(max(bank - self.rolled_rad, -most), most)
        self.bank_rad += dt / ROLL_S * (self.rolled_rad - self.bank_rad)
        self.rate_rps = -GRAVITY_MPS2 * float(np.tan(self.bank_rad)) / speed_mps
        self.course_rad += self.rate_rps * dt
        most = CLIMB_MPS2 * dt
        self.climb_mps += min(max(climb_mps - self.climb_mps, -most), most)
        x_mps = speed_mps * float(np.cos(self.course_rad)) + float(wind_mps[0])
        y_mps = speed_mps * float(np.sin(self.course_rad)) + float(wind_mps[1])
        self.place_m = self.place_m + dt * np.array([x_mps, y_mps, self.climb_mps])

    def ahead_of(self, place_m: FloatArray) -> FloatArray:
        """[3] from a place to the one that leads, which waits where that is too far."""
        off_m = self.place_m - place_m
        far_m = float(np.linalg.norm(off_m))
        if far_m > MOST_OFF_M:
            off_m = off_m * (MOST_OFF_M / far_m)
            self.place_m = place_m + off_m
        return off_m
