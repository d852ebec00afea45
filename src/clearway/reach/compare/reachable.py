"""Which cells trajectories of the full reach set can reach: what cell coverage is a share of.

Found without any reach set: chains of movements are followed all at once, each state once. While
they can all be held, cells that none of them touches are out of reach for certain. Later the states
of each cell that are farthest on are followed, and whatever lies behind a completed trajectory is
reached. A cell that was touched, but not by any of those, is decided by following all that touched
it to their ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.reach.expand.lattice import (
    Lattice,
    build_lattice,
    grid_from_level,
    movements_deep,
)
from clearway.reach.expand.trace import NEAR, OUT_BEYOND, expand
from clearway.vehicle.automaton import MovementAutomaton

HELD_STATES = 200_000
"""States of one depth up to which all are followed."""
WIDTH = 200
"""States of a cell that are followed when there are more."""
RESOLUTION = 1e-9
"""States that differ by less, in thicknesses of a layer and radians, are one and the same."""


@dataclass(frozen=True, eq=False)
class ReachableCells:
    """Cells in which a movement of some trajectory to the last layer ends."""

    reached: BoolArray
    """[cells] a trajectory is known."""
    proven: bool
    """All others are out of reach for certain."""

    @property
    def number(self) -> int:
        return int(np.count_nonzero(self.reached))


@dataclass(frozen=True, eq=False)
class _States:
    """Ends of chains of equally many movements, inside the grid and not in its last layer."""

    position_m: FloatArray
    """[n, 3] level frame."""
    yaw_rad: FloatArray
    attitude: npt.NDArray[np.int32]
    cell: IntArray
    """-1 short of the first layer."""
    above: IntArray
    """Index of the state before the movement."""

    def pick(self, rows: IntArray) -> _States:
        return _States(
            self.position_m[rows],
            self.yaw_rad[rows],
            self.attitude[rows],
            self.cell[rows],
            self.above[rows],
        )


@dataclass(frozen=True, eq=False)
class _Step:
    """What follows states by one movement more."""

    below: _States
    ending: IntArray
    """Indices of states from which a movement ends in the last layer or beyond."""
    ended: IntArray
    """[ending] cell in which it ends; -1 beyond the range."""


def reachable_cells(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    start_pitch_rad: float = 0.0,
    held_states: int = HELD_STATES,
) -> ReachableCells:
    """Cells that any trajectory of the full reach set reaches, by movement end points."""
    deep = movements_deep(automaton, grid)
    lattice = build_lattice(automaton, grid, (start_pitch_rad,), deep)
    search = _ChainSearch(lattice, grid, start_pitch_rad, deep, held_states)
    levels, steps, held, frontier = search.levels()
    reached = _behind_completed(levels, steps, grid)
    # Chains never lead back to a nearer layer, so these were seen with all their states.
    seen = grid.columns * grid.rows * frontier
    touched = np.zeros(grid.cells, dtype=np.bool_)
    for level in levels[: held + 1]:
        touched[level.cell[level.cell >= 0]] = True
    proven = bool(np.all(reached[seen:]))
    for cell in np.flatnonzero(touched[:seen] & ~reached[:seen]):
        completes = search.any_completes(int(cell), levels[: held + 1])
        reached[cell] = completes is True
        proven &= completes is not None
    return ReachableCells(reached, proven)


def _behind_completed(levels: list[_States], steps: list[_Step], grid: AvoidanceGrid) -> BoolArray:
    """[cells] those on the way of what was completed, the last layer's included."""
    reached = np.zeros(grid.cells, dtype=np.bool_)
    going = np.zeros(0, dtype=np.int64)
    for level, step in zip(levels[::-1], steps[::-1], strict=True):
        reached[step.ended[step.ended >= 0]] = True
        going = np.unique(np.concatenate([going, step.ending]))
        cells = level.cell[going]
        reached[cells[cells >= 0]] = True
        going = np.unique(level.above[going])
    return reached


@dataclass(frozen=True, eq=False)
class _ChainSearch:
    """Chains of movements through one grid, all at once."""

    lattice: Lattice
    grid: AvoidanceGrid
    start_pitch_rad: float
    deep: int
    held_states: int

    def levels(self) -> tuple[list[_States], list[_Step], int, int]:
        """States by depth, what follows them, up to which depth they are all there are.

        The last number is the layer that chains have come to when some are first left out.
        """
        level = _States(
            np.zeros((1, 3)),
            np.zeros(1),
            np.array([self.lattice.start[self.start_pitch_rad]], dtype=np.int32),
            np.array([-1]),
            np.array([0]),
        )
        levels, steps = [level], [self.step(level)]
        held, frontier = self.deep, self.grid.layers
        for depth in range(1, self.deep):
            level = _each_once(steps[-1].below, self.grid.layer_m)
            if len(level.cell) > self.held_states:
                if held == self.deep:
                    nearest = int(level.cell.min()) // (self.grid.columns * self.grid.rows)
                    held, frontier = depth - 1, max(nearest, 0)
                level = level.pick(self.farthest(level))
            if not len(level.cell):
                break
            levels.append(level)
            steps.append(self.step(level))
        return levels, steps, held, frontier

    def step(self, states: _States) -> _Step:
        """All movements of all states."""
        ends, yaws, attitudes, places = expand(
            states.position_m,
            states.yaw_rad,
            states.attitude,
            self.lattice.pieces,
            grid_from_level(self.start_pitch_rad),
            self.grid.edges,
        )
        per_layer = self.grid.columns * self.grid.rows
        cells = np.where(places == NEAR, -1, places)
        onward = cells // per_layer >= states.cell[:, None] // per_layer
        inside = ((places >= 0) | (places == NEAR)) & onward
        last = inside & (cells // per_layer == self.grid.layers - 1)
        state, movement = np.nonzero(inside & ~last)
        at = (state, movement)
        below = _States(ends[at], yaws[at], attitudes[at], cells[at], state)
        ending, by = np.nonzero(last | (places == OUT_BEYOND))
        return _Step(below, ending, np.maximum(cells[ending, by], -1))

    def farthest(self, states: _States) -> IntArray:
        """The states of each cell that are farthest out a movement later, if it is straight."""
        pitch, yaw = self.lattice.pieces.attitude_rad[states.attitude, 1], states.yaw_rad
        heading = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
        step_m = self.lattice.automaton.step_m
        ahead = states.position_m + step_m * np.stack(heading, axis=1)
        order = np.lexsort((-np.linalg.norm(ahead, axis=1), states.cell))
        cell = states.cell[order]
        first = np.searchsorted(cell, cell)
        return np.sort(order[np.arange(len(order)) - first < WIDTH])

    def any_completes(self, cell: int, levels: list[_States]) -> bool | None:
        """Whether a chain through the cell can be completed; None where that takes too much."""
        among = [level.pick(np.flatnonzero(level.cell == cell)) for level in levels]
        return self._completes(among, WIDTH) or self._completes(among, self.held_states)

    def _completes(self, among: list[_States], most: int) -> bool | None:
        """Whether any of these states can be completed; None when more than `most` come up."""
        states: list[_States] = []
        left_out = False
        for depth in range(self.deep):
            level = _each_once(_join([*states, *among[depth : depth + 1]]), self.grid.layer_m)
            if len(level.cell) > most:
                left_out = True
                level = level.pick(self.farthest(level))
            if not len(level.cell):
                continue
            step = self.step(level)
            if len(step.ending):
                return True
            states = [step.below]
        return None if left_out else False


def _join(states: list[_States]) -> _States:
    names = ("position_m", "yaw_rad", "attitude", "cell", "above")
    return _States(*(np.concatenate([getattr(s, name) for s in states]) for name in names))


def _each_once(states: _States, unit_m: float) -> _States:
    """Equal states once: what follows them is equal too."""
    key = np.empty((len(states.cell), 5), dtype=np.int64)
    key[:, :3] = np.round(states.position_m / (RESOLUTION * unit_m))
    key[:, 3] = np.round(states.yaw_rad / RESOLUTION)
    key[:, 4] = states.attitude
    _, first = np.unique(key.view(f"V{key.shape[1] * key.itemsize}").ravel(), return_index=True)
    return states.pick(np.sort(first))
