"""Keep rules of 4.5: which nodes of a cell go on. Only they tell the approximations apart.

Scores are evaluated on the whole trajectory and maximised; smoothness counts as (s + 1)/(n + 1),
since buffers without a smooth movement are the normal case. Ties go by the score at nine decimals,
then by the movement buffer. Mirror images are taken together or not at all, so that trees are
symmetric left to right.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clearway.base.arrays import Bools, Ints
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.reach.expand.buffers import keys_of, mirror_buffers
from clearway.reach.expand.wavefront import Front, KeepRule

Score = Callable[[Front], FloatArray]
"""Front -> [n] what a keep rule maximises."""


def everything(front: Front) -> BoolArray:
    """The full reach set: every node goes on."""
    return np.ones(len(front.cell), dtype=np.bool_)


def best_of_cell(score: Score, count: int) -> KeepRule:
    """Expand the `count` best nodes of every cell."""

    def keep(front: Front) -> BoolArray:
        order, together = in_mirrored_order(front, score(front))
        chosen = np.zeros(len(order), dtype=np.bool_)
        chosen[order] = _take(front.cell[order], together, count - front.expanded)
        return chosen

    return keep


def in_mirrored_order(front: Front, score: FloatArray) -> tuple[IntArray, BoolArray]:
    """Nodes by cell, falling score, then buffer; and which one is its follower's mirror image.

    A buffer and its image count as the lesser of the two, so that both sides rank alike and
    images on the plane of symmetry come one after the other.
    """
    own = keys_of(front.buffers)
    first = own
    if front.mirror is not None:
        image = keys_of(mirror_buffers(front.buffers, front.mirror))
        first = np.where(image < own, image, own)
    order = np.lexsort((own, first, -np.round(score, 9), front.cell))
    first, cell = first[order], front.cell[order]
    same = (first[1:] == first[:-1]) & (cell[1:] == cell[:-1])
    return order, np.append(same, False)


def chaotic(front: Front) -> FloatArray:
    """(4.30): far from the cell's centre, where a movement may reach a new cell; not smooth."""
    return _from_center(front) / front.grid.layer_m / _smoothness(front)


def harmonic(front: Front) -> FloatArray:
    """(4.31): close to the cell's centre, and smooth."""
    return _smoothness(front) / np.maximum(_from_center(front) / front.grid.layer_m, 1e-9)


def _smoothness(front: Front) -> FloatArray:
    return (front.smooth + 1.0) / (front.depth + 1.0)


def _from_center(front: Front) -> FloatArray:
    """[n] distance of the node's end from the centre of its cell."""
    offset = front.position_m - _centers(front.grid)[front.cell]
    distance: FloatArray = np.linalg.norm(offset, axis=1)
    return distance


def _centers(grid: AvoidanceGrid) -> FloatArray:
    """[cells + 1, 3] centres, the last for the space short of the first layer.

    Rounding must not tell left from right: where columns are symmetric, so are the centres.
    """
    centers = grid.centers_m.reshape(*grid.shape, 3).copy()
    edges = grid.azimuth_edges_rad
    if np.allclose(edges, -edges[::-1], rtol=0.0, atol=1e-12):
        half = grid.columns // 2
        centers[:, :half] = centers[:, ::-1][:, :half] * [1.0, -1.0, 1.0]
        if grid.columns % 2:
            centers[:, half, :, 1] = 0.0
    short = [[0.5 * grid.range_edges_m[0], 0.0, 0.0]]
    return np.concatenate([centers.reshape(-1, 3), short])


@compiled
def _take(cell: Ints, together: Bools, budget: Ints) -> Bools:
    """From nodes sorted by cell and rank, what fits each cell's budget; images only as pairs."""
    nodes = len(cell)
    taken = np.zeros(nodes, dtype=np.bool_)
    left = budget.copy()
    n = 0
    while n < nodes:
        size = 2 if together[n] else 1
        if left[cell[n]] >= size:
            taken[n : n + size] = True
            left[cell[n]] -= size
        n += size
    return taken
