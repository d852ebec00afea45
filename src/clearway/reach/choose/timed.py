"""Layers by time: all chains of a few movements, thinned out so that what is left lies far apart.

Of a vehicle with inertia every movement takes equally long, and where it may go next depends on its
speed. A reach set is therefore a tree of a few layers, begun in one class of motion. Every node of
it may be where a plan ends; the last layer is where most do.
"""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray
from clearway.reach.choose.select import Select
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import Lattice

LAYERS = 4
"""Movements of the longest chains."""
KEPT = (600, 900, 1100)
"""Nodes kept of the second layer and those after it."""
FINEST_M = 0.15
"""Nodes of one layer nearer to each other than this are one."""
GROWS = 1.15
"""Growth of that distance until few enough are left."""
COARSER_HEIGHT = 0.5
"""Least distance in height, m."""
HEADINGS_RAD = (0.12, 0.6)
"""Least and greatest difference of headings that tells nodes apart."""
CHANCE = 0.3
"""Weight of chance beside a chain's effort, where one of several alike is kept."""
CHANGED = 0.5
"""Effort of a movement unlike the one before: of chains alike the plainest is kept."""


def select_timed() -> Select:
    """Chains of up to `LAYERS` movements, dispersed."""

    def select(
        lattice: Lattice, _grid: AvoidanceGrid, start_pitch_rad: float, _deep: int
    ) -> ByteArray:
        return _grow(lattice, lattice.start[start_pitch_rad], LAYERS)

    return select


def _grow(lattice: Lattice, root: int, layers: int) -> ByteArray:
    """Buffers [nodes, layers] of the nodes of all layers."""
    rng = np.random.default_rng(0)
    pieces, climbs = lattice.pieces, _climb_of(lattice)
    effort = _effort_of(lattice)
    pose, at = np.zeros((1, 4)), np.array([root])
    spent, buffers = np.zeros(1), np.zeros((1, layers), dtype=np.uint8)
    found = []
    for layer in range(layers):
        allowed = pieces.following[at] >= 0
        idle = ~np.any(pieces.path[at, :, -1], axis=2) & (pieces.turn_rad[at] == 0.0)
        if layer:  # Climbs begin with the first movement; what stands leads nowhere new.
            ends = climbs[np.maximum(pieces.following[at], 0)]
            allowed &= ~idle & ((ends == climbs[at][:, None]) | (ends == 0.0))
        node, movement = np.nonzero(allowed)
        before = at[node]
        end, turn_rad = pieces.path[before, movement, -1], pieces.turn_rad[before, movement]
        pose = _placed(pose[node], end, turn_rad)
        spent = spent[node] + effort[at[node], movement]
        buffers = buffers[node]
        if layer:
            spent += CHANGED * (buffers[:, layer - 1] != movement + 1)
        buffers[:, layer] = movement + 1
        at = pieces.following[at[node], movement].astype(np.int64)
        if layer:
            most = KEPT[min(layer, len(KEPT)) - 1]
            kept = _disperse(pose, at, spent + CHANCE * rng.random(len(at)), most)
            pose, spent, buffers, at = pose[kept], spent[kept], buffers[kept], at[kept]
        found.append(buffers)
    return np.concatenate(found)


def _placed(pose: FloatArray, end: FloatArray, turn_rad: FloatArray) -> FloatArray:
    """[n, 4] poses after displacements [n, 3] and turns [n] from poses [n, 4]."""
    cosine, sine = np.cos(pose[:, 3]), np.sin(pose[:, 3])
    x = pose[:, 0] + cosine * end[:, 0] - sine * end[:, 1]
    y = pose[:, 1] + sine * end[:, 0] + cosine * end[:, 1]
    return np.stack([x, y, pose[:, 2] + end[:, 2], pose[:, 3] + turn_rad], axis=1)


def _disperse(pose: FloatArray, at: IntArray, rank: FloatArray, most: int) -> IntArray:
    """Which of some nodes to keep: in cells just so large that few enough are left, the one of the
    lowest rank of each."""
    order = np.argsort(rank, kind="stable")
    fine_m = FINEST_M
    turned = (pose[:, 3] + np.pi) % (2.0 * np.pi) - np.pi
    while True:
        heading = min(max(HEADINGS_RAD[0], 0.25 * fine_m), HEADINGS_RAD[1])
        key = np.stack(
            [
                np.rint(pose[:, 0] / fine_m),
                np.rint(pose[:, 1] / fine_m),
                np.rint(pose[:, 2] / max(fine_m, COARSER_HEIGHT)),
                np.rint(at // 3 / max(1.0, fine_m)),
                at % 3,
                np.rint(turned / heading),
            ]
        ).astype(np.int64)
        low = key.min(axis=1, keepdims=True)
        sizes = (key.max(axis=1) - low[:, 0] + 1).tolist()
        flat = np.ravel_multi_index(tuple(key - low), sizes)
        _, first = np.unique(flat[order], return_index=True)
        if len(first) <= most:
            return np.sort(order[first])
        fine_m *= GROWS


def _climb_of(lattice: Lattice) -> FloatArray:
    """[attitudes] rate of climb of each class."""
    classes = lattice.automaton.classes
    assert classes is not None  # Only vehicles with inertia come here.
    return classes.climb_mps[classes.classes_at(lattice.pieces.attitude_rad[:, 0])]


def _effort_of(lattice: Lattice) -> FloatArray:
    """[attitudes, movements] how much a movement changes: chains that change little are kept."""
    climbs, pieces = _climb_of(lattice), lattice.pieces
    ends = climbs[np.maximum(pieces.following, 0)]
    widest = np.abs(pieces.turn_rad).max(axis=1, keepdims=True)
    turns = np.abs(pieces.turn_rad) / np.where(widest > 0.0, widest, 1.0)
    effort: FloatArray = (ends != climbs[:, None]) + 0.7 * (ends != 0.0) + 0.5 * turns
    return effort
