"""A vehicle that follows set-points as a multirotor does: with lag and limits."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.mavlink.simulated_targets import Target, VelocityTarget
from clearway.missions.setup import FlightSetup

GAIN_PER_S = 1.0
"""Speed towards the set-point's place for every metre away from it."""
LAG_S = 0.3
"""Of the velocity behind what is asked for."""
FASTEST = 1.3
"""Speed that it can reach, in speeds of the mission."""
YAW_RATE_RPS = 1.5
STIFFNESS_PER_S = 2.5
"""Acceleration for every m/s that a vehicle with inertia is off its velocity."""
EXTRAPOLATED_S = 0.3
"""For so long it takes what it is told on at its velocity and acceleration, as ArduCopter does."""


@dataclass(frozen=True, slots=True)
class VehicleLimits:
    """How fast a vehicle answers."""

    cruise_mps: float
    acceleration_mps2: float = np.inf
    climb_acceleration_mps2: float = np.inf
    """Up and down."""
    tilt_s: float = 0.0
    """Time constant with which acceleration comes, since it has to tilt first; 0 for a vehicle
    whose velocity follows by itself."""
    jerk_mps3: float = np.inf
    """By how much acceleration changes a second, of a vehicle that tilts."""
    trims_for_s: float = 0.0
    """Time constant with which it forgets what it took for wind."""


@dataclass(frozen=True, slots=True, eq=False)
class VehicleTruth:
    """Where the vehicle is; local frame, z up."""

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""
    yaw_rad: float
    acceleration_mps2: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] of a vehicle that tilts."""
    trim_mps2: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] that it adds, since it took it for wind."""

    def trim_anew(self) -> VehicleTruth:
        """As a controller that begins, and takes what it accelerates by for wind."""
        return replace(self, trim_mps2=self.acceleration_mps2)

    def after(
        self, step_s: float, target: Target, limits: VehicleLimits, told_for_s: float = 0.0
    ) -> VehicleTruth:
        """The vehicle a short step later, as it was told to fly a while ago."""
        if limits.tilt_s > 0.0:
            return self._tilting(step_s, target, limits, min(told_for_s, EXTRAPOLATED_S))
        asked = np.zeros(3) if target.velocity_mps is None else target.velocity_mps
        if isinstance(target, VelocityTarget):
            turn = step_s * target.yaw_rate_rps
        else:
            asked = asked + GAIN_PER_S * (target.position_m - self.position_m)
            turn = float(wrap_angle(target.yaw_rad - self.yaw_rad))
        speed = float(np.linalg.norm(asked))
        asked = asked * min(1.0, FASTEST * limits.cruise_mps / max(speed, 1e-9))
        share = 1.0 - np.exp(-step_s / LAG_S)
        change = share * (asked - self.velocity_mps)
        hardest = limits.acceleration_mps2 * step_s
        change = change * min(1.0, hardest / max(float(np.linalg.norm(change)), 1e-9))
        steepest = limits.climb_acceleration_mps2 * step_s
        change[2] = np.clip(change[2], -steepest, steepest)
        velocity = self.velocity_mps + change
        turn = float(np.clip(turn, -YAW_RATE_RPS * step_s, YAW_RATE_RPS * step_s))
        middle = 0.5 * (velocity + self.velocity_mps)
        return VehicleTruth(
            self.position_m + step_s * middle, velocity, float(wrap_angle(self.yaw_rad + turn))
        )

    def _tilting(
        self, step_s: float, target: Target, limits: VehicleLimits, since_s: float
    ) -> VehicleTruth:
        """Position, velocity and acceleration one behind the other, as autopilots control them."""
        velocity, faster, rate = np.zeros(3), np.zeros(3), 0.0
        if target.velocity_mps is not None:
            velocity, rate = target.velocity_mps, target.yaw_rate_rps
        if target.acceleration_mps2 is not None:
            faster = target.acceleration_mps2
        if isinstance(target, VelocityTarget):
            velocity, turn = velocity + since_s * faster, step_s * rate
        else:
            place = target.position_m + since_s * velocity + 0.5 * since_s**2 * faster
            velocity = velocity + since_s * faster + GAIN_PER_S * (place - self.position_m)
            turn = float(wrap_angle(np.asarray(target.yaw_rad + since_s * rate - self.yaw_rad)))
        fastest = FASTEST * limits.cruise_mps
        velocity = velocity * min(1.0, fastest / max(float(np.linalg.norm(velocity)), 1e-9))
        trim = self.trim_mps2 * np.exp(-step_s / max(limits.trims_for_s, 1e-9))
        asked = faster + STIFFNESS_PER_S * (velocity - self.velocity_mps) + trim
        most = limits.acceleration_mps2
        asked = asked * min(1.0, most / max(float(np.linalg.norm(asked)), 1e-9))
        share = 1.0 - np.exp(-step_s / limits.tilt_s)
        change, most = share * (asked - self.acceleration_mps2), limits.jerk_mps3 * step_s
        change = change * min(1.0, most / max(float(np.linalg.norm(change)), 1e-9))
        now = self.acceleration_mps2 + change
        gained = self.velocity_mps + step_s * now
        turn = float(np.clip(turn, -YAW_RATE_RPS * step_s, YAW_RATE_RPS * step_s))
        middle = 0.5 * (gained + self.velocity_mps)
        yaw = float(wrap_angle(np.asarray(self.yaw_rad + turn)))
        return VehicleTruth(self.position_m + step_s * middle, gained, yaw, now, trim)


def ground_of(setup: FlightSetup) -> float:
    """Height of the home: that of the world, or well below a mission that flies lower."""
    heights = [*setup.mission.goals_m[:, 2], setup.mission.start.position_m[2]]
    margin, lowest = setup.planner.settings.safety_margin_m, float(min(heights))
    return 0.0 if lowest >= margin else lowest - 5.0 * margin
