"""Reach sets by name: one expansion, told apart by which trajectories are kept (4.5)."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np

from clearway.errors import ClearwayError
from clearway.grid import AvoidanceGrid
from clearway.movements import MovementAutomaton
from clearway.reach import keep
from clearway.reach.buffers import ByteArray, nodes_of, parents_of
from clearway.reach.cover import greedy_cover, headings_in_cells, passed_cells
from clearway.reach.dispersion import farthest_of_cell
from clearway.reach.lattice import Lattice, build_lattice, movements_deep
from clearway.reach.primitives import primitives
from clearway.reach.trace import reach_set_of
from clearway.reach.tree import ReachSet
from clearway.reach.unique import without_duplicate_states
from clearway.reach.wavefront import KeepRule, trajectories

Select = Callable[[Lattice, AvoidanceGrid, float, int], ByteArray]
"""Lattice, grid, start pitch, movements deep -> buffers of the trajectories of a reach set."""


def build_reach_set(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    method: str = "flying",
    start_pitch_rad: float = 0.0,
    **tuning: float,
) -> ReachSet:
    """Reach set of an automaton in a grid for one start pitch.

    method: one of `METHODS`. tuning: `spread` of chaotic, `harmonic` of harmonic, both of combined
    (nodes expanded per cell), `pool` and `nodes_per_cell` of flying; `depth` for the most
    movements of a trajectory (default: as many as layers, or as straight flight needs);
    `side_exits=0` to leave out what ends outside through the side. Raises ClearwayError for an
    unknown method or tuning, and when nothing leads through the grid.
    """
    lattice = lattice_for(automaton, grid, (start_pitch_rad,), tuning)
    return reach_set_at(lattice, grid, method, start_pitch_rad, **tuning)


def lattice_for(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    start_pitches_rad: tuple[float, ...],
    tuning: Mapping[str, float],
) -> Lattice:
    """The lattice that reach sets with these start pitches share."""
    deep = int(tuning.get("depth", movements_deep(automaton, grid)))
    return build_lattice(automaton, grid, start_pitches_rad, deep)


def reach_set_at(
    lattice: Lattice, grid: AvoidanceGrid, method: str, start_pitch_rad: float, **tuning: float
) -> ReachSet:
    """As `build_reach_set`, for one of the lattice's start pitches."""
    rest = dict(tuning)
    deep = int(rest.pop("depth", movements_deep(lattice.automaton, grid)))
    buffers = _selection(method, rest)(lattice, grid, start_pitch_rad, deep)
    if not len(buffers):
        raise ClearwayError(
            f"reach set {method}: no chain of up to {deep} movements leads through a grid of "
            f"{grid.range_m:g} m; check speed and duration of the movements, or give more depth"
        )
    return _tree_of(buffers, lattice, grid, start_pitch_rad)


def merged(*sets: ByteArray) -> ByteArray:
    """Trajectories of several sets in one, each once (4.5.4)."""
    return np.unique(np.concatenate(sets), axis=0)


def _tree_of(
    buffers: ByteArray, lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float
) -> ReachSet:
    parent, movement = parents_of(nodes_of(buffers))
    return reach_set_of(parent, movement, grid, lattice, start_pitch_rad)


def _expanded(rule: KeepRule, side_exits: float) -> Select:
    return partial(trajectories, keep=rule, side_exits=bool(side_exits))


def _full(side_exits: float = 1.0) -> Select:
    return _expanded(keep.everything, side_exits)


def _chaotic(spread: float = 9.0, side_exits: float = 1.0) -> Select:
    return _expanded(keep.best_of_cell(keep.chaotic, int(spread)), side_exits)


def _harmonic(harmonic: float = 1.0, side_exits: float = 1.0) -> Select:
    return _expanded(keep.best_of_cell(keep.harmonic, int(harmonic)), side_exits)


def _combined(spread: float = 8.0, harmonic: float = 1.0, side_exits: float = 1.0) -> Select:
    parts = (_harmonic(harmonic, side_exits), _chaotic(spread, side_exits))

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        return merged(*(part(lattice, grid, start_pitch_rad, deep) for part in parts))

    return select


def _primitives() -> Select:
    return primitives


def _flying(pool: float = 6.0, nodes_per_cell: float = 2.5) -> Select:
    """The primitives, a cover of all cells of a dispersed pool, and more headings in them.

    The pool is expanded from the `pool` most different nodes of every cell. Headings are added
    until there are `nodes_per_cell` nodes for every cell covered.
    """

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        rule = farthest_of_cell(int(pool), _look_ahead_m(lattice, grid))
        held = primitives(lattice, grid, start_pitch_rad, deep)
        spread = trajectories(lattice, grid, start_pitch_rad, deep, rule)
        buffers = without_duplicate_states(held, spread, lattice, start_pitch_rad)
        if not len(buffers):
            return buffers
        tree = _tree_of(buffers, lattice, grid, start_pitch_rad)
        most = nodes_per_cell * len(np.unique(tree.cell_index))
        covered = greedy_cover(tree, buffers, held, lattice.mirror, passed_cells(tree))
        headings = headings_in_cells(tree)
        return greedy_cover(tree, buffers, covered, lattice.mirror, headings, most)

    return select


def _look_ahead_m(lattice: Lattice, grid: AvoidanceGrid) -> float:
    """A turn counts as far as it leads off over the turning radius, within reason."""
    return min(lattice.automaton.turning_radius_m, grid.range_m)


METHODS: Mapping[str, Callable[..., Select]] = MappingProxyType(
    {
        "full": _full,
        "chaotic": _chaotic,
        "harmonic": _harmonic,
        "combined": _combined,
        "primitives": _primitives,
        "flying": _flying,
    }
)
"""Reach sets by name: a function of their tuning that gives the selection."""


def _selection(method: str, tuning: Mapping[str, float]) -> Select:
    if method not in METHODS:
        raise ClearwayError(f"no reach set method {method!r}; there are {', '.join(METHODS)}")
    known = inspect.signature(METHODS[method]).parameters
    unknown = [name for name in tuning if name not in known]
    if unknown:
        raise ClearwayError(
            f"reach set {method}: unknown tuning {', '.join(unknown)}; "
            f"it takes {', '.join(('depth', *known))}"
        )
    for name, value in tuning.items():
        if name != "side_exits" and not value >= 1:
            raise ClearwayError(f"reach set {method}: {name} must be at least 1, got {value}")
    return METHODS[method](**tuning)
