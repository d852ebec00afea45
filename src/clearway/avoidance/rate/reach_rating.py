"""Ratings of cells to those of nodes and trajectories, (4.21)-(4.23), and what they leave (2.3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from clearway.base.arrays import Bools, Floats, Int8s, Int32s, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.reach.tree import ReachSet


@dataclass(frozen=True, eq=False)
class ReachAssessment:
    """Reachability of nodes, trajectories and cells, and what the next decision will have; what no
    decision goes by is worked out when asked for."""

    node_rating: FloatArray
    """[nodes] product of cell ratings from the start to the end of the node: (4.22), def. 20."""
    feasibility: FloatArray
    """[nodes] P_D (2.3): best product of ratings over any continuation to a complete one."""
    reach_set: ReachSet = field(repr=False)
    cell_rating: FloatArray = field(repr=False)
    """[cells] ratings that it was rated by."""
    threshold: float

    __repr__ = brief

    @property
    def reachability(self) -> FloatArray:
        """[cells] best rating of any trajectory up to and including the cell; 0 if none.

        (4.23), def. 21.
        """
        return self._cells[0]

    @property
    def passed(self) -> BoolArray:
        """[cells] whether any trajectory passes: where one does, a reachability of 0 is blocked."""
        return self._cells[1]

    @property
    def trajectories(self) -> IntArray:
        """[cells] complete trajectories that arrive in the cell rated at or above the threshold."""
        return self._cells[2]

    @cached_property
    def continuations(self) -> FloatArray:
        """[nodes] share of continuations rated at or above the threshold."""
        one = self.reach_set
        return _continuations(
            one.parent,
            one.cell_start,
            one.cell_index,
            one.exit_kind,
            self.cell_rating,
            self.threshold,
        )

    @cached_property
    def _cells(self) -> tuple[FloatArray, BoolArray, IntArray]:
        one = self.reach_set
        return _reach_cells(
            one.parent,
            one.cell_start,
            one.cell_index,
            one.exit_kind,
            self.node_rating,
            self.cell_rating,
            self.threshold,
        )


def rate_reach_set(
    reach_set: ReachSet, cell_rating: FloatArray, threshold: float = 0.5
) -> ReachAssessment:
    """Rate every node, cell and continuation of a reach set, (4.21)-(4.23) and P_D (2.3).

    Parameters
    ----------
    reach_set
        The trajectories.
    cell_rating
        [cells] of the reach set's grid: how safe a passage is.
    threshold
        Rating from which trajectories and continuations count.
    """
    one = reach_set
    node_rating, feasibility = rate_nodes(
        one.parent, one.cell_start, one.cell_index, one.exit_kind, cell_rating
    )
    return ReachAssessment(node_rating, feasibility, reach_set, cell_rating, float(threshold))


def find_untouched(reach_set: ReachSet, coated: BoolArray) -> BoolArray:
    """[nodes] paths that pass no inflated cell from the start to the end of the node (def. 6)."""
    return find_untouched_nodes(
        reach_set.parent, reach_set.cell_start, reach_set.cell_index, coated
    )


@compiled
def find_untouched_nodes(
    parent: Int32s, cell_start: Int32s, cell_index: Int32s, coated: Bools
) -> Bools:
    """[nodes] `find_untouched`."""
    clear = np.ones(len(parent), dtype=np.bool_)
    for n in range(len(parent)):
        if parent[n] >= 0 and not clear[parent[n]]:
            clear[n] = False
            continue
        for at in range(cell_start[n], cell_start[n + 1]):
            if coated[cell_index[at]]:
                clear[n] = False
                break
    return clear


@compiled
def rate_nodes(
    parent: Int32s,
    cell_start: Int32s,
    cell_index: Int32s,
    exit_kind: Int8s,
    cell_rating: Floats,
) -> tuple[Floats, Floats]:
    """[nodes] rating up to the end of each, and the best of the ways on from there."""
    nodes = len(parent)
    rating, feasibility = np.empty(nodes), np.zeros(nodes)
    own = _own_ratings(parent, cell_start, cell_index, cell_rating)
    for n in range(nodes):
        rating[n] = (rating[parent[n]] if parent[n] >= 0 else 1.0) * own[n]
    for n in range(nodes - 1, -1, -1):
        if exit_kind[n] != 0:
            feasibility[n] = max(feasibility[n], 1.0)
        if parent[n] >= 0:
            feasibility[parent[n]] = max(feasibility[parent[n]], feasibility[n] * own[n])
    return rating, feasibility


@compiled
def _own_ratings(
    parent: Int32s, cell_start: Int32s, cell_index: Int32s, cell_rating: Floats
) -> Floats:
    """[nodes] product of the ratings of the cells that each movement passes."""
    own = np.empty(len(parent))
    for n in range(len(parent)):
        product = 1.0
        for at in range(cell_start[n], cell_start[n + 1]):
            product *= cell_rating[cell_index[at]]
        own[n] = product
    return own


@compiled
def _reach_cells(
    parent: Int32s,
    cell_start: Int32s,
    cell_index: Int32s,
    exit_kind: Int8s,
    node_rating: Floats,
    cell_rating: Floats,
    threshold: float,
) -> tuple[Floats, Bools, Ints]:
    """[cells] best rating, whether any trajectory passes, and how many complete ones arrive."""
    leaves = _leaves_below(parent, exit_kind)
    best = np.zeros(len(cell_rating))
    passed = np.zeros(len(cell_rating), dtype=np.bool_)
    arriving = np.zeros(len(cell_rating), dtype=np.int64)
    for n in range(len(parent)):
        before = node_rating[parent[n]] if parent[n] >= 0 else 1.0
        product = 1.0
        for at in range(cell_start[n], cell_start[n + 1]):
            cell = cell_index[at]
            product *= cell_rating[cell]
            passed[cell] = True
            best[cell] = max(best[cell], before * product)
            if before * product >= threshold:
                arriving[cell] += leaves[n]
    return best, passed, arriving


@compiled
def _leaves_below(parent: Int32s, exit_kind: Int8s) -> Ints:
    """[nodes] complete trajectories through a node, its own end among them."""
    leaves = np.zeros(len(parent), dtype=np.int64)
    for n in range(len(parent) - 1, -1, -1):
        if exit_kind[n] != 0:
            leaves[n] += 1
        if parent[n] >= 0:
            leaves[parent[n]] += leaves[n]
    return leaves


@compiled
def _continuations(
    parent: Int32s,
    cell_start: Int32s,
    cell_index: Int32s,
    exit_kind: Int8s,
    cell_rating: Floats,
    threshold: float,
) -> Floats:
    """[nodes] share of the ways on from a node that are rated above the threshold."""
    leaves = _leaves_below(parent, exit_kind)
    own = _own_ratings(parent, cell_start, cell_index, cell_rating)
    share = np.zeros(len(parent))
    for leaf in range(len(parent)):
        if exit_kind[leaf] == 0:
            continue
        n, product = leaf, 1.0
        while n >= 0:
            if product >= threshold:
                share[n] += 1.0
            product *= own[n]
            n = parent[n]
    for n in range(len(parent)):
        share[n] /= max(leaves[n], 1)
    return share
