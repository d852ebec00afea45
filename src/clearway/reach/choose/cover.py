"""Greedy cover: out of a pool, the trajectories that add the most that is new per new node."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Bools, Floats, Int32s, Ints
from clearway.base.compiled import compiled
from clearway.reach.choose.coverage import footprint_labels
from clearway.reach.expand.buffers import ByteArray, images_within, keys_of
from clearway.reach.tree import ReachSet

Int32Array = npt.NDArray[np.int32]
YAW_STEP_RAD = 1e-6


class Items(NamedTuple):
    """What the nodes of a pool reach, in rows (CSR), and what each thing reached is worth."""

    row_start: Int32s
    """[nodes + 1] where a node's items begin in `item`."""
    item: Int32s
    worth: Floats
    """[items]"""


def list_passed_cells(pool: ReachSet) -> Items:
    """Every cell that a node passes, all worth the same."""
    return Items(pool.cell_start, pool.cell_index, np.ones(pool.grid.cells))


def end_cells(pool: ReachSet) -> Items:
    """The cell in which a node ends, as cells count in table 6.1; all worth the same."""
    inside = pool.end_cell >= 0
    start = np.concatenate([[0], np.cumsum(inside)]).astype(np.int32)
    return Items(start, pool.end_cell[inside], np.ones(pool.grid.cells))


def footprints(pool: ReachSet) -> Items:
    """The footprint (def. 22) of each trajectory, at its last node."""
    labels = footprint_labels(pool, pool.trajectories)
    start = np.concatenate([[0], np.cumsum(pool.complete)]).astype(np.int32)
    return Items(start, labels.astype(np.int32), np.ones(int(labels.max(initial=-1)) + 1))


def headings_in_cells(pool: ReachSet) -> Items:
    """The cell and attitude in which a node ends; near ones are worth more than far ones.

    Evasion starts near the vehicle: a heading is worth 1 / layer, from 1.
    """
    inside = np.flatnonzero(pool.end_cell >= 0)
    turns = np.round(pool.states[inside, 3:] / YAW_STEP_RAD) + 0.0
    classes, index = np.unique(
        np.column_stack([pool.end_cell[inside], turns]), axis=0, return_inverse=True
    )
    start = np.concatenate([[0], np.cumsum(pool.end_cell >= 0)]).astype(np.int32)
    layer = classes[:, 0] // (pool.grid.columns * pool.grid.rows)
    return Items(start, index.reshape(-1).astype(np.int32), 1.0 / (1.0 + layer))


def greedy_cover(
    pool: ReachSet,
    buffers: ByteArray,
    held: ByteArray,
    mirror: tuple[int, ...] | None,
    items: Items,
    most_nodes: float = np.inf,
) -> ByteArray:
    """Buffers [kept, deep] of `held` and of what adds the most worth of items per new node.

    pool: reach set of all of `buffers` [trajectories, deep], sorted. Trajectories are taken with
    their mirror images, ties in their order, until nothing new is left or `most_nodes` reached.
    """
    own = keys_of(buffers)
    kept = _greedy(
        pool.trajectories,
        images_within(buffers, mirror),
        np.isin(own, keys_of(held)),
        pool.parent,
        items,
        float(most_nodes),
    )
    return buffers[kept]


@compiled
def _greedy(
    leaf: Ints,
    image: Ints,
    held: Bools,
    parent: Int32s,
    items: Items,
    most_nodes: float,
) -> Bools:
    """[trajectories] which are kept."""
    kept = np.zeros(len(leaf), dtype=np.bool_)
    has_node = np.zeros(len(parent), dtype=np.bool_)
    has_item = np.zeros(len(items.worth), dtype=np.bool_)
    nodes = 0
    for n in range(len(leaf)):
        if held[n]:
            kept[n] = True
            nodes += _enter(leaf[n], parent, items, has_node, has_item)
    while True:
        best, best_gain = -1, 0.0
        for n in range(len(leaf)):
            if kept[n] or image[n] < n:
                continue
            added, worth = _gain(leaf[n], parent, items, has_node, has_item)
            pair = added if image[n] == n else 2 * added
            # Its image adds as much on the other side, so one of them tells the ratio of both.
            if worth > best_gain * added + 1e-12 and nodes + pair <= most_nodes:
                best, best_gain = n, worth / added
        if best < 0:
            return kept
        for n in (best, image[best]):
            kept[n] = True
            nodes += _enter(leaf[n], parent, items, has_node, has_item)


@compiled
def _gain(
    node: int, parent: Int32s, items: Items, has_node: Bools, has_item: Bools
) -> tuple[int, float]:
    """New nodes, and the worth of new items, of the trajectory that ends with a node."""
    nodes, worth = 0, 0.0
    while node >= 0 and not has_node[node]:
        nodes += 1
        for at in range(items.row_start[node], items.row_start[node + 1]):
            if not has_item[items.item[at]]:
                worth += items.worth[items.item[at]]
        node = parent[node]
    return nodes, worth


@compiled
def _enter(node: int, parent: Int32s, items: Items, has_node: Bools, has_item: Bools) -> int:
    """Enter a trajectory's nodes and items into the masks; how many nodes were new."""
    nodes = 0
    while node >= 0 and not has_node[node]:
        nodes += 1
        has_node[node] = True
        for at in range(items.row_start[node], items.row_start[node + 1]):
            has_item[items.item[at]] = True
        node = parent[node]
    return nodes
