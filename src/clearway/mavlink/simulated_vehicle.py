"""A vehicle that follows set-points as a multirotor does: with lag and limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.mavlink.simulated_targets import Target, VelocityTarget

GAIN_PER_S = 1.0
"""Speed towards the set-point's place for every metre away from it."""
LAG_S = 0.3
"""Of the velocity behind what is asked for."""
FASTEST = 1.3
"""Speed that it can reach, in speeds of the mission."""
YAW_RATE_RPS = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class VehicleTruth:
    """Where the vehicle is; local frame, z up."""

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""
    yaw_rad: float

    def after(
        self,
        step_s: float,
        target: Target,
        cruise_mps: float,
        acceleration_mps2: float = np.inf,
        climb_acceleration_mps2: float = np.inf,
    ) -> VehicleTruth:
        """The vehicle a short step later, as it is told to fly."""
        asked = np.zeros(3) if target.velocity_mps is None else target.velocity_mps
        if isinstance(target, VelocityTarget):
            turn = step_s * target.yaw_rate_rps
        else:
            asked = asked + GAIN_PER_S * (target.position_m - self.position_m)
            turn = float(wrap_angle(target.yaw_rad - self.yaw_rad))
        speed = float(np.linalg.norm(asked))
        asked = asked * min(1.0, FASTEST * cruise_mps / max(speed, 1e-9))
        share = 1.0 - np.exp(-step_s / LAG_S)
        change = share * (asked - self.velocity_mps)
        hardest = acceleration_mps2 * step_s
        change = change * min(1.0, hardest / max(float(np.linalg.norm(change)), 1e-9))
        steepest = climb_acceleration_mps2 * step_s
        change[2] = np.clip(change[2], -steepest, steepest)
        velocity = self.velocity_mps + change
        turn = float(np.clip(turn, -YAW_RATE_RPS * step_s, YAW_RATE_RPS * step_s))
        middle = 0.5 * (velocity + self.velocity_mps)
        return VehicleTruth(
            self.position_m + step_s * middle, velocity, float(wrap_angle(self.yaw_rad + turn))
        )
