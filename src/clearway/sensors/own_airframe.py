"""Returns of the own airframe: near ones that stand still in every scan, in the sensor's frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.sensors.lidar import Mounting

NEAR_M = 1.0
"""Nearer than this nothing but the own airframe stands still; a vehicle that stands itself has
walls about it farther away."""
VOXEL_M = 0.06
"""What stands still comes back within a voxel or beside it."""
FEWEST_SCANS = 3


class OwnAirframe(NamedTuple):
    """Returns that are probably of the own airframe."""

    returns: int
    """In the first of the scans."""
    scans: int
    """In how many scans they are, which is in all that were looked at."""
    nearest_m: float
    """From the sensor."""
    farthest_m: float
    radius_m: float
    """`airframe_radius_m` that leaves them out: from the body's origin, rounded up."""

    def in_words(self) -> str:
        """What it looks like, and what to set."""
        span = f"{self.nearest_m:.2f} m"
        if self.farthest_m - self.nearest_m >= 0.01:
            span = f"{self.nearest_m:.2f} to {self.farthest_m:.2f} m"
        one = self.returns == 1
        count = f"{self.returns} return{'' if one else 's'} {span} from the sensor"
        return (
            f"{count} stand{'s' if one else ''} still in each of {self.scans} scans: probably the "
            "own airframe, which no obstacle is; airframe_radius_m of [scan], or "
            f"--airframe-radius {self.radius_m:g}, leaves {'it' if one else 'them'} out"
        )


def own_airframe(
    scans_m: Sequence[FloatArray],
    mounting: Mounting,
    airframe_radius_m: float = 0.0,
    near_m: float = NEAR_M,
) -> OwnAirframe | None:
    """What of several scans [n, 3] of one sensor, in its frame, is probably the own airframe.

    airframe_radius_m: what is known already. None where nothing near stands still in all scans, or
    there are fewer than three.
    """
    if len(scans_m) < FEWEST_SCANS:
        return None
    near = [_near(points, mounting, airframe_radius_m, near_m) for points in scans_m]
    still = near[0]
    for other in near[1:]:
        if not len(still) or not len(other):
            return None
        still = still[_is_met(still, other)]
    if not len(still):
        return None
    ranges = np.linalg.norm(still, axis=1)
    placed = still @ mounting.body_from_sensor.T + mounting.position_m
    radius = float(np.linalg.norm(placed, axis=1).max()) + VOXEL_M
    return OwnAirframe(
        len(still),
        len(scans_m),
        float(ranges.min()),
        float(ranges.max()),
        float(np.ceil(20.0 * radius) / 20.0),
    )


def _near(points: FloatArray, mounting: Mounting, airframe_m: float, near_m: float) -> FloatArray:
    """Finite returns nearer than a distance that are not known to be the airframe's."""
    points = np.asarray(points, dtype=np.float64)
    points = points[np.all(np.isfinite(points), axis=1)]
    squared = np.einsum("ij,ij->i", points, points)
    points = points[(squared > 0.0) & (squared < near_m**2)]
    placed = points @ mounting.body_from_sensor.T + mounting.position_m
    outside: FloatArray = points[np.einsum("ij,ij->i", placed, placed) >= airframe_m**2]
    return outside


def _is_met(still: FloatArray, other: FloatArray) -> BoolArray:
    """Whether each point has one of the other scan within a voxel's width."""
    from scipy.spatial import cKDTree

    distances_m: FloatArray = cKDTree(other).query(still, distance_upper_bound=VOXEL_M)[0]
    return np.asarray(distances_m <= VOXEL_M, dtype=np.bool_)
