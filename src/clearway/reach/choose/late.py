"""Late branching: many footprints from few nodes, by weaving about corners near the end.

Trajectories that share all but their last movements cost little each. Where four cells meet, a
movement or two decide which cells come last; so the pool keeps nodes that stay near such corners,
and branches in full behind them. Which branches pay is a knapsack on a tree: at a cost per node,
the best subtree follows from its own best subtrees.
"""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray, spherical_from_cartesian
from clearway.base.state import BoolArray, IntArray
from clearway.reach.choose.coverage import footprint_labels, leading_to
from clearway.reach.choose.keep import best_of_cell, everything
from clearway.reach.expand.buffers import ByteArray, images_within, keys_of
from clearway.reach.expand.wavefront import Front, KeepRule
from clearway.reach.tree import ReachSet

PRICE_STEPS = 14


def near_corners(width: int, entry: int, layers: int, look_ahead_m: float) -> KeepRule:
    """The `width` nodes of every cell nearest to a corner; from `entry` of them, everything.

    Full branching starts `layers` layers before the last one.
    """
    wide = best_of_cell(lambda front: _near_corner(front, look_ahead_m), width)
    narrow = best_of_cell(lambda front: _near_corner(front, look_ahead_m), entry)

    def keep(front: Front) -> BoolArray:
        layer = int(front.cell[0]) // (front.grid.columns * front.grid.rows)
        left = front.grid.layers - 1 - layer
        if left < layers:
            return everything(front)
        return narrow(front) if left == layers else wide(front)

    return keep


def _near_corner(front: Front, look_ahead_m: float) -> FloatArray:
    """[n] minus the distance from the nearest inner corner, now and a look-ahead further on."""
    azimuths, elevations = front.grid.azimuth_edges_rad, front.grid.elevation_edges_rad
    total = np.zeros(len(front.cell))
    for ahead in (0.0, look_ahead_m):
        place = spherical_from_cartesian(front.position_m + ahead * front.heading)
        distance, azimuth, elevation = place.T
        across = distance * np.cos(elevation) * _from_inner_edge(azimuth, azimuths)
        total -= np.hypot(across, distance * _from_inner_edge(elevation, elevations))
    scaled: FloatArray = total / front.grid.layer_m
    return scaled


def _from_inner_edge(angle: FloatArray, edges: FloatArray) -> FloatArray:
    """[n] angle to the nearest edge between two cells; to the axis where there is none."""
    inner = edges[1:-1] if len(edges) > 2 else np.zeros(1)
    gaps: FloatArray = np.abs(angle[:, None] - inner).min(axis=1)
    return gaps


def most_footprints(
    pool: ReachSet,
    buffers: ByteArray,
    held: ByteArray,
    mirror: tuple[int, ...] | None,
    most_nodes: int,
) -> ByteArray:
    """Buffers [kept, deep] of `held` and those that make the most footprints of `most_nodes`.

    pool: reach set of all of `buffers`, sorted. The cost per node is found by halving.
    """
    leaves = pool.trajectories
    own = keys_of(buffers)
    image = images_within(buffers, mirror)
    labels = footprint_labels(pool, leaves)
    kept = np.flatnonzero(np.isin(own, keys_of(held)))
    held_nodes = leading_to(pool, leaves[kept])
    best, low, high = kept, 0.0, 1.0
    for _ in range(PRICE_STEPS):
        price = 0.5 * (low + high)
        worth = _worthwhile(pool, held_nodes, price)
        chosen = np.flatnonzero(worth[leaves])
        _, first = np.unique(labels[chosen], return_index=True)
        chosen = np.unique(np.concatenate([chosen[first], image[chosen[first]], kept]))
        if np.count_nonzero(leading_to(pool, leaves[chosen])) > most_nodes:
            low = price
            continue
        high = price
        if len(np.unique(labels[chosen])) > len(np.unique(labels[best])):
            best = chosen
    return buffers[best]


def _worthwhile(pool: ReachSet, held: BoolArray, price: float) -> BoolArray:
    """[nodes] of the best subtree, at a cost per node that is not held and 1 per trajectory.

    Of siblings that end in one cell only the best goes on: their footprints would be the same.
    """
    deepest = int(pool.depth.max())
    gain = np.where(pool.complete, 1.0, 0.0) - np.where(held, 0.0, price)
    goes_on = np.zeros(pool.nodes, dtype=np.bool_)
    levels = [np.flatnonzero(pool.depth == depth) for depth in range(1, deepest + 1)]
    for nodes in levels[::-1]:
        paying = nodes[(gain[nodes] > 0.0) | held[nodes]]
        best = paying[_best_of_group(pool, paying, gain) | held[paying]]
        goes_on[best] = True
        below_root = best[pool.parent[best] >= 0]
        np.add.at(gain, pool.parent[below_root], np.maximum(gain[below_root], 0.0))
    for nodes in levels[1:]:
        goes_on[nodes] &= goes_on[pool.parent[nodes]]
    return goes_on


def _best_of_group(pool: ReachSet, nodes: IntArray, gain: FloatArray) -> BoolArray:
    """[nodes] the one with the most gain among those of one parent and one cell."""
    parent, cell = pool.parent[nodes], pool.end_cell[nodes]
    order = np.lexsort((nodes, -gain[nodes], cell, parent))
    same = (parent[order][1:] == parent[order][:-1]) & (cell[order][1:] == cell[order][:-1])
    best = np.ones(len(nodes), dtype=np.bool_)
    best[order[1:]] = ~same
    return best
