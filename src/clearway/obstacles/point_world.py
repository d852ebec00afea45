"""A world of balls at the points of a cloud: surveys and scans as the truth of a simulation."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.brief import one_line
from clearway.base.checks import check_floats, fits_float, shape_of
from clearway.base.compiled import compiled, read_only
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

VOXELS_PER_POINT = 4.0
MAX_VOXELS = 2**25


class Voxels(NamedTuple):
    """Balls sorted into the voxels that they reach into."""

    corner: Floats
    """[3] lowest corner, world frame."""
    size: float
    shape: Ints
    """[3]"""
    first: Ints
    """[voxels + 1] where a voxel's balls begin in `centers` (CSR)."""
    centers: Floats2
    """[entries, 3]; a ball stands once in every voxel that it may reach into."""


class PointWorld:
    """Balls of one radius at points of the world frame; satisfies `World`.

    Parameters
    ----------
    points_m
        [n, 3] centres, world frame.
    point_radius_m
        Of every ball.
    labels
        [n] class of each point, kept for callers.

    Raises
    ------
    ClearwayError
        For anything but finite points and a radius above 0.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> cw.PointWorld(np.array([[5.0, 0.0, 0.0]]), 0.5).distance_m(np.zeros((1, 3))).tolist()
    [4.5]
    """

    def __init__(
        self,
        points_m: FloatArray,
        point_radius_m: float,
        *,
        labels: npt.NDArray[np.integer] | None = None,
    ) -> None:
        points = read_only(check_floats("point world: points_m", points_m))
        if points.ndim != 2 or points.shape[1] != 3 or not np.all(np.isfinite(points)):
            raise ClearwayError("point world: points must be finite numbers of shape [n, 3]")
        if not (fits_float(point_radius_m) and 0.0 < point_radius_m < np.inf):
            raise ClearwayError(
                f"point world: point_radius_m must be a number above 0, got {point_radius_m}"
            )
        if labels is not None and shape_of(labels) != points.shape[:1]:
            raise ClearwayError(
                f"point world: labels must have shape [{len(points)}], one a point, "
                f"got {list(shape_of(labels))}"
            )
        self.points_m = points
        self.point_radius_m = float(point_radius_m)
        self.labels = labels

    def __repr__(self) -> str:
        balls = f"{len(self.points_m):,} balls of {self.point_radius_m:g} m"
        return one_line("PointWorld", (balls,))

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """Return the distance of points to the nearest ball.

        Parameters
        ----------
        points_m
            [n, 3] world frame.

        Returns
        -------
        FloatArray
            [n] signed distance in metres; inf without any ball.
        """
        if not len(self.points_m):
            return np.full(len(points_m), np.inf)
        distances: FloatArray = self._tree.query(points_m)[0]
        return distances - self.point_radius_m

    def cast(self, origin_m: FloatArray, directions: FloatArray, max_range_m: float) -> FloatArray:
        """Cast rays from a point.

        Parameters
        ----------
        origin_m
            [3] where they begin, world frame.
        directions
            [n, 3] unit vectors, world frame.
        max_range_m
            Beyond which nothing is met.

        Returns
        -------
        FloatArray
            [n] range in metres of the first ball; 0 from inside one, inf where nothing is met.
        """
        if not len(self.points_m):
            return np.full(len(directions), np.inf)
        origin = read_only(origin_m)
        return _cast(
            origin, read_only(directions), float(max_range_m), self._voxels, self.point_radius_m
        )

    @cached_property
    def _tree(self) -> cKDTree:
        from scipy.spatial import cKDTree

        # Unbalanced and uncompacted: queries are as fast, building takes half the time.
        return cKDTree(self.points_m, balanced_tree=False, compact_nodes=False)

    @cached_property
    def _voxels(self) -> Voxels:
        radius = self.point_radius_m
        low = self.points_m.min(axis=0) - radius
        extent = self.points_m.max(axis=0) + radius - low
        wanted = min(VOXELS_PER_POINT * len(self.points_m), MAX_VOXELS)
        size = max(2.0 * radius, float(np.cbrt(np.prod(extent) / wanted)))
        shape = np.floor(extent / size).astype(np.int64) + 1
        return Voxels(low, size, shape, *_sort(self.points_m, radius, low, size, shape))


@compiled
def _sort(
    points: Floats2, radius: float, corner: Floats, size: float, shape: Ints
) -> tuple[Ints, Floats2]:
    """Counting sort of the balls into voxels: where each begins, and the centres."""
    first = np.zeros(shape[0] * shape[1] * shape[2] + 1, dtype=np.int64)
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for n in range(len(points)):
        _fill_reached(points[n], radius, corner, size, shape, low, high)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    first[(i * shape[1] + j) * shape[2] + k + 1] += 1
    first = np.cumsum(first)
    filled = first[:-1].copy()
    centers = np.empty((first[-1], 3))
    for n in range(len(points)):
        _fill_reached(points[n], radius, corner, size, shape, low, high)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    voxel = (i * shape[1] + j) * shape[2] + k
                    centers[filled[voxel]] = points[n]
                    filled[voxel] += 1
    return first, centers


@compiled
def _fill_reached(
    point: Floats,
    radius: float,
    corner: Floats,
    size: float,
    shape: Ints,
    low: Ints,
    high: Ints,
) -> None:
    """Fill in the lowest and highest voxel per axis that a ball reaches into."""
    for axis in range(3):
        offset = point[axis] - corner[axis]
        low[axis] = max(int((offset - radius) / size), 0)
        high[axis] = min(int((offset + radius) / size), shape[axis] - 1)


@compiled
def _cast(
    origin: Floats, directions: Floats2, max_range: float, voxels: Voxels, radius: float
) -> Floats:
    corner, size, shape = voxels.corner, voxels.size, voxels.shape
    ranges = np.empty(len(directions))
    start = origin - corner
    for n in range(len(directions)):
        direction = directions[n]
        enter, leave = 0.0, max_range
        for axis in range(3):
            if direction[axis] == 0.0:
                if start[axis] < 0.0 or start[axis] > shape[axis] * size:
                    leave = -1.0
                continue
            near = -start[axis] / direction[axis]
            far = (shape[axis] * size - start[axis]) / direction[axis]
            enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
        ranges[n] = np.inf
        if enter <= leave:
            ranges[n] = _walk(origin, start, direction, enter, leave, voxels, radius)
    return ranges


@compiled
def _walk(
    origin: Floats,
    start: Floats,
    direction: Floats,
    enter: float,
    leave: float,
    voxels: Voxels,
    radius: float,
) -> float:
    """First ball along a ray between two ranges, voxel by voxel."""
    size, shape, first, centers = voxels.size, voxels.shape, voxels.first, voxels.centers
    i, step_i, next_i, pace_i = _axis(start[0], direction[0], enter, size, shape[0])
    j, step_j, next_j, pace_j = _axis(start[1], direction[1], enter, size, shape[1])
    k, step_k, next_k, pace_k = _axis(start[2], direction[2], enter, size, shape[2])
    ox, oy, oz = origin[0], origin[1], origin[2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    best = np.inf
    while True:
        voxel = (i * shape[1] + j) * shape[2] + k
        for entry in range(first[voxel], first[voxel + 1]):
            x, y, z = centers[entry, 0] - ox, centers[entry, 1] - oy, centers[entry, 2] - oz
            along = x * dx + y * dy + z * dz
            excess = x * x + y * y + z * z - radius * radius
            chord = along * along - excess
            if chord >= 0.0 and (along >= 0.0 or excess <= 0.0):
                best = min(best, max(along - np.sqrt(chord), 0.0))
        passed = min(next_i, next_j, next_k)
        if best <= passed or passed > leave:
            return best if best <= leave else np.inf
        if next_i == passed:
            i, next_i = i + step_i, next_i + pace_i
            if i < 0 or i >= shape[0]:
                return best if best <= leave else np.inf
        elif next_j == passed:
            j, next_j = j + step_j, next_j + pace_j
            if j < 0 or j >= shape[1]:
                return best if best <= leave else np.inf
        else:
            k, next_k = k + step_k, next_k + pace_k
            if k < 0 or k >= shape[2]:
                return best if best <= leave else np.inf


@compiled
def _axis(
    start: float, direction: float, enter: float, size: float, count: int
) -> tuple[int, int, float, float]:
    """Along one axis: voxel at the entry, step, range of the next border, range per voxel."""
    voxel = min(max(int(np.floor((start + enter * direction) / size)), 0), count - 1)
    if direction == 0.0:
        return voxel, 0, np.inf, np.inf
    step = 1 if direction > 0.0 else -1
    border = (voxel + 1) * size if direction > 0.0 else voxel * size
    return voxel, step, (border - start) / direction, size / abs(direction)
