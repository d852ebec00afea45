"""One moment assessed: what is known of it, and what that means for cells and trajectories.

The first half of every decision, and all of what looks at a scene: there is no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from clearway.avoidance.evidence import (
    CountedAs,
    InReach,
    Terms,
    gather_evidence,
    in_reach,
    intruder_cells,
)
from clearway.avoidance.fusion import (
    CellAssessment,
    ReachAssessment,
    assess_cells,
    rate_reach_set,
)
from clearway.avoidance.situation import Situation
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
    settings = terms.settings
    near = in_reach(terms, situation, reach_m, horizon_s)
    intruders = intruder_cells(terms, near, counted)  # (5.36)
    evidence = gather_evidence(terms, situation, near, intruders)  # (5.38), (5.47), (5.53), (5.37)
    cells = assess_cells(
        evidence, terms.cell_rating, settings.unknown, settings.unknown_unseen
    )  # (4.17), (5.54)
    reach = rate_reach_set(reach_set, cells.rating, settings.threshold)  # (4.22), (4.23)
    return Assessment(near, intruders, cells, reach)
