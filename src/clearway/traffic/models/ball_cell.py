"""A ball against one cell: exact distance, and the share of the cell that the ball fills (6.9).

The share is a sum over parts of the cell, each about a cube, cut by the ball's surface as by a
plane. Both take a point in the grid's frame.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2, Floats3, Floats4, Ints3
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.traffic.models.borders import (
    AZIMUTH_COS,
    AZIMUTH_SIN,
    ELEVATION_COS,
    ELEVATION_SIN,
    RANGE,
    Borders,
)

RADIUS = 0
RADIAL_WEIGHT = 1
COSINE = 0
SINE = 1
WEIGHT = 2
HALF_RANGE = 0
HALF_AZIMUTH = 1
HALF_ELEVATION = 2
BOUND_M = 3
TINY = 1e-300
LEAST_SLIM = 1e-18
"""Square of the least width of a box across, as a share of its greatest: none is flat."""


class CellParts(NamedTuple):
    """How each cell is cut into parts; the first index of a table is the number of parts."""

    counts: Ints3
    """[layers, rows, 3] parts along range, azimuth and elevation."""
    radial: Floats4
    """[2, parts + 1, layers, parts] radius of a part's centre (m), and its share of the layer."""
    level: Floats4
    """[2, parts + 1, columns, parts] cosine and sine of a part's azimuth."""
    upright: Floats4
    """[3, parts + 1, rows, parts] cosine and sine of its elevation, and its share of the row."""
    sizes: Floats3
    """[4, layers, rows] half-widths of a part, and radius of a ball around the cell (m)."""
    center_m: Floats2
    """[cells, 3] centre of that ball."""


@lru_cache(maxsize=8)
def cell_parts(grid: AvoidanceGrid, parts: int) -> CellParts:
    """Cut every cell of a grid into about so many parts."""
    ranges, azimuths, elevations = grid.edges
    # Most of a cell's volume is in its outer part.
    middle_m = 0.75 * np.diff(ranges**4) / np.diff(ranges**3)
    wide = np.max(np.diff(azimuths))
    extent = np.empty((grid.layers, grid.rows, 3))
    extent[..., 0] = np.diff(ranges)[:, None]
    extent[..., 1] = middle_m[:, None] * np.cos(0.5 * (elevations[1:] + elevations[:-1])) * wide
    extent[..., 2] = middle_m[:, None] * np.diff(elevations)
    side = np.cbrt(np.prod(extent, axis=-1, keepdims=True) / parts)
    # No more along one axis than there are parts in all, however slender the cell.
    counts = np.clip(np.rint(extent / side), 1, parts).astype(np.int64)
    most = int(counts.max())
    radial = np.zeros((2, most + 1, grid.layers, most))
    level = np.zeros((2, most + 1, grid.columns, most))
    upright = np.zeros((3, most + 1, grid.rows, most))
    for n in np.unique(counts):
        cuts = _cuts(ranges, n)
        cubes = np.diff(cuts**3)
        radial[RADIUS, n, :, :n] = 0.75 * np.diff(cuts**4) / cubes
        radial[RADIAL_WEIGHT, n, :, :n] = cubes / np.sum(cubes, axis=1, keepdims=True)
        cuts = _cuts(azimuths, n)
        azimuth = 0.5 * (cuts[:, 1:] + cuts[:, :-1])
        level[COSINE, n, :, :n], level[SINE, n, :, :n] = np.cos(azimuth), np.sin(azimuth)
        cuts = _cuts(elevations, n)
        elevation = 0.5 * (cuts[:, 1:] + cuts[:, :-1])
        sines = np.diff(np.sin(cuts))
        upright[COSINE, n, :, :n], upright[SINE, n, :, :n] = np.cos(elevation), np.sin(elevation)
        upright[WEIGHT, n, :, :n] = sines / np.sum(sines, axis=1, keepdims=True)
    half = np.moveaxis(0.5 * extent / counts, -1, 0)
    sizes = np.concatenate([half, _bounds(grid)[None]])
    return CellParts(counts, radial, level, upright, sizes, grid.centers_m)


def _cuts(edges: FloatArray, parts: int) -> FloatArray:
    """[n, parts + 1] where each of n intervals is cut into equal parts."""
    return edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, parts + 1)


def _bounds(grid: AvoidanceGrid) -> FloatArray:
    """[layers, rows] radius of a ball around each cell's centre that holds the widest column's."""
    ranges, azimuths, elevations = grid.edges
    middle = 0.5 * (elevations[1:] + elevations[:-1])
    wide = 0.5 * float(np.max(np.diff(azimuths)))
    off = [
        np.cos(middle) * np.cos(end) * np.cos(wide) + np.sin(middle) * np.sin(end)
        for end in (elevations[1:], elevations[:-1])
    ]
    # Corners are furthest off the centre's direction, unless the cell reaches behind it.
    cosine = np.minimum(*off) if wide < 0.5 * np.pi else np.full(grid.rows, -1.0)
    centre_m = 0.5 * (ranges[1:] + ranges[:-1])[:, None]
    square = [
        centre_m**2 + r[:, None] ** 2 - 2.0 * centre_m * r[:, None] * cosine
        for r in (ranges[1:], ranges[:-1])
    ]
    bounds: FloatArray = np.sqrt(np.maximum(*square))
    return bounds


@compiled
def cell_distance(x: float, y: float, z: float, i: int, j: int, k: int, borders: Borders) -> float:
    """Distance of a point from a cell, 0 inside; exact.

    At most the radius where the ball (5.11) in planar coordinates (5.12) meets the cell (5.13).

    The direction of the cell that is nearest to the point's own does not depend on the radius:
    the foot is at the radius, within the layer, of the point's projection on it.
    """
    table = borders.table
    cos_right, sin_right = table[AZIMUTH_COS, j], table[AZIMUTH_SIN, j]
    cos_left, sin_left = table[AZIMUTH_COS, j + 1], table[AZIMUTH_SIN, j + 1]
    left_of_right = y * cos_right - x * sin_right >= 0.0
    right_of_left = y * cos_left - x * sin_left <= 0.0
    narrow = sin_left * cos_right - cos_left * sin_right >= 0.0
    if (left_of_right and right_of_left) if narrow else (left_of_right or right_of_left):
        level = np.sqrt(x * x + y * y)
    else:
        level = max(x * cos_right + y * sin_right, x * cos_left + y * sin_left)
    cos_low, sin_low = table[ELEVATION_COS, k], table[ELEVATION_SIN, k]
    cos_high, sin_high = table[ELEVATION_COS, k + 1], table[ELEVATION_SIN, k + 1]
    if z * cos_low >= level * sin_low and z * cos_high <= level * sin_high and level >= 0.0:
        along = np.sqrt(level * level + z * z)
    else:
        along = max(level * cos_low + z * sin_low, level * cos_high + z * sin_high)
    foot = min(max(along, table[RANGE, i]), table[RANGE, i + 1])
    square = x * x + y * y + z * z + foot * foot - 2.0 * foot * along
    return math.sqrt(max(0.0, square))


@compiled
def compute_filled_share(
    x: float,
    y: float,
    z: float,
    radius: float,
    direction: tuple[float, float, float],
    place: tuple[int, int, int],
    parts: CellParts,
) -> tuple[float, float]:
    """Share of a cell inside a ball (6.9), and its derivative as the ball moves in a direction."""
    i, j, k = place
    ux, uy, uz = direction
    count_r, count_a, count_e = parts.counts[i, k]
    half_r, half_a = parts.sizes[HALF_RANGE, i, k], parts.sizes[HALF_AZIMUTH, i, k]
    half_e = parts.sizes[HALF_ELEVATION, i, k]
    half2 = half_r * half_r + half_a * half_a + half_e * half_e
    half = np.sqrt(half2)
    # Over a part the mean distance is more than that of its centre, by its width across.
    reach = radius - half2 / (9.0 * max(radius, half))
    square = x * x + y * y + z * z
    ahead = x * ux + y * uy + z * uz
    total = rate = 0.0
    for e in range(count_e):
        cos_e, sin_e = parts.upright[COSINE, count_e, k, e], parts.upright[SINE, count_e, k, e]
        row = row_rate = 0.0
        for a in range(count_a):
            cos_a, sin_a = parts.level[COSINE, count_a, j, a], parts.level[SINE, count_a, j, a]
            level = x * cos_a + y * sin_a
            along = level * cos_e + z * sin_e
            across_a = half_a * abs(y * cos_a - x * sin_a)
            across_e = half_e * abs(z * cos_e - level * sin_e)
            forward = cos_e * (cos_a * ux + sin_a * uy) + sin_e * uz
            for b in range(count_r):
                r = parts.radial[RADIUS, count_r, i, b]
                distance = np.sqrt(max(TINY, square + r * (r - 2.0 * along)))
                depth = reach - distance
                if depth <= -half:
                    continue
                weight = parts.radial[RADIAL_WEIGHT, count_r, i, b]
                if depth >= half:
                    row += weight
                    continue
                inside, slope = _cut_box(
                    depth,
                    half_r * abs(along - r) / distance,
                    across_a / distance,
                    across_e / distance,
                )
                row += weight * inside
                row_rate += weight * slope * (r * forward - ahead) / distance
        weight = parts.upright[WEIGHT, count_e, k, e] / count_a
        total += weight * row
        rate += weight * row_rate
    return total, rate


@compiled
def _cut_box(depth: float, a: float, b: float, c: float) -> tuple[float, float]:
    """Share of a box on one side of a plane, and its derivative by the depth of its centre.

    a, b, c: half-widths of the box across the plane. Exact if one of them is 0, else the smallest
    two are taken for one of the same spread.
    """
    wide = max(a, b, c)
    slim = np.sqrt(max(LEAST_SLIM * wide * wide, a * a + b * b + c * c - wide * wide))
    if slim > wide:
        wide, slim = slim, wide
    beyond = wide + slim - abs(depth)
    if beyond <= 0.0:
        return (1.0 if depth > 0.0 else 0.0), 0.0
    if beyond >= 2.0 * slim:
        return 0.5 + 0.5 * depth / wide, 0.5 / wide
    rest = beyond * beyond / (8.0 * wide * slim)
    return (1.0 - rest if depth > 0.0 else rest), 0.25 * beyond / (wide * slim)
