"""How near two aircraft came, and whether they lost the separation that aviation asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M

NEAR_MID_AIR_M = (500.0 * FOOT_M, 100.0 * FOOT_M)
"""Horizontal and vertical: a near mid-air collision is nearer in both."""
WELL_CLEAR_M = (2000.0 * FOOT_M, 250.0 * FOOT_M)
"""Well clear of DO-365 at its horizontal and vertical limits: lost where nearer in both."""


@dataclass(frozen=True, slots=True)
class Approach:
    """Two aircraft where the straight line between them was shortest."""

    time_s: float
    horizontal_m: float
    vertical_m: float
    """Of the other above the ownship."""
    near_mid_air: bool
    """Whether at any time they were nearer than 500 ft and 100 ft."""
    well_clear: bool
    """Whether they never were nearer than 2000 ft and 250 ft."""

    @property
    def slant_m(self) -> float:
        return float(np.hypot(self.horizontal_m, self.vertical_m))


def closest_approach(own: FloatArray, other: FloatArray) -> Approach | None:
    """Of two tracks [n, 4] and [m, 4] of time and position, at the times that both have."""
    times, at, of = np.intersect1d(
        np.round(own[:, 0], 6), np.round(other[:, 0], 6), return_indices=True
    )
    if not len(times):
        return None
    apart = other[of, 1:] - own[at, 1:]
    level, height = np.hypot(apart[:, 0], apart[:, 1]), apart[:, 2]
    nearest = int(np.argmin(np.hypot(level, height)))

    def within(limits_m: tuple[float, float]) -> bool:
        return bool(np.any((level < limits_m[0]) & (np.abs(height) < limits_m[1])))

    return Approach(
        time_s=float(times[nearest]),
        horizontal_m=float(level[nearest]),
        vertical_m=float(height[nearest]),
        near_mid_air=within(NEAR_MID_AIR_M),
        well_clear=not within(WELL_CLEAR_M),
    )
