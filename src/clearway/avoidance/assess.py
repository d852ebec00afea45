"""One moment assessed: what is known of it, and what that means for cells and trajectories.

All of what looks at a scene, and the first half of every decision: an ordinary one is rated by the
same loops within `cycle.decided`, and its cells are put together here when somebody asks for them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from clearway.avoidance.cycle import assessed
from clearway.avoidance.evidence import (
    CountedAs,
    InReach,
    Sources,
    Terms,
    coated_cells,
    in_reach,
    intruder_cells,
    sources_of,
)
from clearway.avoidance.fusion import CellAssessment, assess_cells, total
from clearway.avoidance.reach_rating import PassedCells, ReachAssessment, rate_reach_set, untouched
from clearway.avoidance.situation import Situation
from clearway.base.brief import brief
from clearway.base.by_leaf import by_leaf
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.reach.tree import ReachSet
from clearway.traffic import IntruderCells

_assessed = by_leaf(assessed)


@dataclass(frozen=True, eq=False)
class KnownCells:
    """What all sources together mean for the cells, put together when somebody asks."""

    terms: Terms = field(repr=False)
    near: InReach
    sources: Sources

    __repr__ = brief

    @cached_property
    def assessed(self) -> CellAssessment:
        """(4.17), (5.54), step by step."""
        terms, settings = self.terms, self.terms.settings
        coated = coated_cells(terms, self.near, self.sources)
        evidence = self.sources.evidence(terms.grid, coated)
        return assess_cells(evidence, terms.cell_rating, settings.unknown, settings.unknown_unseen)

    def rating(self) -> FloatArray:
        """[cells] how safe a passage is."""
        return self.assessed.rating


@dataclass(frozen=True, slots=True, eq=False)
class Assessment:
    """What a situation means, cell by cell and trajectory by trajectory."""

    near: InReach
    """In the grid frame."""
    intruders: tuple[IntruderCells, ...]
    """All of them together, or each on its own where it is told how it counts."""
    known: KnownCells
    reach: ReachAssessment
    untouched: BoolArray
    """[nodes] paths that pass no coated cell (def. 6)."""

    __repr__ = brief

    @property
    def cells(self) -> CellAssessment:
        return self.known.assessed


def assess_situation(
    terms: Terms,
    situation: Situation,
    reach_set: ReachSet,
    counted: Sequence[CountedAs] | None = None,
    *,
    reach_m: float = 0.0,
    horizon_s: float = 0.0,
) -> Assessment:
    """Fuse and rate one moment: (5.37)-(5.54), (4.17)-(4.23).

    counted: how each intruder of the situation is counted; None for all as the settings say.
    reach_m, horizon_s: how far trajectories lead, where that is beyond the grid.
    """
    near = in_reach(terms, situation, reach_m, horizon_s)
    intruders = intruder_cells(terms, near, counted)  # (5.36)
    return assess_near(terms, situation, near, intruders, reach_set)


def assess_near(
    terms: Terms,
    situation: Situation,
    near: InReach,
    intruders: tuple[IntruderCells, ...],
    reach_set: ReachSet,
) -> Assessment:
    """The same of what has been found to be near."""
    sources = sources_of(terms, situation, near, intruders)  # (5.38), (5.47), (5.53), (5.37)
    known = KnownCells(terms, near, sources)
    if terms.cell_rating is total:
        return _in_one(known, intruders, reach_set)
    cells = known.assessed  # (4.17), (5.54)
    reach = rate_reach_set(reach_set, cells.rating, terms.settings.threshold)  # (4.22), (4.23)
    clear = untouched(reach_set, cells.evidence.coated)
    return Assessment(near, intruders, known, reach, clear)


def _in_one(
    known: KnownCells, intruders: tuple[IntruderCells, ...], reach_set: ReachSet
) -> Assessment:
    """In one compiled call."""
    near, settings = known.near, known.terms.settings
    found = _assessed(
        known.sources,
        near.hazards.points,
        near.margin_m,
        known.terms.grid.edges,
        float(settings.unknown),
        float(settings.unknown_unseen),
        PassedCells.of(reach_set),
    )  # (4.21), (4.22)
    reach = ReachAssessment(
        found.node_rating, found.feasibility, reach_set, known.rating, float(settings.threshold)
    )  # (4.23)
    return Assessment(near, intruders, known, reach, found.untouched)
