"""One flight looked at: what every rating said at its decisions, checked against what was there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from clearway.avoidance import Decision
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.rate.calibration import CLASSES, classes_of
from clearway.avoidance.rate.fusion import RATINGS, assess_cells
from clearway.avoidance.rate.reach_rating import rate_reach_set
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.obstacles.world import World
from clearway.sim import Run
from clearway.studies.reliability.bins import BINS, count_moments
from clearway.studies.reliability.passages import KnownPassages
from clearway.studies.reliability.truth import (
    TruePassage,
    distances_m,
    find_obstructed_cells,
    true_passages,
)

CELLS = "cells"
PASSAGES = "passages"
TRAJECTORIES = "trajectories"
CHOSEN = "chosen"
KINDS = (CELLS, PASSAGES, TRAJECTORIES, CHOSEN)
"""Cells that some trajectory passes; passages of trajectories through cells; complete trajectories;
the one that was taken."""
FITTED = "total"
"""The rating that the calibrated one is a function of."""


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """Counts of one flight."""

    decisions: int
    counts: Mapping[tuple[str, str], FloatArray]
    """[BINS, 5] by kind and rating; by class of cell too, of passages by the fitted rating."""


@dataclass(slots=True)
class _Sums:
    counts: dict[tuple[str, str], FloatArray] = field(default_factory=dict)

    def add(self, key: tuple[str, str], rating: FloatArray, good: BoolArray) -> None:
        more = count_moments(rating, good)
        self.counts[key] = self.counts.get(key, np.zeros((BINS, 5))) + more


def look_at_flight(
    run: Run[Any], settings: AvoidanceSettings, horizon_s: float, every: int = 1
) -> Looked:
    """Decisions of a flight of clearway's, the first of `every`.

    horizon_s: how long the way through the grid takes.

    A cell is good where nothing solid stands in it and no intruder comes through; a passage and a
    trajectory where they keep the safety margin, a passage if all before it did.
    """
    assert run.world is not None
    around, sums, known = true_passages(run), _Sums(), KnownPassages()
    decisions = [entry.flight.decision for entry in run.decisions[::every]]
    for decision in decisions:
        _look(decision, run.world, around, settings, horizon_s, known, sums)
    return Looked(len(decisions), sums.counts)


def _look(
    decision: Decision,
    world: World,
    around: tuple[TruePassage, ...],
    settings: AvoidanceSettings,
    horizon_s: float,
    known: KnownPassages,
    sums: _Sums,
) -> None:
    evidence, reach_set = decision.cells.evidence, decision.prepared.reach_set
    passed, passages = decision.reach.passed, known.of(reach_set)
    free = ~find_obstructed_cells(decision, world, around, horizon_s)[passed]
    clear = distances_m(decision, world, around) >= settings.safety_margin_m
    entered, good, kept = passages.judge_flown(clear)
    through, good = passages.cell[entered], good[entered]
    ends = reach_set.trajectories
    taken = ends == decision.choice.node
    classes = classes_of(evidence.coated, evidence.visibility, evidence.intruder)[through]
    for name, rating in RATINGS.items():
        rated = assess_cells(evidence, rating, settings.unknown, settings.unknown_unseen).rating
        sums.add((CELLS, name), rated[passed], free)
        sums.add((PASSAGES, name), rated[through], good)
        reaches = rate_reach_set(reach_set, rated, settings.threshold).node_rating[ends]
        sums.add((TRAJECTORIES, name), reaches, kept)
        sums.add((CHOSEN, name), reaches[taken], kept[taken])
        if name == FITTED:
            for number, label in enumerate(CLASSES):
                of = classes == number
                sums.add((label, name), rated[through][of], good[of])
