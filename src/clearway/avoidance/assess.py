"""One moment assessed: what is known of it, and what that means for cells and trajectories.

The first half of every decision, and all of what looks at a scene: there is no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from clearway.avoidance.cycle import PassedCells, assessed
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
from clearway.avoidance.fusion import (
    CellAssessment,
    ReachAssessment,
    assess_cells,
    rate_reach_set,
    total,
    untouched,
)
from clearway.avoidance.situation import Situation
from clearway.base.state import BoolArray
from clearway.reach.tree import ReachSet
from clearway.traffic import IntruderCells


@dataclass(frozen=True, slots=True, eq=False)
class Assessment:
    """What a situation means, cell by cell and trajectory by trajectory."""

    near: InReach
    """In the grid frame."""
    intruders: tuple[IntruderCells, ...]
    """All of them together, or each on its own where it is told how it counts."""
    cells: CellAssessment
    reach: ReachAssessment
    untouched: BoolArray
    """[nodes] paths that pass no coated cell (def. 6)."""


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
    sources = sources_of(terms, situation, near, intruders)  # (5.38), (5.47), (5.53), (5.37)
    assess = _assess if terms.cell_rating is total else _assess_by_own_rating
    return assess(terms, near, intruders, sources, reach_set)


def _assess(
    terms: Terms,
    near: InReach,
    intruders: tuple[IntruderCells, ...],
    sources: Sources,
    reach_set: ReachSet,
) -> Assessment:
    """In one compiled call."""
    settings = terms.settings
    found = assessed(
        sources,
        near.hazards.points,
        near.margin_m,
        terms.grid.edges,
        float(settings.unknown),
        float(settings.unknown_unseen),
        PassedCells(
            reach_set.parent, reach_set.cell_start, reach_set.cell_index, reach_set.exit_kind
        ),
    )  # (4.17), (5.54), (4.21), (4.22)
    evidence = sources.evidence(terms.grid, found.coated)
    cells = CellAssessment(evidence, found.map, found.obstacle, found.rating)
    reach = ReachAssessment(
        found.node_rating,
        found.feasibility,
        reach_set,
        found.rating,
        float(settings.threshold),
    )  # (4.23)
    return Assessment(near, intruders, cells, reach, found.untouched)


def _assess_by_own_rating(
    terms: Terms,
    near: InReach,
    intruders: tuple[IntruderCells, ...],
    sources: Sources,
    reach_set: ReachSet,
) -> Assessment:
    """Step by step, since one of them is in Python."""
    settings = terms.settings
    evidence = sources.evidence(terms.grid, coated_cells(terms, near, sources))
    cells = assess_cells(
        evidence, terms.cell_rating, settings.unknown, settings.unknown_unseen
    )  # (4.17), (5.54)
    reach = rate_reach_set(reach_set, cells.rating, settings.threshold)  # (4.22), (4.23)
    return Assessment(near, intruders, cells, reach, untouched(reach_set, evidence.coated))
