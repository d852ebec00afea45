"""Straight motion of a body from its sightings, and what it is as an intruder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sensors.passing.sightings import Sighting
from clearway.traffic import Intruder

WIDEST_SPREAD_RAD = np.pi / 6


class FittedMotion(NamedTuple):
    """Straight motion fitted to sightings, world frame."""

    time_s: float
    position_m: FloatArray
    """[3] of the centre."""
    velocity_mps: FloatArray
    position_std_m: float
    velocity_std_mps: float
    radius_m: float
    misfit: float
    """Mean square of the residuals, in variances."""

    @property
    def speed_mps(self) -> float:
        return float(np.linalg.norm(self.velocity_mps))

    def at(self, time_s: float) -> FloatArray:
        """[3] centre at a time."""
        return self.position_m + (time_s - self.time_s) * self.velocity_mps

    def intruder(self, name: str) -> Intruder:
        """The body as an intruder at the time of its last sighting, world frame."""
        spread = min(np.arctan2(self.velocity_std_mps, self.speed_mps), WIDEST_SPREAD_RAD)
        return Intruder(
            self.position_m,
            self.velocity_mps,
            spread_rad=np.array([spread, spread]),
            radius_m=self.radius_m,
            name=name,
            time_s=self.time_s,
            position_std_m=self.position_std_m,
            velocity_std_mps=self.velocity_std_mps,
        )


def fit_motion(sightings: Sequence[Sighting]) -> FittedMotion:
    """Straight motion of a ball by weighted least squares, at the time of the last sighting.

    Where less of the body is seen than elsewhere its mean is off by up to what is missing.
    """
    widths = np.array([s.half_width_m for s in sightings])
    radius = float(widths.max()) + min(s.half_spacing_m for s in sightings)
    centers = np.array([s.center_m(radius) for s in sightings])
    # Half of a ball is as wide as all of it, but thinner.
    thicknesses = np.array([s.half_thickness_m for s in sightings])
    lacking = np.hypot(widths.max() - widths, thicknesses.max() - thicknesses)
    weights = 1.0 / (np.array([s.std_m for s in sightings]) ** 2 + lacking**2)
    end_s = sightings[-1].time_s
    times = np.array([s.time_s for s in sightings]) - end_s
    total, first, second = weights.sum(), weights @ times, weights @ times**2
    determinant = total * second - first**2
    sums, moments = weights @ centers, (weights * times) @ centers
    velocity = (total * moments - first * sums) / determinant
    position = (second * sums - first * moments) / determinant
    residuals = centers - position - times[:, None] * velocity
    misfit = float(weights @ np.sum(residuals**2, axis=1)) / (3.0 * max(len(times) - 2, 1))
    worse = max(misfit, 1.0)
    return FittedMotion(
        end_s,
        position,
        velocity,
        float(np.sqrt(worse * second / determinant)),
        float(np.sqrt(worse * total / determinant)),
        radius,
        misfit,
    )
