"""Coating (def. 5, def. 6): cells that balls around hit points reach into; fewer balls for many.

A cell may be 0.2 m wide where 0.6 m must be kept, so hits alone cannot protect: each hit point is
inflated by the safety margin and by half the beam spacing, and marks every cell that it meets.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.base.compiled import borrowing, compiled, read_only
from clearway.base.frames import FloatArray
from clearway.base.grid import RANGE_TOLERANCE, AvoidanceGrid, GridEdges
from clearway.base.rounding import SURELY
from clearway.base.state import BoolArray
from clearway.sensors.voxels import merge_balls, number_voxels


def coated_cells(grid: AvoidanceGrid, points_m: FloatArray, radius_m: npt.ArrayLike) -> BoolArray:
    """[cells] cells that meet the ball of any point [m, 3] of the grid frame, (3.8), (3.9).

    radius_m: [m] or one for all: margin plus half the beam spacing there. Exact: the distance
    from a point to a polar cell has a closed form.
    """
    if not len(points_m):
        return np.zeros(grid.cells, dtype=np.bool_)
    points = read_only(points_m)
    return _coated(points, _radii(radius_m, len(points)), grid.edges)


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
def _coated(points: FloatArray, radii: FloatArray, edges: GridEdges) -> BoolArray:
    azimuth, elevation, ranges = edges.azimuth_rad, edges.elevation_rad, edges.range_m
    columns, rows, layers = len(azimuth) - 1, len(elevation) - 1, len(ranges) - 1
    cos_azimuth, sin_azimuth = np.cos(azimuth), np.sin(azimuth)
    cos_elevation, sin_elevation = np.cos(elevation), np.sin(elevation)
    nearest, farthest = ranges[0], ranges[layers]
    tolerance = RANGE_TOLERANCE * farthest
    # Of a grid no wider than half a circle, most balls lie beyond the planes at its sides.
    sided = azimuth[columns] - azimuth[0] <= np.pi
    right_x, right_y = -sin_azimuth[0], cos_azimuth[0]
    left_x, left_y = sin_azimuth[columns], -cos_azimuth[columns]
    coated = np.zeros(layers * columns * rows, dtype=np.bool_)
    for n in range(len(points)):
        x, y, z, radius = points[n, 0], points[n, 1], points[n, 2], radii[n] + tolerance
        horizontal = np.sqrt(x * x + y * y)
        squared = x * x + y * y + z * z
        distance = np.sqrt(squared)
        if distance - radius > farthest or distance + radius < nearest:
            continue
        if sided and min(right_x * x + right_y * y, left_x * x + left_y * y) < -SURELY * radius:
            continue
        own_azimuth = np.arctan2(y, x)
        for j in range(columns):
            # Horizontal part of the point along the column's nearest vertical half-plane.
            along = horizontal
            if own_azimuth < azimuth[j] or own_azimuth > azimuth[j + 1]:
                along = max(
                    x * cos_azimuth[j] + y * sin_azimuth[j],
                    x * cos_azimuth[j + 1] + y * sin_azimuth[j + 1],
                )
                reached = max(along, 0.0)
                if x * x + y * y - reached * reached > radius * radius:
                    continue
            best = np.sqrt(along * along + z * z)
            for k in range(rows):
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
                if inside < 0.0:
                    continue
                half_chord = np.sqrt(inside)
                low, high = projected - half_chord, projected + half_chord
                for i in range(layers):
                    if ranges[i] > high:
                        break
                    if ranges[i + 1] >= low:
                        coated[(i * columns + j) * rows + k] = True
    return coated


@borrowing
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
