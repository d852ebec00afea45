"""Upright columns on level ground: trees, pillars and masts, of which a world may hold hundreds.

Rays and distances have closed forms here, and a bundle of rays looks only at the columns ahead.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.brief import one_line
from clearway.base.checks import check_points
from clearway.base.compiled import compiled, make_plain_array
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Obstacle

BUNDLE = 50
"""Rays that share one look for what may lie ahead: a sweep of a scanner at one azimuth."""
UPRIGHT = 1e-12
"""Level part of a direction below which a ray counts as vertical."""
GROUND_M = (2000.0, 2000.0, 2.0)
"""Extent of level ground where it stands on a map."""
GRAZING_M = 1e-9
"""By which a bundle looks wider than it is, for rounding."""


class Columns:
    """Upright cylinders, flat at both ends, and the ground that they stand on. Immutable.

    Parameters
    ----------
    rows_m : array [n, 5]
        x and y of the axis, radius, lowest and highest height of each column, world frame.
    ground_m : float
        Height of level ground; -inf for none.

    Raises
    ------
    ClearwayError
        For rows that are no columns.

    Examples
    --------
    >>> from clearway.obstacles.columns import Columns
    >>> Columns([[6.0, 0.0, 1.5, 0.0, 8.0]]).distance_m([[0.0, 0.0, 2.0]]).tolist()
    [4.5]
    """

    __slots__ = ("__dict__", "ground_m", "rows_m")

    rows_m: FloatArray
    ground_m: float

    def __init__(self, rows_m: npt.ArrayLike, *, ground_m: float = -np.inf) -> None:
        rows = np.array(rows_m, dtype=np.float64).reshape(-1, 5)
        is_one = np.all(np.isfinite(rows), axis=1) & (rows[:, 2] > 0.0) & (rows[:, 3] < rows[:, 4])
        if not np.all(is_one):
            first = int(np.argmin(is_one))
            raise ClearwayError(
                f"columns: row {first} is {rows[first].tolist()}; five finite numbers are needed, "
                "x, y, radius above 0, lowest and highest height"
            )
        rows.setflags(write=False)
        self.rows_m, self.ground_m = rows, float(ground_m)

    def __repr__(self) -> str:
        return one_line("Columns", (f"{len(self)} columns", f"ground at {self.ground_m:g} m"))

    def __len__(self) -> int:
        return len(self.rows_m)

    @cached_property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The columns as map shapes that hold them: capsules, rounded beyond both ends."""
        return tuple(
            Obstacle.line_between((x, y, low), (x, y, high), radius_m=radius, name=f"column {n}")
            for n, (x, y, radius, low, high) in enumerate(self.rows_m.tolist())
        )

    @property
    def charted(self) -> tuple[Obstacle, ...]:
        """The columns and the ground as shapes of a map, which hold them."""
        if self.ground_m == -np.inf:
            return self.obstacles
        middle = self.rows_m[:, :2].mean(axis=0) if len(self) else np.zeros(2)
        center = (*middle, self.ground_m - 0.5 * GROUND_M[2])
        return (*self.obstacles, Obstacle.cuboid(center, GROUND_M, name="ground"))

    def move(self, shift_m: npt.ArrayLike, yaw_rad: float) -> Columns:
        """Return the columns turned about the vertical axis of the origin, then shifted by [3]."""
        x, y, z = np.asarray(shift_m, dtype=np.float64)
        rows, cosine, sine = self.rows_m.copy(), np.cos(yaw_rad), np.sin(yaw_rad)
        rows[:, 0] = x + cosine * self.rows_m[:, 0] - sine * self.rows_m[:, 1]
        rows[:, 1] = y + sine * self.rows_m[:, 0] + cosine * self.rows_m[:, 1]
        rows[:, 3:] += z
        return Columns(rows, ground_m=self.ground_m + float(z))

    def nearest(self, points_m: npt.ArrayLike) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Signed distance [n] of world points [n, 3] and whose it is [n]; -1 for ground or none."""
        points = check_points("columns: points", points_m)
        distance, owner = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
        find_nearest_columns(points, self.rows_m, self.ground_m, distance, owner)
        return distance, owner

    def distance_m(self, points_m: npt.ArrayLike) -> FloatArray:
        """Signed distance [n] of world points [n, 3] to the nearest surface; inf without any."""
        return self.nearest(points_m)[0]

    def cast(
        self, origin_m: npt.ArrayLike, directions: npt.ArrayLike, max_range_m: float
    ) -> FloatArray:
        """Range [n] from a world point [3] along unit directions [n, 3]; inf where none is met, 0
        from inside a column."""
        origin = make_plain_array(np.asarray(origin_m, dtype=np.float64))
        ways = check_points("columns: directions", directions)
        return cast_columns(origin, ways, float(max_range_m), self.rows_m, self.ground_m)


@compiled
def find_nearest_columns(
    points: Floats2, rows: Floats2, ground: float, distance: Floats, owner: Ints
) -> None:
    """Fill in signed distance and index of the nearest column of each point; -1: the ground."""
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        best, whose = z - ground, -1
        for n in range(len(rows)):
            dx, dy = x - rows[n, 0], y - rows[n, 1]
            # To the side first: most columns are farther away than the best already.
            reach = best + rows[n, 2]
            if best >= 0.0 and dx * dx + dy * dy >= reach * reach:
                continue
            beside = math.sqrt(dx * dx + dy * dy) - rows[n, 2]
            above = max(rows[n, 3] - z, z - rows[n, 4])
            apart = max(beside, above)
            if beside > 0.0 and above > 0.0:
                apart = math.sqrt(beside * beside + above * above)
            if apart < best:
                best, whose = apart, n
        distance[p], owner[p] = best, whose


@compiled
def cast_columns(
    origin: Floats, directions: Floats2, max_range: float, rows: Floats2, ground: float
) -> Floats:
    """Range [n] along unit directions [n, 3] from an origin; inf where nothing is in range.

    Quickest where neighbours in the list are neighbours in azimuth.
    """
    x, y, z = origin[0], origin[1], origin[2]
    apart = np.empty(len(rows))
    for n in range(len(rows)):
        apart[n] = math.hypot(rows[n, 0] - x, rows[n, 1] - y) - rows[n, 2]
    order = np.argsort(apart)
    near = np.empty((len(rows), 6))
    count = 0
    for k in range(len(rows)):
        n = order[k]
        if apart[n] > max_range:
            break
        near[count, 0], near[count, 1], near[count, 2] = rows[n, 0] - x, rows[n, 1] - y, rows[n, 2]
        near[count, 3], near[count, 4], near[count, 5] = rows[n, 3] - z, rows[n, 4] - z, apart[n]
        count += 1
    ranges = np.empty(len(directions))
    ahead = np.empty(count, dtype=np.int64)
    for begin in range(0, len(directions), BUNDLE):
        end = min(begin + BUNDLE, len(directions))
        held = _look_ahead(directions, begin, end, near, count, ahead)
        for b in range(begin, end):
            ux, uy, uz = directions[b, 0], directions[b, 1], directions[b, 2]
            best = math.inf
            if z <= ground:
                best = 0.0
            elif uz < 0.0:
                best = (ground - z) / uz
            entry = _meet_columns(ux, uy, uz, near, ahead, held, min(best, max_range))
            best = min(best, entry)
            ranges[b] = best if best <= max_range else math.inf
    return ranges


@compiled
def _look_ahead(
    directions: Floats2, begin: int, end: int, near: Floats2, count: int, ahead: Ints
) -> int:
    """Fill in which columns some rays may meet, nearest first; how many."""
    ux, uy = directions[begin, 0], directions[begin, 1]
    right, left = 0.0, 0.0
    level = math.hypot(ux, uy)
    # Sines of the azimuths about the first ray's; beyond a right angle all columns are looked at.
    wide = level < UPRIGHT
    for b in range(begin + 1, end):
        vx, vy = directions[b, 0], directions[b, 1]
        length = level * math.hypot(vx, vy)
        if wide or length < UPRIGHT or ux * vx + uy * vy <= 0.0:
            wide = True
            break
        sine = (ux * vy - uy * vx) / length
        right, left = min(right, sine), max(left, sine)
    held = 0
    hx, hy = (1.0, 0.0) if wide else (ux / level, uy / level)
    right_cosine, left_cosine = math.sqrt(1.0 - right * right), math.sqrt(1.0 - left * left)
    for k in range(count):
        radius = near[k, 2] + GRAZING_M
        if not wide and near[k, 5] > 0.0:
            forward = near[k, 0] * hx + near[k, 1] * hy
            aside = near[k, 1] * hx - near[k, 0] * hy
            # Left of the leftmost ray, or right of the rightmost, by more than the radius.
            if aside * left_cosine - forward * left > radius:
                continue
            if aside * right_cosine - forward * right < -radius:
                continue
            if forward < -radius and right > -0.7 and left < 0.7:
                continue
        ahead[held] = k
        held += 1
    return held


@compiled
def _meet_columns(
    ux: float, uy: float, uz: float, near: Floats2, ahead: Ints, held: int, farthest: float
) -> float:
    """Range along a unit direction to the first of some columns; inf beyond `farthest`."""
    best = math.inf
    level = math.sqrt(ux * ux + uy * uy)
    reach = farthest * level
    for i in range(held):
        k = ahead[i]
        if near[k, 5] > reach:
            break
        cx, cy, radius, low, high = near[k, 0], near[k, 1], near[k, 2], near[k, 3], near[k, 4]
        # The part of the way that is over, in or under the column, as ranges.
        enter, leave = 0.0, math.inf
        if level > UPRIGHT:
            middle = (cx * ux + cy * uy) / level
            aside = (cy * ux - cx * uy) / level
            chord = radius * radius - aside * aside
            if chord <= 0.0:
                continue
            half = math.sqrt(chord)
            enter, leave = (middle - half) / level, (middle + half) / level
        elif cx * cx + cy * cy >= radius * radius:
            continue
        if uz != 0.0:
            first, second = low / uz, high / uz
            enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
        elif low > 0.0 or high < 0.0:
            continue
        enter = max(enter, 0.0)
        if enter <= leave and enter < best and enter <= farthest:
            best = enter
            reach = best * level
    return best
