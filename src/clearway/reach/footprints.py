"""How many footprints the full reach set has: counted where feasible, else estimated (4.27).

Footprints (def. 22) form a tree of their own: below a footprint hang those that are longer by
one cell. Each of its nodes stands for all trajectory ends that have this footprint, and those
are carried along. Counting visits the whole tree; estimating follows a few branches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError
from clearway.frames import FloatArray
from clearway.grid import AvoidanceGrid
from clearway.movements import MovementAutomaton
from clearway.reach.lattice import build_lattice, grid_from_level, movements_deep
from clearway.reach.offspring import START_CELL, offspring_of
from clearway.state import BoolArray, IntArray

MOST_STATES = 30_000_000
"""States that one footprint may stand for when counting: about 2 GB."""
THIN_STATES = 1_000_000
"""States that one footprint may stand for when estimating; more are represented by as many."""
SIZE_EXPONENT = 0.1
"""Footprints of many states have more below them, but not in proportion."""


@dataclass(frozen=True)
class FullCount:
    """The full reach set, counted: trajectories in the last layer, by movement end points."""

    nodes: int
    """Nodes inside the grid, whether or not a trajectory goes on from them."""
    trajectories: int
    footprints: int
    cells: BoolArray
    """[cells] which ones a trajectory reaches."""


@dataclass(frozen=True)
class FootprintEstimate:
    """Unbiased estimate of the number of footprints, from independent repetitions."""

    footprints: float
    standard_error: float
    repetitions: int
    thinned: int
    """Footprints followed that stood for more than THIN_STATES states, of which as many were
    drawn. Each can only lower the estimate, by longer footprints that none of those leads to."""


@dataclass(frozen=True, eq=False)
class _Footprint:
    """One footprint: its last cell, and every trajectory end that has it."""

    cell: int
    state: FloatArray
    """[n, 4] x, y, z, yaw in the level frame."""
    place: npt.NDArray[np.int32]
    """[n, 2] attitude and movements so far."""


class FootprintTree:
    """The tree of footprints of an automaton in a grid from one start pitch."""

    def __init__(
        self, automaton: MovementAutomaton, grid: AvoidanceGrid, start_pitch_rad: float = 0.0
    ) -> None:
        self.grid = grid
        self.deep = movements_deep(automaton, grid)
        lattice = build_lattice(automaton, grid, (start_pitch_rad,), self.deep)
        self._pieces = lattice.pieces
        self._rotation = grid_from_level(start_pitch_rad)
        start = np.array([[lattice.start[start_pitch_rad], 0]], dtype=np.int32)
        self.root = _Footprint(START_CELL, np.zeros((1, 4)), start)

    def offspring(self, footprint: _Footprint) -> _Offspring:
        """What hangs below a footprint; raises ClearwayError when it outgrows memory."""
        grid = self.grid
        found = offspring_of(
            footprint.state,
            footprint.place,
            footprint.cell,
            self.deep,
            self._pieces,
            self._rotation,
            grid.edges,
            MOST_STATES,
        )
        if found[0] < 0:
            raise ClearwayError(f"a footprint stands for more than {MOST_STATES} states")
        return _Offspring(*found)


@dataclass(frozen=True, eq=False)
class _Offspring:
    """Children of a footprint, their states sorted by cell."""

    nodes: int
    """Movement ends inside the grid, those that stay in the footprint's cell included."""
    ended: IntArray
    """[last layer + 1] trajectories that end in each cell of the last layer, or beyond it."""
    cells: IntArray
    """[children]"""
    start: IntArray
    """[children + 1] where each child's states begin."""
    state: FloatArray
    place: npt.NDArray[np.int32]

    def child(self, index: int) -> _Footprint:
        rows = slice(self.start[index], self.start[index + 1])
        return _Footprint(int(self.cells[index]), self.state[rows], self.place[rows])


def count_full(tree: FootprintTree) -> FullCount:
    """Visit every footprint. Minutes for 9 movements and 9 layers, and ten times more a layer."""
    grid = tree.grid
    nodes = trajectories = footprints = 0
    reached = np.zeros(grid.cells, dtype=np.bool_)
    last = grid.cells - grid.columns * grid.rows
    waiting: list[tuple[_Footprint, tuple[int, ...]]] = [(tree.root, ())]
    while waiting:
        footprint, way = waiting.pop()
        below = tree.offspring(footprint)
        nodes += below.nodes
        ended = below.ended
        trajectories += int(ended.sum())
        footprints += int(np.count_nonzero(ended))
        if np.any(ended):
            reached[list(way)] = True
            reached[last:] |= ended[:-1] > 0
        waiting += [
            (below.child(index), (*way, int(cell)) if cell >= 0 else way)
            for index, cell in enumerate(below.cells)
        ]
    return FullCount(nodes, trajectories, footprints, reached)


def estimate_footprints(
    tree: FootprintTree, branches: int = 16, repetitions: int = 8, seed: int = 0
) -> FootprintEstimate:
    """Number of footprints by following `branches` at a time, `repetitions` times over.

    Where more branches open than are followed, some are drawn with chances in proportion to
    weight x states^0.1, and each counts for the inverse of its chance (stochastic enumeration
    with Horvitz-Thompson weights), which makes each repetition unbiased.
    """
    rng = np.random.default_rng(seed)
    results = [_one_estimate(tree, branches, rng) for _ in range(repetitions)]
    totals = np.array([total for total, _ in results])
    error = float(np.std(totals, ddof=1) / np.sqrt(repetitions)) if repetitions > 1 else np.inf
    return FootprintEstimate(
        float(np.mean(totals)), error, repetitions, sum(thinned for _, thinned in results)
    )


def _one_estimate(
    tree: FootprintTree, branches: int, rng: np.random.Generator
) -> tuple[float, int]:
    """The estimate, and how many footprints stood for too many states."""
    total, thinned = 0.0, 0
    followed = [(1.0, tree.root)]
    while followed:
        opened: list[tuple[float, _Footprint]] = []
        for weight, footprint in followed:
            below = tree.offspring(footprint)
            total += weight * np.count_nonzero(below.ended)
            opened += [(weight, below.child(index)) for index in range(len(below.cells))]
        followed = _drawn(opened, branches, rng)
        thinned += sum(len(each.place) > THIN_STATES for _, each in followed)
        followed = [(weight, _thinned(each, rng)) for weight, each in followed]
    return total, thinned


def _thinned(footprint: _Footprint, rng: np.random.Generator) -> _Footprint:
    """The footprint with at most THIN_STATES of its states, in memory of its own."""
    rows = np.arange(len(footprint.place))
    if len(rows) > THIN_STATES:
        rows = rng.choice(rows, THIN_STATES, replace=False)
    return _Footprint(footprint.cell, footprint.state[rows], footprint.place[rows])


def _drawn(
    opened: list[tuple[float, _Footprint]], count: int, rng: np.random.Generator
) -> list[tuple[float, _Footprint]]:
    """A systematic sample with unequal chances, each with its weight over its chance."""
    if len(opened) <= count:
        return opened
    size = np.array([weight * len(each.place) ** SIZE_EXPONENT for weight, each in opened])
    chance = _chances(size, count)
    order = rng.permutation(len(opened))
    ends = np.cumsum(chance[order]) - rng.random()
    hit = np.diff(np.ceil(np.concatenate([[ends[0] - chance[order[0]]], ends]))) > 0
    return [(opened[n][0] / chance[n], opened[n][1]) for n in order[hit]]


def _chances(size: FloatArray, count: int) -> FloatArray:
    """Chances of being drawn in proportion to size, none above 1, that add up to `count`."""
    certain = np.zeros(len(size), dtype=np.bool_)
    while True:
        rest = count - np.count_nonzero(certain)
        chance = np.where(certain, 1.0, rest * size / max(size[~certain].sum(), 1e-300))
        above = (chance > 1.0) & ~certain
        if not np.any(above):
            return chance
        certain |= above
