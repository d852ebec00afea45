"""Keep rule of dispersion: in every cell the nodes that lie farthest from each other.

Two nodes are as far apart as their positions and the points that they look ahead to: a distance
in metres that counts a turn by the length of the look-ahead.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.reach.choose.keep import in_mirrored_order
from clearway.reach.expand.wavefront import Front, KeepRule

SAME_STATE = 1e-6
"""Nodes nearer than that, in thicknesses of a layer, are one and the same state."""


def farthest_of_cell(count: int, look_ahead_m: float) -> KeepRule:
    """Expand up to `count` nodes of every cell, each the farthest from those chosen before it.

    The first is the one that heads most directly away from the start. No state is chosen twice,
    and a state on the plane of symmetry is not reached by a pair of mirror images.
    """

    def keep(front: Front) -> BoolArray:
        order, together = in_mirrored_order(front, _alignment(front))
        features = _features(front, look_ahead_m)[order]
        chosen = np.zeros(len(order), dtype=np.bool_)
        chosen[order] = _farthest(
            front.cell[order], together, np.ascontiguousarray(features), count - front.expanded
        )
        return chosen

    return keep


def _features(front: Front, look_ahead_m: float) -> FloatArray:
    """[n, 6] position and look-ahead vector, in thicknesses of a layer."""
    features = np.concatenate([front.position_m, look_ahead_m * front.heading], axis=1)
    scaled: FloatArray = features / front.grid.layer_m
    return scaled


def _alignment(front: Front) -> FloatArray:
    """[n] cosine between the heading and the line of sight from the start."""
    distance = np.maximum(np.linalg.norm(front.position_m, axis=1), 1e-9 * front.grid.layer_m)
    alignment: FloatArray = np.sum(front.heading * front.position_m, axis=1) / distance
    return alignment


@compiled
def _farthest(cell: Ints, together: Bools, features: Floats2, budget: Ints) -> Bools:
    """From nodes sorted by cell and rank: in each cell the first, then the farthest, again.

    Mirror images in one cell are one choice of two nodes.
    """
    taken = np.zeros(len(cell), dtype=np.bool_)
    start = 0
    while start < len(cell):
        end = start
        while end < len(cell) and cell[end] == cell[start]:
            end += 1
        left = budget[cell[start]]
        apart = np.full(end - start, np.inf)
        while left > 0:
            best, size = _next_choice(start, end, left, taken, apart, together, features)
            if best < 0:
                break
            for chosen in range(best, best + size):
                taken[chosen] = True
                for other in range(start, end):
                    gap = _distance(features[chosen], features[other])
                    apart[other - start] = min(apart[other - start], gap)
            left -= size
        start = end
    return taken


@compiled
def _next_choice(
    start: int,
    end: int,
    left: int,
    taken: Bools,
    apart: Floats,
    together: Bools,
    features: Floats2,
) -> tuple[int, int]:
    """Of a cell's nodes from start to end the one farthest from those taken, and its size.

    apart: [end - start] distance to the nearest one taken. Size 2 is a pair of mirror images; the
    node is -1 where nothing fits into the `left` or nothing is apart.
    """
    best, size = -1, 0
    n = start
    while n < end:
        paired = together[n]
        far = apart[n - start]
        if paired:
            far = min(far, apart[n + 1 - start])
        if paired and _distance(features[n], features[n + 1]) < SAME_STATE:
            far = 0.0
        if (
            not taken[n]
            and far > SAME_STATE
            and (2 if paired else 1) <= left
            and (best < 0 or far > apart[best - start] + SAME_STATE)
        ):
            best, size = n, 2 if paired else 1
        n += 2 if paired else 1
    return best, size


@compiled
def _distance(first: Floats, second: Floats) -> float:
    total = 0.0
    for axis in range(len(first)):
        total += (first[axis] - second[axis]) ** 2
    return float(np.sqrt(total))
