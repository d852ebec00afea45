"""Flights of a campaign beside what others published, and how hard the worlds were.

A row a cell, which is a family flown by a planner or a variant of one, then a row a planner for
all.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from clearway.studies.campaigns.difficulty import (
    Difficulty,
    measure_difficulty,
    median_difficulty,
)
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.file import Campaign, list_built_in_campaigns, read_campaign
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.totals import ALL, CellTotals, add_up, share_in_words

WORLDS = 8
"""Of a cell, at most: the first ones flown. Their medians are what it says of difficulty."""
BESIDE_HEAD = (
    "family", "planner", "flights", "arrived", "contact", "least, m", "time, s", "mean, m/s",
    "free path, m", "nearest, m", "occluded", "turns, rad/m", "published", "differs",
)  # fmt: skip
OPTIMAL_MPS = 2.0
"""Speed by which BARN counts the best time for a way."""
BARN = "barn"


def beside_cells(rows: Sequence[FlightRow], campaign: str) -> list[tuple[str, ...]]:
    """Return the lines of a table with BESIDE_HEAD.

    campaign: its name. What was published is known of campaigns that come with clearway.
    """
    known = read_campaign(campaign) if campaign in list_built_in_campaigns() else None
    words = {} if known is None else _words(known)
    folder = Path("." if known is None else known.folder)
    return [_cells(one, rows, words, folder) for one in add_up(rows)]


def _words(campaign: Campaign) -> Mapping[str, tuple[str, str]]:
    return {
        section.name: (section.published or "-", section.differs or "-")
        for section in campaign.file.family
    }


def _cells(
    totals: CellTotals,
    rows: Sequence[FlightRow],
    words: Mapping[str, tuple[str, str]],
    folder: Path,
) -> tuple[str, ...]:
    own = [row for row in rows if (row.label, row.planner) == (totals.label, totals.planner)]
    known = [_difficulty(row, folder) for row in own[:WORLDS]]
    plain = totals.as_cells()
    there = ("-", "-") if totals.label == ALL else words.get(totals.label, ("-", "-"))
    hard = median_difficulty(known)
    figures = [_plain(value, 2) for value in hard[:3]] + [_plain(hard.turn_rad_per_m, 3)]
    return (*plain[:5], plain[6], plain[7], plain[8], *figures, *there)


def _difficulty(row: FlightRow, folder: Path) -> Difficulty:
    case = make_case(
        row.family, row.seed, json.loads(row.parameters), json.loads(row.changes), folder
    )
    setup, corridor_m = case.setup, case.file.rules.route_m
    margin_m = setup.planner.settings.safety_margin_m
    return measure_difficulty(setup.world, setup.mission, margin_m, corridor_m, row.seed)


def barn_score(rows: Sequence[FlightRow]) -> str | None:
    """Return BARN's score over the flights of its family in a sentence; None without any.

    A flight that arrives untouched scores best time / time, the time taken as 2 to 8 best times;
    any other scores nothing.
    """
    own = [row for row in rows if row.family == BARN]
    if not own:
        return None
    scores = [_score(row) for row in own]
    arrived = share_in_words(sum(score > 0.0 for score in scores), len(own))
    return (
        f"BARN's score over {len(own)} flights: {np.mean(scores):.3f} of 0.5; arrived without "
        f"contact: {arrived}."
    )


def _score(row: FlightRow) -> float:
    if not row.reached or row.touched or not row.straight_m or row.time_s is None:
        return 0.0
    best_s = row.straight_m / OPTIMAL_MPS
    return float(best_s / np.clip(row.time_s, 2.0 * best_s, 8.0 * best_s))


def _plain(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"
