"""The tree of all footprints of the full reach set, and their number by counting (4.27).

Footprints (def. 22) form a tree of their own: below a footprint hang those that are longer by
one cell. Each of its nodes stands for all trajectory ends that have this footprint, and those
are carried along. Counting visits the whole tree; `estimate` follows a few branches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.reach.compare.offspring import START_CELL, offspring_of
from clearway.reach.compare.walks import Along, outcomes_of_walks, walks_until
from clearway.reach.expand.lattice import build_lattice, grid_from_level, movements_deep
from clearway.vehicle.automaton import MovementAutomaton

MOST_STATES = 30_000_000
"""States that one footprint may stand for when counting: about 2 GB."""


@dataclass(frozen=True)
class FullCount:
    """The full reach set, counted: trajectories in the last layer, by movement end points."""

    nodes: int
    """Nodes inside the grid, whether or not a trajectory goes on from them."""
    trajectories: int
    footprints: int
    cells: BoolArray
    """[cells] which ones a trajectory reaches."""


@dataclass(frozen=True, eq=False)
class Footprint:
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
        self.root = Footprint(START_CELL, np.zeros((1, 4)), start)

    def offspring(self, footprint: Footprint) -> Offspring:
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
        return Offspring(*found)

    @property
    def inner_cells(self) -> int:
        """Cells before the last layer, in which no footprint ends."""
        return self.grid.cells - self.grid.columns * self.grid.rows

    def outcomes(
        self, footprint: Footprint, way: tuple[int, ...], walks: int, seed: int
    ) -> IntArray:
        """[cells + 1] where random walks end behind a way that starts in a footprint's cell."""
        return outcomes_of_walks(self._along(footprint, way), walks, seed)

    def walks_until(
        self, footprint: Footprint, way: tuple[int, ...], wanted: int, times: int, seed: int
    ) -> int:
        """How many such walks it takes until `times` of them have ended in a wanted cell."""
        return walks_until(self._along(footprint, way), wanted, times, seed)

    def _along(self, footprint: Footprint, way: tuple[int, ...]) -> Along:
        cells = np.array(way, dtype=np.int64)
        return Along(
            footprint.state,
            footprint.place,
            cells,
            self.deep,
            self._pieces,
            self._rotation,
            self.grid.edges,
        )


@dataclass(frozen=True, eq=False)
class Offspring:
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

    def child(self, index: int) -> Footprint:
        rows = slice(self.start[index], self.start[index + 1])
        return Footprint(int(self.cells[index]), self.state[rows], self.place[rows])


def count_full(tree: FootprintTree) -> FullCount:
    """Visit every footprint. Minutes for 9 movements and 9 layers, and ten times more a layer."""
    grid = tree.grid
    nodes = trajectories = footprints = 0
    reached = np.zeros(grid.cells, dtype=np.bool_)
    last = tree.inner_cells
    waiting: list[tuple[Footprint, tuple[int, ...]]] = [(tree.root, ())]
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
