"""Other ways to the same results, in plain NumPy and by the shortest loop that numba compiles: what
the compiled loops are held against."""

from __future__ import annotations

import numba
import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray
from clearway.obstacles.obstacle import Shapes
from clearway.reach import ReachSet


def bincount_detection(
    grid: AvoidanceGrid, beams: IntArray, points_m: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Hits [cells] and visibility [cells] by arctan2, searchsorted and bincount."""
    x, y, z = points_m.T
    level = np.hypot(x, y)
    place = (np.hypot(level, z), np.arctan2(y, x), np.arctan2(z, level))
    index = [
        np.searchsorted(edges, values) - 1 for edges, values in zip(grid.edges, place, strict=True)
    ]
    inside = np.ones(len(points_m), dtype=np.bool_)
    for cells, numbers in zip(grid.shape, index, strict=True):
        inside &= (numbers >= 0) & (numbers < cells)
    flat = np.ravel_multi_index([numbers[inside] for numbers in index], grid.shape)
    hits = np.bincount(flat, minlength=grid.cells)
    hindrance = hits.reshape(grid.layers, -1) / np.maximum(beams, 1)
    visibility = np.clip(1.0 - (np.cumsum(hindrance, axis=0) - hindrance), 0.0, 1.0)
    return hits, visibility.ravel()


def minimal_hits(grid: AvoidanceGrid, points_m: FloatArray) -> IntArray:
    """Hits [cells] by a loop of even edges and nothing else: no limits, no tolerance, no shares."""
    low = np.array([edges[0] for edges in grid.edges])
    high = np.array([edges[-1] for edges in grid.edges])
    return _minimal_hits(points_m, low, high, np.array(grid.shape))


@numba.njit(error_model="numpy")
def _minimal_hits(
    points_m: FloatArray, low: FloatArray, high: FloatArray, shape: IntArray
) -> IntArray:
    hits = np.zeros(shape[0] * shape[1] * shape[2], dtype=np.int64)
    per = shape / (high - low)
    for n in range(len(points_m)):
        x, y, z = points_m[n, 0], points_m[n, 1], points_m[n, 2]
        away = np.sqrt(x * x + y * y + z * z)
        i = int(np.floor((away - low[0]) * per[0]))
        j = int(np.floor((np.arctan2(y, x) - low[1]) * per[1]))
        k = int(np.floor((np.arcsin(z / away) - low[2]) * per[2]))
        if 0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2]:
            hits[(i * shape[1] + j) * shape[2] + k] += 1
    return hits


def plain_python(steps: int) -> float:
    """Arithmetic, calls and a dictionary in plain Python: what a decision's glue is made of."""
    counts: dict[int, float] = {}
    for step in range(steps):
        counts[step % 7] = max(counts.get(step % 7, 0.0), float(step) * 0.5)
    return sum(counts.values())


def unique_voxels(points_m: FloatArray, voxel_m: float) -> IntArray:
    """Index [k] of one point in each voxel."""
    keys = np.floor(points_m / voxel_m).astype(np.int64)
    return np.unique(keys, axis=0, return_index=True)[1]


def brute_force_distance(shapes: Shapes, position_m: FloatArray) -> FloatArray:
    """Signed distance [n] of a world point to every rounded box."""
    local = np.einsum("nji,nj->ni", shapes.rotation, position_m - shapes.center_m)
    beyond = np.abs(local) - shapes.half_m
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    distance: FloatArray = outside + np.minimum(beyond.max(axis=1), 0.0) - shapes.radius_m
    return distance


def node_ratings(tree: ReachSet, cell_rating: FloatArray) -> FloatArray:
    """Running product [nodes] of ratings along the path to each node, one depth at a time."""
    owner = np.repeat(np.arange(tree.nodes), np.diff(tree.cell_start))
    rating = np.ones(tree.nodes)
    np.multiply.at(rating, owner, cell_rating[tree.cell_index])
    for depth in range(2, int(tree.depth.max()) + 1):
        nodes = np.flatnonzero(tree.depth == depth)
        rating[nodes] *= rating[tree.parent[nodes]]
    return rating


def tree_clearance(tree: ReachSet, points: PointHazards, cap_m: float) -> FloatArray:
    """Smallest clearance [nodes] along the path to each node: every chord to every point."""
    clearance = np.full(tree.nodes, cap_m)
    for n in range(tree.nodes):
        parent = int(tree.parent[n])
        start = np.zeros(3) if parent < 0 else tree.samples_m[parent, -1]
        corners = np.concatenate([start[None], tree.samples_m[n]])
        along = np.diff(corners, axis=0)
        offset = points.position_m[None] - corners[:-1, None]
        length2 = np.maximum(np.sum(along**2, axis=1), 1e-300)
        share = np.clip(np.einsum("smi,si->sm", offset, along) / length2[:, None], 0.0, 1.0)
        gap = offset - share[:, :, None] * along[:, None]
        distance = np.sqrt(np.einsum("smi,smi->sm", gap, gap)) - points.radius_m
        before = cap_m if parent < 0 else clearance[parent]
        clearance[n] = min(before, float(distance.min()) - float(tree.sagitta_m[n]))
    return clearance
