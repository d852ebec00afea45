"""How direct the flights of a campaign were: arrivals by little more than the straight way.

A row a cell of the campaign, which is a family flown by a planner or a variant of one, then a row a
planner for all of its cells together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.totals import ALL, share_in_words

LONGEST = 1.5
"""Times the straight way through the waypoints: what is no longer counts as direct. The shortest
way past obstacles is longer than the straight one, so this asks for more than 1.5 times that."""
DIRECT_HEAD = (
    "family", "planner", "flights", "arrived", "direct", "contact", "margin lost", "path",
)  # fmt: skip


def is_direct(row: FlightRow) -> bool:
    """Whether a flight arrived by a direct way."""
    path_m, straight_m = row.path_m, row.straight_m
    if not row.reached or path_m is None or straight_m is None:
        return False
    return path_m <= LONGEST * straight_m


def direct_cells(rows: Sequence[FlightRow]) -> list[tuple[str, ...]]:
    """Return the lines of a table with DIRECT_HEAD.

    Counts have exact 95 % intervals; the path is the median of path by straight way over flights
    that arrived.
    """
    groups: dict[tuple[str, str], list[FlightRow]] = {}
    told = [row for row in rows if not row.hidden]
    for row in told:
        groups.setdefault((row.label, row.planner), []).append(row)
    for row in told:
        groups.setdefault((ALL, row.planner), []).append(row)
    return [
        (
            label,
            planner,
            str(len(group)),
            share_in_words(sum(row.reached for row in group), len(group)),
            share_in_words(sum(map(is_direct, group)), len(group)),
            share_in_words(sum(row.touched for row in group), len(group)),
            share_in_words(sum(row.lost_margin for row in group), len(group)),
            _median_path(group),
        )
        for (label, planner), group in groups.items()
    ]


def _median_path(group: Sequence[FlightRow]) -> str:
    paths = [
        row.path_m / row.straight_m
        for row in group
        if row.reached and row.path_m is not None and row.straight_m
    ]
    return f"{np.median(paths):.2f}" if paths else "-"
