"""Returns of one scan grouped into bodies: what neighbouring beams connect belongs together.

Two returns are neighbours if they lie within a gap of one another, or within twice the distance
that the beams are apart out there; what neighbours connect is one cluster.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.sensors.voxels import merge_balls, number_voxels

SPACINGS_TO_NEIGHBOUR = 2.0
"""Beam spacings within which returns are neighbours: surfaces may be seen at 60 degrees."""
VOXELS_PER_GAP = 2.0


class Clusters(NamedTuple):
    """Bodies as one scan shows them, world frame."""

    mean_m: Floats2
    """[c, 3] mean of the returns: on the near side of the body."""
    away: Floats2
    """[c, 3] unit vectors from the sensor through the mean."""
    half_width_m: Floats
    """[c] farthest return from the mean, across the line of sight."""
    half_thickness_m: Floats
    """[c] half the width across the line of sight where it is smallest, of an equal disc."""
    depth_m: Floats
    """[c] extent along the line of sight."""
    half_spacing_m: Floats
    """[c] half the beam spacing there, on average."""
    start: Ints
    """[c + 1] where the returns of a cluster begin in `points_m`."""
    points_m: Floats2
    """[n, 3] returns, cluster after cluster."""

    def points_of(self, cluster: int) -> FloatArray:
        """[k, 3] returns of one cluster."""
        return self.points_m[self.start[cluster] : self.start[cluster + 1]]


def cluster_returns(
    points_m: FloatArray, half_spacing_m: FloatArray, origin_m: FloatArray, gap_m: float
) -> Clusters:
    """Connected groups of returns [n, 3], each with half the beam spacing [n] around it.

    origin_m: [3] where the sensor is, in the frame of the points.
    """
    return _clusters(points_m, half_spacing_m, origin_m, float(gap_m))


@compiled
def _clusters(points: Floats2, half_spacing: Floats, origin: Floats, gap: float) -> Clusters:
    voxel_of, voxels = number_voxels(points, gap / VOXELS_PER_GAP)
    means, _ = merge_balls(points, half_spacing, voxel_of, voxels)
    reach = np.zeros(voxels)
    for n in range(len(points)):
        reach[voxel_of[n]] = max(reach[voxel_of[n]], half_spacing[n])
    group = _connect(means, reach, gap)
    numbers = np.full(voxels, -1, dtype=np.int64)
    count = 0
    for v in range(voxels):
        if numbers[group[v]] < 0:
            numbers[group[v]] = count
            count += 1
    start = np.zeros(count + 1, dtype=np.int64)
    for n in range(len(points)):
        start[numbers[group[voxel_of[n]]] + 1] += 1
    for c in range(count):
        start[c + 1] += start[c]
    filled = start[:-1].copy()
    ordered, spacing = np.empty((len(points), 3)), np.zeros(count)
    for n in range(len(points)):
        c = numbers[group[voxel_of[n]]]
        ordered[filled[c]] = points[n]
        filled[c] += 1
        spacing[c] += half_spacing[n]
    mean, away = np.empty((count, 3)), np.empty((count, 3))
    width, thickness, depth = np.empty(count), np.empty(count), np.empty(count)
    for c in range(count):
        members = ordered[start[c] : start[c + 1]]
        width[c], thickness[c], depth[c] = _measure(members, origin, mean[c], away[c])
        spacing[c] /= len(members)
    return Clusters(mean, away, width, thickness, depth, spacing, start, ordered)


@compiled
def _connect(places: Floats2, reach: Floats, gap: float) -> Ints:
    """[n] a member that stands for the connected group of each place.

    By a sweep along the axis on which the places lie farthest apart.
    """
    sweep, longest = 0, -1.0
    for axis in range(3 if len(places) else 0):
        extent = np.max(places[:, axis]) - np.min(places[:, axis])
        if extent > longest:
            sweep, longest = axis, extent
    u, v, w = places[:, sweep], places[:, (sweep + 1) % 3], places[:, (sweep + 2) % 3]
    order = np.argsort(u)
    parent = np.arange(len(places))
    largest = 0.0
    for n in range(len(places)):
        largest = max(largest, reach[n])
    for i in range(len(order)):
        a = order[i]
        far = max(gap, SPACINGS_TO_NEIGHBOUR * (reach[a] + largest))
        for j in range(i + 1, len(order)):
            b = order[j]
            along = u[b] - u[a]
            if along > far:
                break
            near = max(gap, SPACINGS_TO_NEIGHBOUR * (reach[a] + reach[b]))
            if along**2 + (v[b] - v[a]) ** 2 + (w[b] - w[a]) ** 2 <= near * near:
                parent[_root(parent, b)] = _root(parent, a)
    for n in range(len(places)):
        parent[n] = _root(parent, n)
    return parent


@compiled
def _root(parent: Ints, n: int) -> int:
    while parent[n] != n:
        parent[n] = parent[parent[n]]
        n = parent[n]
    return n


@compiled
def _measure(
    points: Floats2, origin: Floats, mean: Floats, away: Floats
) -> tuple[float, float, float]:
    """Half width, half thickness and depth of a cluster; fills in its mean and line of sight."""
    for axis in range(3):
        mean[axis] = np.mean(points[:, axis])
    away[:] = mean - origin
    distance = np.sqrt(np.sum(away * away))
    if distance > 0.0:
        away /= distance
    level = np.hypot(away[0], away[1])
    ax, ay = (-away[1] / level, away[0] / level) if level > 1e-9 else (0.0, 1.0)
    bx, by, bz = -away[2] * ay, away[2] * ax, away[0] * ay - away[1] * ax
    widest, near, far = 0.0, np.inf, -np.inf
    aa, ab, bb = 0.0, 0.0, 0.0
    for n in range(len(points)):
        x, y, z = points[n, 0] - mean[0], points[n, 1] - mean[1], points[n, 2] - mean[2]
        a, b = ax * x + ay * y, bx * x + by * y + bz * z
        c = away[0] * x + away[1] * y + away[2] * z
        near, far = min(near, c), max(far, c)
        widest = max(widest, a * a + b * b)
        aa += a * a
        ab += a * b
        bb += b * b
    half = 0.5 * (aa + bb)
    smallest = half - np.sqrt(max(0.0, 0.25 * (aa - bb) ** 2 + ab * ab))
    # A disc of radius r has a variance of r^2 / 4 along each axis.
    thickness = 2.0 * np.sqrt(max(0.0, smallest) / len(points))
    return np.sqrt(widest), thickness, far - near
