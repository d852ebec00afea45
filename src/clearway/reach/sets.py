"""Reach sets by name: one expansion, distinguished by which trajectories are kept (section 4.5)."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping

import numpy as np

from clearway.base.checks import kind_of, number_problem
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.suggest import did_you_mean
from clearway.base.variants import Variants
from clearway.reach.choose import covering, keep
from clearway.reach.choose.equivalence import each_way_once
from clearway.reach.choose.primitives import primitives
from clearway.reach.choose.select import Select, merge_sets, select_by_keeping, tree_of
from clearway.reach.choose.timed import find_timed_chains
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import Lattice, build_lattice, movements_deep
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton


def build_reach_set(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    *,
    method: str = "flying",
    start_pitch_rad: float = 0.0,
    **tuning: float,
) -> ReachSet:
    """Build the reach set of an automaton in a grid for one start pitch: (3.4), def. 1.

    Parameters
    ----------
    automaton
        What the vehicle can do.
    grid
        Cells in the body frame of the start.
    method
        One of `METHODS`.
    start_pitch_rad
        Nose down positive.
    **tuning
        Parameters of the method's function, such as `spread` of chaotic and `harmonic` of harmonic
        (nodes expanded per cell; combined has both). `depth` is the most movements of a trajectory
        (default: as many as layers, or as straight flight needs); `side_exits=0` leaves out what
        ends outside through the side.

    Returns
    -------
    ReachSet
        The tree of trajectories, in the grid frame.

    Raises
    ------
    ClearwayError
        For an unknown method or tuning, and when nothing leads through the grid.

    Examples
    --------
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> reach_set = cw.build_reach_set(automaton, cw.AvoidanceGrid.uniform(), method="primitives")
    >>> reach_set.nodes > len(reach_set.trajectories) > 0
    True
    """
    kind_of("reach set: automaton", automaton, MovementAutomaton)
    kind_of("reach set: grid", grid, AvoidanceGrid)
    if problem := number_problem("start_pitch_rad", start_pitch_rad, -np.pi, np.pi):
        raise ClearwayError(f"reach set: {problem}")
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
    if lattice.automaton.has_inertia:
        chains = find_timed_chains(lattice)[lattice.start[start_pitch_rad]]
        return tree_of(chains, lattice, grid, start_pitch_rad)
    buffers = _selection(method, rest)(lattice, grid, start_pitch_rad, deep)
    buffers = each_way_once(buffers, lattice, start_pitch_rad)
    if not len(buffers):
        raise ClearwayError(
            f"reach set {method}: no chain of up to {deep} movements leads through a grid of "
            f"{grid.range_m:g} m; check speed and duration of the movements, or give more depth"
        )
    return tree_of(buffers, lattice, grid, start_pitch_rad)


def _full(side_exits: float = 1.0) -> Select:
    """Every trajectory (section 4.5); for small grids."""
    return select_by_keeping(keep.everything, side_exits)


def _chaotic(spread: float = 9.0, side_exits: float = 1.0) -> Select:
    """Far from the cells' centres, not smooth (4.30): `spread` nodes of a cell go on."""
    return select_by_keeping(keep.best_of_cell(keep.chaotic, int(spread)), side_exits)


def _harmonic(harmonic: float = 1.0, side_exits: float = 1.0) -> Select:
    """Close to the cells' centres, and smooth (4.31): `harmonic` nodes of a cell go on."""
    return select_by_keeping(keep.best_of_cell(keep.harmonic, int(harmonic)), side_exits)


def _combine(spread: float = 8.0, harmonic: float = 1.0, side_exits: float = 1.0) -> Select:
    """Chaotic and harmonic trajectories together."""
    parts = (_harmonic(harmonic, side_exits), _chaotic(spread, side_exits))

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        return merge_sets(*(part(lattice, grid, start_pitch_rad, deep) for part in parts))

    return select


def _primitives() -> Select:
    """One turn or climb of any length, then straight."""
    return primitives


METHODS: Variants[Callable[..., Select]] = Variants(
    "reach set method",
    {
        "full": _full,
        "chaotic": _chaotic,
        "harmonic": _harmonic,
        "combined": _combine,
        "primitives": _primitives,
        "dispersion": covering.select_dispersed,
        "cover": covering.select_cover,
        "late": covering.select_late,
        "flying": covering.select_for_flying,
    },
)
"""Reach sets by name: a function of their tuning that gives the selection; add one here."""


def tuning_of(method: str) -> dict[str, float]:
    """What tunes a method, and the defaults; raises ClearwayError for an unknown one."""
    known = inspect.signature(METHODS.find(method)).parameters
    return {name: float(parameter.default) for name, parameter in known.items()}


def _selection(method: str, tuning: Mapping[str, float]) -> Select:
    known = tuning_of(method)
    unknown = [name for name in tuning if name not in known]
    if unknown:
        raise ClearwayError(
            f"reach set {method}: unknown tuning {', '.join(unknown)}"
            f"{did_you_mean(unknown[0], ('depth', *known))}; "
            f"it takes {', '.join(('depth', *known))}"
        )
    for name, value in tuning.items():
        if name != "side_exits" and not value >= 1:
            raise ClearwayError(f"reach set {method}: {name} must be at least 1, got {value}")
    return METHODS[method](**tuning)
