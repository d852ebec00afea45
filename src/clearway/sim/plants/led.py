"""Loops that follow a reference: its acceleration and velocity fed forward, errors led back.

A vehicle tilts before it accelerates, so the acceleration is asked for earlier than it is needed,
by what the vehicle lags. Position and velocity are compared with the reference of the present. The
gains are those of a well-tuned autopilot: a position error of 1 m asks for 6 m/s2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import FloatArray, Floats
from clearway.base.compiled import compiled
from clearway.vehicle.reference import Reference

Asked = Callable[[float], Reference]
"""What is asked of a vehicle a time from now on, in s."""


class LedGains(NamedTuple):
    """Of the loops that lead errors back, level (x and y) and up."""

    position_per_s2: tuple[float, float] = (6.0, 6.0)
    velocity_per_s: tuple[float, float] = (4.0, 4.0)
    sum_per_s3: float = 2.0
    most_sum_mps2: float = 4.0
    drag_per_s: float = 0.0
    """Deceleration by drag per speed, as known of the airframe."""


class PointMass(NamedTuple):
    """A vehicle that is nothing but a mass with drag, which obeys accelerations by a lag."""

    lag_s: float = 0.1
    drag_per_s: float = 0.2


@dataclass
class LedWay:
    """A reference under way, in the rows that loops are led by."""

    asked: Asked
    lead_s: tuple[float, float]
    """By how much the acceleration is asked for before its time: level, which takes a tilt, and
    up."""
    into_s: float = 0.0
    _row: FloatArray | None = None
    """Of now, once it was asked for."""

    def row(self) -> FloatArray:
        """[11] position, velocity, led acceleration, yaw and yaw rate."""
        here = self.asked(self.into_s)
        leads = dict.fromkeys(self.lead_s)  # Most lead level and up by the same time.
        ahead = {lead: self.asked(self.into_s + lead).acceleration_mps2 for lead in leads}
        level, up = (ahead[lead] for lead in self.lead_s)
        led = (level[0], level[1], up[2])
        yaw = (here.yaw_rad, here.yaw_rate_rps)
        return np.array([*here.position_m, *here.velocity_mps, *led, *yaw], dtype=np.float64)

    def step(self, duration_s: float) -> tuple[FloatArray, FloatArray]:
        """The rows at both ends of a step, which is taken."""
        before = self.row() if self._row is None else self._row
        self.into_s += duration_s
        self._row = self.row()
        return before, self._row


@compiled
def lead_acceleration(
    position: Floats, velocity: Floats, asked: Floats, total: Floats, gains: LedGains
) -> Floats:
    """[3] world frame, without gravity: fed forward, and what leads errors back."""
    wanted = np.empty(3)
    for i in range(3):
        wanted[i] = asked[6 + i] + total[i]
        position_per_s2 = gains.position_per_s2[0] if i < 2 else gains.position_per_s2[1]
        velocity_per_s = gains.velocity_per_s[0] if i < 2 else gains.velocity_per_s[1]
        wanted[i] += position_per_s2 * (asked[i] - position[i])
        wanted[i] += velocity_per_s * (asked[3 + i] - velocity[i])
        wanted[i] += gains.drag_per_s * asked[3 + i] * (i < 2)
    return wanted


@compiled
def lead_sum(
    position: Floats, asked: Floats, total: Floats, step_s: float, gains: LedGains
) -> Floats:
    """[3] the integral of the position's error a step later, as an acceleration."""
    after = np.empty(3)
    for i in range(3):
        grown = total[i] + gains.sum_per_s3 * (asked[i] - position[i]) * step_s
        after[i] = min(max(grown, -gains.most_sum_mps2), gains.most_sum_mps2)
    return after


@compiled
def fly_point_mass(
    x: Floats,
    total: Floats,
    before: Floats,
    after: Floats,
    air: Floats,
    mass: PointMass,
    gains: LedGains,
    steps: int,
    step_s: float,
) -> tuple[Floats, Floats]:
    """[9] position, velocity and acceleration, and the sum, after steps.

    before, after: [11] rows of a reference at both ends. air: [3] how the air moves.
    """
    x = x.copy()
    decay = np.exp(-step_s / mass.lag_s)
    for n in range(steps):
        asked = before + (n + 0.5) / steps * (after - before)
        wanted = lead_acceleration(x[0:3], x[3:6], asked, total, gains)
        total = lead_sum(x[0:3], asked, total, step_s, gains)
        for i in range(3):
            x[6 + i] = wanted[i] + decay * (x[6 + i] - wanted[i])
            drag = mass.drag_per_s * (x[3 + i] - air[i])
            x[3 + i] += (x[6 + i] - drag) * step_s
            x[i] += x[3 + i] * step_s
    return x, total
