"""Table 6.1 as measured: every method on one grid, against the full reach set (4.27)."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from clearway.base.grid import AvoidanceGrid
from clearway.reach.choose.coverage import Coverage, measure_coverage
from clearway.reach.compare.dispersal import (
    Dispersion,
    ReachableSample,
    measure_dispersion,
    sample_reachable,
)
from clearway.reach.compare.estimate import estimate_footprints
from clearway.reach.compare.footprints import FootprintTree, count_full
from clearway.reach.compare.reachable import ReachableCells, reachable_cells
from clearway.reach.sets import METHODS, build_reach_set, tuning_of
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton

MOST_COUNTED = 5.0e7
"""Nodes of a full reach set up to which footprints are counted rather than estimated."""


@dataclass(frozen=True)
class Contender:
    """A method with its tuning, and the figures that table 6.1 prints for it."""

    name: str
    method: str
    tuning: Mapping[str, float]
    paper: tuple[int, int, float] | None = None
    """Nodes, trajectories and coverage ratio as printed."""


COMPARED_WITH_TUNING = ("full", "chaotic", "harmonic", "combined")
"""What is listed by itself: full is what the others are measured against."""


def spread_of(method: str) -> str | None:
    """What tells how many nodes of a cell go on, for methods that it alone tunes."""
    tuning = [name for name in tuning_of(method) if name != "side_exits"]
    return tuning[0] if len(tuning) == 1 and tuning[0] in ("spread", method) else None


def _as_it_comes(method: str) -> Contender:
    name = spread_of(method)
    if name is None:
        return Contender(method, method, {})
    count = int(tuning_of(method)[name])
    return Contender(f"{method} {count}", method, {name: count})


TABLE_6_1 = (
    Contender("chaotic 9", "chaotic", {"spread": 9}, (2483, 725, 0.90)),
    Contender("harmonic 1", "harmonic", {"harmonic": 1}, (1405, 180, 0.30)),
    Contender("harmonic 3", "harmonic", {"harmonic": 3}),
    Contender("combined h1 c8", "combined", {"harmonic": 1, "spread": 8}, (2162, 305, 0.87)),
    Contender("combined h3 c5", "combined", {"harmonic": 3, "spread": 5}),
    *(_as_it_comes(method) for method in METHODS if method not in COMPARED_WITH_TUNING),
)
"""The paper's three rows with its tuning, then the others as they come."""


@dataclass(frozen=True)
class FullFootprints:
    """|Q_F| of (4.27): counted, or estimated with its standard error."""

    number: float
    standard_error: float
    counted: bool


@dataclass(frozen=True, eq=False)
class MethodRow:
    """One method as measured."""

    contender: Contender
    reach_set: ReachSet
    coverage: Coverage
    dispersion: Dispersion
    build_s: float
    spread: int
    """Most nodes of a cell that go on, r of (6.5)."""
    bound: int
    """(6.5) with that spread; nodes never exceed it."""

    def ratio(self, full: FullFootprints) -> tuple[float, float]:
        """Literal coverage ratio (4.27), def. 24, and its standard error."""
        ratio = self.coverage.footprints / full.number
        return ratio, ratio * full.standard_error / full.number


@dataclass(frozen=True, eq=False)
class Comparison:
    """All rows for one grid, level start and the automaton's pitch limit."""

    automaton: MovementAutomaton
    grid: AvoidanceGrid
    full: FullFootprints
    reachable: ReachableCells
    """Cells that any trajectory reaches, found apart from the sets compared."""
    rows: tuple[MethodRow, ...]


def compare_methods(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    contenders: tuple[Contender, ...] = TABLE_6_1,
    *,
    branches: int = 16,
    repetitions: int = 24,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Build every contender, measure it, and count or estimate the full set's footprints."""
    tell = progress or (lambda _sentence: None)
    sample = sample_reachable(automaton, grid, seed=seed)
    rows = []
    for contender in contenders:
        tell(f"building {contender.name}")
        rows.append(_row(automaton, grid, contender, sample))
    tell("following the full reach set to the cells that it reaches")
    reachable = reachable_cells(automaton, grid)
    full = full_footprints(automaton, grid, branches, repetitions, seed, tell)
    return Comparison(automaton, grid, full, reachable, tuple(rows))


def full_footprints(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    branches: int,
    repetitions: int,
    seed: int,
    tell: Callable[[str], None],
) -> FullFootprints:
    """Counted for up to 5e7 nodes, else estimated."""
    tree = FootprintTree(automaton, grid)
    if float(len(automaton.movements)) ** tree.deep <= MOST_COUNTED:
        tell("counting the footprints of the full reach set")
        return FullFootprints(float(count_full(tree).footprints), 0.0, True)
    tell("estimating the footprints of the full reach set")
    estimate = estimate_footprints(tree, branches, repetitions, seed)
    return FullFootprints(estimate.footprints, estimate.standard_error, False)


def compute_bound_6_5(movements: int, spread: int, grid: AvoidanceGrid) -> int:
    """Most nodes that a set with this spread can have, (6.5)."""
    return movements * (spread + 1) * grid.cells


def _row(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    contender: Contender,
    sample: ReachableSample,
) -> MethodRow:
    began = time.perf_counter()
    reach_set = build_reach_set(automaton, grid, method=contender.method, **contender.tuning)
    build_s = time.perf_counter() - began
    inner = np.unique(reach_set.parent[reach_set.parent >= 0])
    counts = np.bincount(reach_set.end_cell[inner], minlength=1)
    spread = int(counts.max(initial=1))
    return MethodRow(
        contender,
        reach_set,
        measure_coverage(reach_set),
        measure_dispersion(reach_set, sample),
        build_s,
        spread,
        compute_bound_6_5(len(automaton.movements), spread, grid),
    )


@dataclass(frozen=True)
class SpreadPoint:
    """One set of a method, by how many nodes of a cell go on."""

    spread: int
    coverage: Coverage


def over_spreads(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    spreads: tuple[int, ...] = (1, 2, 3, 4, 6, 9, 13),
) -> dict[str, tuple[SpreadPoint, ...]]:
    """Coverage of the methods that have a spread, over it."""
    names = {method: name for method in METHODS if (name := spread_of(method)) is not None}
    return {
        method: tuple(
            SpreadPoint(
                spread,
                measure_coverage(
                    build_reach_set(automaton, grid, method=method, **{name: float(spread)})
                ),
            )
            for spread in spreads
        )
        for method, name in names.items()
    }
