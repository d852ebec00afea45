"""Fusion (4.17)-(4.23): evidence per cell to ratings of cells, nodes and trajectories.

Evidence comes as flat [cells] arrays from rooms that do not know each other: sensors, obstacle
map, intruders. What follows here is the same for whatever they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from clearway.avoidance.calibration import calibration, classes_of
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.errors import OwnCodeError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.own_code import callable_own, guarded
from clearway.base.state import BoolArray, IndexArray, IntArray
from clearway.base.variants import Variants
from clearway.reach.tree import ReachSet


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What every source says of every cell; `Evidence.free` is the start of (4.19)."""

    grid: AvoidanceGrid
    detected: FloatArray
    """[cells] P_OD, probability of a detected obstacle (5.38)."""
    visibility: FloatArray
    """[cells] P_V (5.47)."""
    map_base: FloatArray
    """[cells] share of the cell that map obstacles fill (5.53)."""
    intruder: FloatArray
    """[cells] P_OI, probability of meeting an intruder (5.37)."""
    coated: BoolArray
    """[cells] true where the safety margin around the evidence reaches into the cell."""
    seen: BoolArray
    """[cells] true where some beam of some sensor looks into the cell's column."""

    __repr__ = brief

    @classmethod
    def free(cls, grid: AvoidanceGrid) -> Evidence:
        """Nothing known and everything visible, as (4.19) starts."""
        zeros, nothing = np.zeros(grid.cells), np.zeros(grid.cells, dtype=np.bool_)
        return cls(grid, zeros, np.ones(grid.cells), zeros, zeros, nothing, ~nothing)


Rating = Callable[[Evidence, FloatArray, FloatArray], FloatArray]
"""(evidence, obstacle [cells], unknown [cells]) -> how safe each cell is, [cells] in [0, 1]."""


def printed(evidence: Evidence, obstacle: FloatArray, unknown: FloatArray) -> FloatArray:
    """1 - P_O P_V, the factor of (4.22) as printed: what is hidden costs nothing."""
    rating = 1.0 - obstacle * evidence.visibility
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def visible(evidence: Evidence, obstacle: FloatArray, unknown: FloatArray) -> FloatArray:
    """P_V (1 - P_O), as 2.2.2 says it: only what is seen to be free is safe."""
    rating = evidence.visibility * (1.0 - obstacle)
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def evidence_only(evidence: Evidence, obstacle: FloatArray, unknown: FloatArray) -> FloatArray:
    """1 - P_O: visibility only as far as P_OD and P_OM contain it."""
    rating = 1.0 - obstacle
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def total(evidence: Evidence, obstacle: FloatArray, unknown: FloatArray) -> FloatArray:
    """(1 - P_OI) [max(0, P_V - P_OD) + (1 - P_V)(1 - base)(1 - u)]: by total probability.

    A visible part of the cell is free unless a beam returned from it; a hidden part is free
    unless the map fills it or unknown space counts as blocked.
    """
    del obstacle
    return total_of(
        evidence.detected,
        evidence.visibility,
        evidence.map_base,
        evidence.intruder,
        unknown,
    )


@compiled
def total_of(
    detected: FloatArray,
    visibility: FloatArray,
    map_base: FloatArray,
    intruder: FloatArray,
    unknown: FloatArray,
) -> FloatArray:
    """The rating `total` of every cell."""
    rating = np.empty(len(detected))
    for cell in range(len(detected)):
        seen_free = visibility[cell] - detected[cell]
        if seen_free < 0.0:  # What is not a number stays so.
            seen_free = 0.0
        hidden_free = (1.0 - visibility[cell]) * (1.0 - map_base[cell]) * (1.0 - unknown[cell])
        rating[cell] = (1.0 - intruder[cell]) * (seen_free + hidden_free)
    return rating


def calibrated(evidence: Evidence, obstacle: FloatArray, unknown: FloatArray) -> FloatArray:
    """The total rating as what came of it: of passages rated so, the share that kept the margin."""
    said = total(evidence, obstacle, unknown)
    classes = classes_of(evidence.coated, evidence.visibility, evidence.intruder)
    rating = calibration()(said, classes)
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def _own_rating(label: str, found: Any) -> Rating:
    """A user's rating; what is no number within [0, 1] for every cell is refused in flight too."""
    function = guarded(label, callable_own(label, found, ("evidence", "obstacle", "unknown")))

    def rating(evidence: Evidence, obstacle: FloatArray, unknown: FloatArray) -> FloatArray:
        said = function(evidence, obstacle, unknown)
        try:
            rated = np.ascontiguousarray(said, dtype=np.float64)
        except (TypeError, ValueError):
            raise OwnCodeError(label, f"gave {type(said).__name__}, no numbers") from None
        if rated.shape != obstacle.shape:
            raise OwnCodeError(
                label, f"gave an array {rated.shape}; one number a cell is {obstacle.shape}"
            )
        if not (rated.min() >= 0.0 and rated.max() <= 1.0):
            raise OwnCodeError(
                label, f"gave {rated.min():g} to {rated.max():g}: a rating is within [0, 1]"
            )
        return rated

    return rating


RATINGS: Variants[Rating] = Variants(
    "rating",
    {
        "total": total,
        "printed": printed,
        "visible": visible,
        "evidence": evidence_only,
        "calibrated": calibrated,
    },
    _own_rating,
)
"""Ratings by name; add one here."""


def rating_named(name: str) -> Rating:
    """The rating of that name, or a user's as `module:name`; else ClearwayError with the valid."""
    return RATINGS.named(name)


@dataclass(frozen=True, slots=True, eq=False)
class CellAssessment:
    """Probabilities and rating of every cell."""

    evidence: Evidence
    map: FloatArray
    """[cells] P_OM (5.54)."""
    obstacle: FloatArray
    """[cells] P_O (4.17)."""
    rating: FloatArray
    """[cells] how safe a passage is, in [0, 1]."""

    __repr__ = brief


def assess_cells(
    evidence: Evidence,
    rating: Rating = total,
    unknown: float = 0.0,
    unknown_unseen: float = 1.0,
) -> CellAssessment:
    """Obstacle probability and rating of all cells, (4.17), (5.54) and the named rating.

    unknown: how far hidden space counts as blocked, u in [0, 1]; unknown_unseen: the same for
    columns without any beam.
    """
    map_probability, obstacle = obstacle_of(
        evidence.detected, evidence.visibility, evidence.map_base, evidence.intruder
    )
    unknown_cells = unknown_of(evidence.seen, float(unknown), float(unknown_unseen))
    return CellAssessment(
        evidence, map_probability, obstacle, rating(evidence, obstacle, unknown_cells)
    )


@compiled
def obstacle_of(
    detected: FloatArray,
    visibility: FloatArray,
    map_base: FloatArray,
    intruder: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """P_OM (5.54) and P_O (4.17) of every cell."""
    cells = len(detected)
    map_probability, obstacle = np.empty(cells), np.empty(cells)
    for cell in range(cells):
        map_probability[cell] = map_base[cell] * (1.0 - visibility[cell])
        free = (1.0 - intruder[cell]) * (1.0 - map_probability[cell]) * (1.0 - detected[cell])
        obstacle[cell] = 1.0 - free
    return map_probability, obstacle


@compiled
def unknown_of(seen: BoolArray, unknown: float, unknown_unseen: float) -> FloatArray:
    """[cells] how far what is hidden counts as blocked."""
    shares = np.empty(len(seen))
    for cell in range(len(seen)):
        shares[cell] = unknown if seen[cell] else unknown_unseen
    return shares


@dataclass(frozen=True, eq=False)
class ReachAssessment:
    """Reachability of nodes, trajectories and cells, and what the next decision will have; what no
    decision goes by is worked out when asked for."""

    node_rating: FloatArray
    """[nodes] product of cell ratings from the start to the end of the node: (4.22), def. 20."""
    feasibility: FloatArray
    """[nodes] P_D (2.3): best product of ratings over any continuation to a complete one."""
    reach_set: ReachSet = field(repr=False)
    rated_by: Callable[[], FloatArray] = field(repr=False)
    """The ratings [cells] that it was rated by."""
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
        ways = self.reach_set
        return _continuations(
            ways.parent,
            ways.cell_start,
            ways.cell_index,
            ways.exit_kind,
            self.rated_by(),
            self.threshold,
        )

    @cached_property
    def _cells(self) -> tuple[FloatArray, BoolArray, IntArray]:
        ways = self.reach_set
        return _reach_cells(
            ways.parent,
            ways.cell_start,
            ways.cell_index,
            ways.exit_kind,
            self.node_rating,
            self.rated_by(),
            self.threshold,
        )


class PassedCells(NamedTuple):
    """Of a reach set, which cells its movements pass."""

    parent: IndexArray
    cell_start: IndexArray
    cell_index: IndexArray
    exit_kind: IndexArray

    def __repr__(self) -> str:
        return brief(self)

    @classmethod
    def of(cls, reach_set: ReachSet) -> PassedCells:
        return cls(
            reach_set.parent, reach_set.cell_start, reach_set.cell_index, reach_set.exit_kind
        )


def rate_reach_set(
    reach_set: ReachSet, cell_rating: FloatArray, threshold: float = 0.5
) -> ReachAssessment:
    """Rate every node, cell and continuation of a reach set, (4.21)-(4.23) and P_D (2.3).

    cell_rating: [cells] of the reach set's grid.
    """
    node_rating, feasibility = rate_nodes(
        reach_set.parent,
        reach_set.cell_start,
        reach_set.cell_index,
        reach_set.exit_kind,
        cell_rating,
    )
    rated_by = partial(np.asarray, cell_rating)
    return ReachAssessment(node_rating, feasibility, reach_set, rated_by, float(threshold))


def untouched(reach_set: ReachSet, coated: BoolArray) -> BoolArray:
    """[nodes] paths that pass no coated cell from the start to the end of the node (def. 6)."""
    return untouched_nodes(reach_set.parent, reach_set.cell_start, reach_set.cell_index, coated)


@compiled
def untouched_nodes(
    parent: IndexArray, cell_start: IndexArray, cell_index: IndexArray, coated: BoolArray
) -> BoolArray:
    """[nodes] `untouched`."""
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
    parent: IndexArray,
    cell_start: IndexArray,
    cell_index: IndexArray,
    exit_kind: IndexArray,
    cell_rating: FloatArray,
) -> tuple[FloatArray, FloatArray]:
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
    parent: IndexArray, cell_start: IndexArray, cell_index: IndexArray, cell_rating: FloatArray
) -> FloatArray:
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
    parent: IndexArray,
    cell_start: IndexArray,
    cell_index: IndexArray,
    exit_kind: IndexArray,
    node_rating: FloatArray,
    cell_rating: FloatArray,
    threshold: float,
) -> tuple[FloatArray, BoolArray, IntArray]:
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
def _leaves_below(parent: IndexArray, exit_kind: IndexArray) -> IntArray:
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
    parent: IndexArray,
    cell_start: IndexArray,
    cell_index: IndexArray,
    exit_kind: IndexArray,
    cell_rating: FloatArray,
    threshold: float,
) -> FloatArray:
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
