"""Coating (def. 5, def. 6): cells that balls around hit points reach into; fewer balls for many.

A cell may be 0.2 m wide where 0.6 m must be kept, so hits alone cannot protect: each hit point is
inflated by the safety margin and by half the beam spacing, and marks every cell that it meets.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Bools, Bools2, Floats, Floats2, Ints
from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray
from clearway.base.grid import RANGE_TOLERANCE, AvoidanceGrid, GridEdges
from clearway.base.rounding import SURELY
from clearway.base.state import BoolArray
from clearway.sensors.voxels import merge_balls, number_voxels

AT_ONCE = 62
"""Layers of which each has a bit of a number."""


def inflate_points(grid: AvoidanceGrid, points_m: FloatArray, radius_m: npt.ArrayLike) -> BoolArray:
    """[cells] cells that meet the ball of any point [m, 3] of the grid frame, (3.8), (3.9).

    radius_m: [m] or one for all: margin plus half the beam spacing there. Exact: the distance
    from a point to a polar cell has a closed form.
    """
    if not len(points_m):
        return np.zeros(grid.cells, dtype=np.bool_)
    points = read_only(points_m)
    return find_inflated_cells(points, _radii(radius_m, len(points)), grid.edges)


def thin_points(
    points_m: FloatArray, radius_m: npt.ArrayLike, voxel_m: float
) -> tuple[FloatArray, FloatArray]:
    """One ball for all the balls that have their centres in the same voxel: points, radii.

    It sits at the mean of their centres and covers them all, so nothing comes nearer than it
    was. radius_m: [m] or one for all.
    """
    points = read_only(points_m)
    radii = _radii(radius_m, len(points))
    voxel_of, voxels = number_voxels(points, float(voxel_m))
    return merge_balls(points, radii, voxel_of, voxels)


def _radii(radius_m: npt.ArrayLike, count: int) -> FloatArray:
    radii = np.asarray(radius_m, dtype=np.float64)
    return read_only(radii if radii.shape == (count,) else np.broadcast_to(radii, (count,)))


@compiled
def find_inflated_cells(points: Floats2, radii: Floats, edges: GridEdges) -> Bools:
    """[cells] cells that meet any ball of a radius [m] around a point [m, 3]."""
    columns, rows = len(edges.azimuth_rad) - 1, len(edges.elevation_rad) - 1
    layers = len(edges.range_m) - 1
    coated = np.zeros((layers, columns * rows), dtype=np.bool_)
    cosines = np.cos(edges.azimuth_rad), np.cos(edges.elevation_rad)
    sines = np.sin(edges.azimuth_rad), np.sin(edges.elevation_rad)
    seen_along = np.empty(columns + 1), np.empty(columns + 1)
    marks = np.empty(columns * rows, dtype=np.int64), np.empty(columns, dtype=np.int64)
    for first in range(0, layers, AT_ONCE):
        last = min(first + AT_ONCE, layers)
        _coat(points, radii, edges, first, last, cosines, sines, seen_along, marks)
        _note_marked(marks[0], coated[first:last])
    return coated.ravel()


@compiled
def _coat(
    points: Floats2,
    radii: Floats,
    edges: GridEdges,
    first_layer: int,
    last_layer: int,
    cosines: tuple[Floats, Floats],
    sines: tuple[Floats, Floats],
    seen_along: tuple[Floats, Floats],
    marks: tuple[Ints, Ints],
) -> None:
    """Mark the cells of some layers, each by a bit. cosines, sines: of azimuth and elevation edges.
    seen_along: [edges] to be filled in, how far a point lies along and to the left of each vertical
    half-plane. marks: [columns * rows], and [columns] what is marked in all rows, filled in too."""
    azimuth, elevation = edges.azimuth_rad, edges.elevation_rad
    ranges = edges.range_m[first_layer : last_layer + 1]
    columns, rows, layers = len(azimuth) - 1, len(elevation) - 1, len(ranges) - 1
    (cos_azimuth, cos_elevation), (sin_azimuth, sin_elevation) = cosines, sines
    along_edge, left_of_edge = seen_along
    marked, marked_in_column = marks
    nearest, farthest = edges.range_m[0], edges.range_m[-1]
    tolerance = RANGE_TOLERANCE * farthest
    # Of a grid no wider than half a circle, most balls lie beyond the planes at its sides.
    sided = azimuth[columns] - azimuth[0] <= np.pi
    narrow = True
    for j in range(columns):
        narrow &= azimuth[j + 1] - azimuth[j] < np.pi
    marked[:], marked_in_column[:], marked_everywhere = 0, 0, 0
    for n in range(len(points)):
        if marked_everywhere == (1 << layers) - 1:  # Of very many, long before the last.
            return
        x, y, z, radius = points[n, 0], points[n, 1], points[n, 2], radii[n] + tolerance
        horizontal = np.sqrt(x * x + y * y)
        squared = x * x + y * y + z * z
        distance = np.sqrt(squared)
        if distance - radius > farthest or distance + radius < nearest:
            continue
        first, last = _layers_met(
            distance - radius - tolerance, distance + radius + tolerance, ranges
        )
        # Where there are many points, most have nothing to add.
        met = ((1 << (last - first)) - 1) << first
        if met & ~marked_everywhere == 0:
            continue
        for j in range(columns + 1):
            along_edge[j] = x * cos_azimuth[j] + y * sin_azimuth[j]
            left_of_edge[j] = y * cos_azimuth[j] - x * sin_azimuth[j]
        if sided and min(left_of_edge[0], -left_of_edge[columns]) < -SURELY * radius:
            continue
        # Off a column whose half-planes it lies less far along than this, it is too far away.
        beyond, least_along = x * x + y * y - radius * radius, -np.inf
        if narrow and beyond > 0.0:
            least_along = np.sqrt(beyond) / SURELY
        unsure = (SURELY - 1.0) * horizontal
        for j in range(columns):
            if met & ~marked_in_column[j] == 0:
                continue
            along, left, right = (
                max(along_edge[j], along_edge[j + 1]),
                left_of_edge[j],
                -left_of_edge[j + 1],
            )
            off = left < -unsure or right < -unsure
            if off and along < least_along:
                continue
            if not narrow or (not off and (left <= unsure or right <= unsure)):
                own_azimuth = np.arctan2(y, x)
                off = own_azimuth < azimuth[j] or own_azimuth > azimuth[j + 1]
            if off:
                # Horizontal part of the point along the column's nearest vertical half-plane.
                reached = max(along, 0.0)
                if x * x + y * y - reached * reached > radius * radius:
                    continue
            else:
                along = horizontal
            best, in_all_rows = np.sqrt(along * along + z * z), -1
            for k in range(rows):
                at = j * rows + k
                if met & ~marked[at] != 0:
                    projected = _projection(
                        along,
                        z,
                        best,
                        cos_elevation[k],
                        sin_elevation[k],
                        cos_elevation[k + 1],
                        sin_elevation[k + 1],
                    )
                    inside = projected * projected - squared + radius * radius
                    if inside >= 0.0:
                        half_chord = np.sqrt(inside)
                        marked[at] |= _layers_between(
                            projected - half_chord, projected + half_chord, first, last, ranges
                        )
                in_all_rows &= marked[at]
            if in_all_rows != marked_in_column[j]:
                marked_in_column[j] = in_all_rows
                marked_everywhere = _in_all(marked_in_column)


@compiled
def _layers_met(nearest: float, farthest: float, ranges: Floats) -> tuple[int, int]:
    """The first layer that reaches beyond a distance, and the one after the last that begins within
    another."""
    layers = len(ranges) - 1
    first, last = 0, layers
    while first < layers and ranges[first + 1] < nearest:
        first += 1
    while last > first and ranges[last - 1] > farthest:
        last -= 1
    return first, last


@compiled
def _layers_between(low: float, high: float, first: int, last: int, ranges: Floats) -> int:
    """Those among some layers that a stretch of distances reaches into, each by a bit."""
    found = 0
    for i in range(first, last):
        if ranges[i] > high:
            break
        if ranges[i + 1] >= low:
            found |= 1 << i
    return found


@compiled
def _in_all(marks: Ints) -> int:
    """What is marked in all."""
    found = -1
    for each in marks:
        found &= each
    return found


@compiled
def _note_marked(marked: Ints, coated: Bools2) -> None:
    """Fill in [layers, columns * rows] what is marked."""
    for at in range(len(marked)):
        for layer in range(len(coated)):
            coated[layer, at] = marked[at] & (1 << layer) != 0


@compiled
def _projection(
    along: float,
    z: float,
    best: float,
    cos_low: float,
    sin_low: float,
    cos_high: float,
    sin_high: float,
) -> float:
    """Largest projection of (along, z) onto the directions of a row of elevations."""
    if z * cos_low >= along * sin_low and z * cos_high <= along * sin_high:
        return best
    return max(along * cos_low + z * sin_low, along * cos_high + z * sin_high)
