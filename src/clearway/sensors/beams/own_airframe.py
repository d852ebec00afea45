"""Returns of the own airframe: near ones that stand still in every scan, in the sensor's frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.sensors.beams.lidar import Mounting

NEAR_M = 1.0
"""What begins nearer than this and stands still is of the own airframe, or of a rig or bench about
it; a vehicle that stands itself has walls about it farther away."""
FAR_M = 1.5
"""How far out its end is looked for."""
STEP_M = 0.1
THIN_SHARE = 0.02
"""It ends where a step further out adds less than this share of it."""
MANY_SHARE = 0.1
"""Of a scan: legs and arms are in no more of it."""
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
    share: float
    """Of all returns of the first scan."""

    def in_words(self) -> str:
        """What it looks like, and what to set."""
        span = f"{self.nearest_m:.2f} m"
        if self.farthest_m - self.nearest_m >= 0.01:
            span = f"{self.nearest_m:.2f} to {self.farthest_m:.2f} m"
        one = self.returns == 1
        count = f"{self.returns} return{'' if one else 's'} {span} from the sensor"
        what = "the own airframe"
        if self.share > MANY_SHARE:
            what = f"a rig or a bench about the sensor ({100.0 * self.share:.0f} % of the scan)"
        return (
            f"{count} stand{'s' if one else ''} still in each of {self.scans} scans: probably "
            f"{what}; airframe_radius_m of [scan], or --airframe-radius {self.radius_m:g}, leaves "
            f"{'it' if one else 'them'} out, with all that comes as near"
        )


def own_airframe(
    scans_m: Sequence[FloatArray],
    mounting: Mounting,
    airframe_radius_m: float = 0.0,
) -> OwnAirframe | None:
    """What of several scans [n, 3] of one sensor, in its frame, is probably the own airframe.

    airframe_radius_m: what is known already. None where nothing near stands still in all scans, or
    there are fewer than three.
    """
    if len(scans_m) < FEWEST_SCANS:
        return None
    near = [_near(points, mounting, airframe_radius_m) for points in scans_m]
    still = near[0]
    for other in near[1:]:
        if not len(still) or not len(other):
            return None
        still = still[_is_met(still, other)]
    if not len(still):
        return None
    distances = np.linalg.norm(still @ mounting.body_from_sensor.T + mounting.position_m, axis=1)
    still = still[distances <= _end_m(distances)]
    ranges = np.linalg.norm(still, axis=1)
    if ranges.min() >= NEAR_M:
        return None
    placed = still @ mounting.body_from_sensor.T + mounting.position_m
    radius = float(np.linalg.norm(placed, axis=1).max()) + VOXEL_M
    return OwnAirframe(
        len(still),
        len(scans_m),
        float(ranges.min()),
        float(ranges.max()),
        float(np.ceil(20.0 * radius) / 20.0),
        len(still) / len(scans_m[0]),
    )


def _end_m(distances_m: FloatArray) -> float:
    """Where what begins nearest ends: the first step out that adds hardly anything."""
    end = float(distances_m.min()) + STEP_M
    while end < FAR_M:
        within = int(np.count_nonzero(distances_m <= end))
        more = int(np.count_nonzero(distances_m <= end + STEP_M)) - within
        if more <= THIN_SHARE * within:
            break
        end += STEP_M
    return end


def _near(points: FloatArray, mounting: Mounting, airframe_m: float) -> FloatArray:
    """Finite returns that are near, and not known to be the airframe's."""
    points = np.asarray(points, dtype=np.float64)
    points = points[np.all(np.isfinite(points), axis=1)]
    squared = np.einsum("ij,ij->i", points, points)
    points = points[(squared > 0.0) & (squared < FAR_M**2)]
    placed = points @ mounting.body_from_sensor.T + mounting.position_m
    outside: FloatArray = points[np.einsum("ij,ij->i", placed, placed) >= airframe_m**2]
    return outside


def _is_met(still: FloatArray, other: FloatArray) -> BoolArray:
    """Whether each point has one of the other scan within a voxel's width."""
    from scipy.spatial import cKDTree

    distances_m: FloatArray = cKDTree(other).query(still, distance_upper_bound=VOXEL_M)[0]
    return np.asarray(distances_m <= VOXEL_M, dtype=np.bool_)
