"""Coating (def. 5 and 6): cells that balls around hit points reach into; fewer balls for many.

A cell may be 0.2 m wide where 0.6 m must be kept, so hits alone cannot protect: each hit point is
inflated by the safety margin and by half the beam spacing, and marks every cell that it meets.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.compiled import compiled, read_only
from clearway.frames import FloatArray
from clearway.grid import BORDER_TOLERANCE, AvoidanceGrid, GridEdges
from clearway.state import BoolArray, IntArray


def coated_cells(grid: AvoidanceGrid, points_m: FloatArray, radius_m: npt.ArrayLike) -> BoolArray:
    """[cells] cells that meet the ball of any point [m, 3] of the grid frame, (3.8), (3.9).

    radius_m: [m] or one for all: margin plus half the beam spacing there. Exact: the distance
    from a point to a polar cell has a closed form.
    """
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
    voxel_of, voxels = number_voxels(points, voxel_m)
    return _merge(points, radii, voxel_of, voxels)


def _radii(radius_m: npt.ArrayLike, count: int) -> FloatArray:
    return read_only(np.broadcast_to(np.asarray(radius_m, dtype=np.float64), (count,)))


@compiled
def _coated(points: FloatArray, radii: FloatArray, edges: GridEdges) -> BoolArray:
    azimuth, elevation, ranges = edges.azimuth_rad, edges.elevation_rad, edges.range_m
    columns, rows, layers = len(azimuth) - 1, len(elevation) - 1, len(ranges) - 1
    cos_azimuth, sin_azimuth = np.cos(azimuth), np.sin(azimuth)
    cos_elevation, sin_elevation = np.cos(elevation), np.sin(elevation)
    nearest, farthest = ranges[0], ranges[layers]
    coated = np.zeros(layers * columns * rows, dtype=np.bool_)
    for n in range(len(points)):
        x, y, z, radius = points[n, 0], points[n, 1], points[n, 2], radii[n] + BORDER_TOLERANCE
        horizontal = np.sqrt(x * x + y * y)
        squared = x * x + y * y + z * z
        distance = np.sqrt(squared)
        if distance - radius > farthest or distance + radius < nearest:
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


@compiled
def voxel_key(x: float, y: float, z: float, per_voxel: float) -> int:
    """One integer for the voxel of a point; repeats only after two million voxels an axis."""
    i = int(np.floor(x * per_voxel)) & 0x1FFFFF
    j = int(np.floor(y * per_voxel)) & 0x1FFFFF
    k = int(np.floor(z * per_voxel)) & 0x1FFFFF
    return (i << 42) | (j << 21) | k


@compiled
def slot_of(key: int, keys: IntArray, shift: int) -> int:
    """Where a key is, or goes, in a hash table of a power of two slots; -1 marks empty ones."""
    mask = np.uint64(len(keys) - 1)
    slot = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15) >> np.uint64(shift)
    while keys[slot] != -1 and keys[slot] != key:
        slot = (slot + np.uint64(1)) & mask
    return int(slot)


@compiled
def table_bits(count: int) -> int:
    """Bits of a hash table that stays at most half full with `count` keys."""
    bits = 4
    while (1 << bits) < 2 * count:
        bits += 1
    return bits


@compiled
def number_voxels(points: FloatArray, voxel: float) -> tuple[IntArray, int]:
    """[m] number of the voxel of each point, in order of appearance, and how many there are."""
    bits = table_bits(len(points))
    keys = np.full(1 << bits, -1, dtype=np.int64)
    numbers = np.empty(1 << bits, dtype=np.int64)
    voxel_of = np.empty(len(points), dtype=np.int64)
    per_voxel, shift = 1.0 / voxel, 64 - bits
    count, last_key, number = 0, -1, 0
    for n in range(len(points)):
        key = voxel_key(points[n, 0], points[n, 1], points[n, 2], per_voxel)
        if key != last_key:  # neighbours in a scan mostly share their voxel
            slot = slot_of(key, keys, shift)
            if keys[slot] == -1:
                keys[slot] = key
                numbers[slot] = count
                count += 1
            last_key, number = key, int(numbers[slot])
        voxel_of[n] = number
    return voxel_of, count


@compiled
def _merge(
    points: FloatArray, radii: FloatArray, voxel_of: IntArray, voxels: int
) -> tuple[FloatArray, FloatArray]:
    means, members, covering = np.zeros((voxels, 3)), np.zeros(voxels), np.zeros(voxels)
    for n in range(len(points)):
        v = voxel_of[n]
        members[v] += 1.0
        means[v, 0] += points[n, 0]
        means[v, 1] += points[n, 1]
        means[v, 2] += points[n, 2]
    for v in range(voxels):
        means[v, 0] /= members[v]
        means[v, 1] /= members[v]
        means[v, 2] /= members[v]
    for n in range(len(points)):
        v = voxel_of[n]
        x, y, z = points[n, 0] - means[v, 0], points[n, 1] - means[v, 1], points[n, 2] - means[v, 2]
        # A voxel's only point stays where it was, whatever the rounding of the mean.
        moved = np.sqrt(x * x + y * y + z * z) if members[v] > 1.0 else 0.0
        covering[v] = max(covering[v], moved + radii[n])
    return means, covering
