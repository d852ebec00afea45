"""What flights of a campaign add up to: contacts, lost margins, arrivals, speeds.

A row a cell of the campaign, which is a family flown by a planner or a variant of one, and a row a
planner for all of its cells together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clearway.base.intervals import exact_share
from clearway.studies.campaigns.row import FlightRow

ALL = "all"
"""Label of the sums over families."""
HEAD = (
    "family", "planner", "flights", "arrived", "contact", "margin lost", "least, m", "time, s",
    "mean, m/s", "top, m/s", "decision p50, p99, ms",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class CellTotals:
    """Flights of one cell. Medians are over flights that arrived; NaN without any."""

    label: str
    planner: str
    flights: int
    arrived: int
    contacts: int
    """The body touched something."""
    margins_lost: int
    """Contacts included."""
    not_flown: int
    """Refused or failed."""
    least_m: float
    """Least distance of all from the vehicle's centre to a surface."""
    time_s: float
    mean_mps: float
    top_mps: float
    """Of all flights, the fastest."""
    decision_ms_p50: float
    """Median over flights."""
    decision_ms_p99: float

    def as_values(self) -> dict[str, Any]:
        """Plain values for JSON, with exact 95 % intervals of the shares; None for NaN."""
        counts = {name: getattr(self, name) for name in ("arrived", "contacts", "margins_lost")}
        plain = ("least_m", "time_s", "mean_mps", "top_mps", "decision_ms_p50", "decision_ms_p99")
        return {
            "family": self.label,
            "planner": self.planner,
            "flights": self.flights,
            "not_flown": self.not_flown,
            **counts,
            **{f"{name}_exact_95": exact_share(n, self.flights) for name, n in counts.items()},
            **{
                name: getattr(self, name) if np.isfinite(getattr(self, name)) else None
                for name in plain
            },
        }

    def as_cells(self) -> tuple[str, ...]:
        """Cells of a table, in the order of HEAD."""
        return (
            self.label,
            self.planner,
            str(self.flights),
            share_in_words(self.arrived, self.flights),
            share_in_words(self.contacts, self.flights),
            share_in_words(self.margins_lost, self.flights),
            _plain(self.least_m, 2),
            _plain(self.time_s, 1),
            _plain(self.mean_mps, 1),
            _plain(self.top_mps, 1),
            f"{_plain(self.decision_ms_p50, 2)}, {_plain(self.decision_ms_p99, 2)}",
        )


def add_up(rows: Sequence[FlightRow]) -> list[CellTotals]:
    """Return the totals of each cell in the order of the rows, then of each planner over all.

    Planners that cannot know what there is to avoid are left out, as are sums of a single family.
    """
    cells: dict[tuple[str, str], list[FlightRow]] = {}
    everything: dict[tuple[str, str], list[FlightRow]] = {}
    for row in rows:
        if not row.hidden:
            cells.setdefault((row.label, row.planner), []).append(row)
            everything.setdefault((ALL, row.planner), []).append(row)
    several = len({label for label, _ in cells}) > 1
    groups = {**cells, **(everything if several else {})}
    return [_totals(label, planner, group) for (label, planner), group in groups.items()]


def _totals(label: str, planner: str, rows: Sequence[FlightRow]) -> CellTotals:
    arrived = [row for row in rows if row.reached]
    return CellTotals(
        label=label,
        planner=planner,
        flights=len(rows),
        arrived=len(arrived),
        contacts=sum(row.touched for row in rows),
        margins_lost=sum(row.lost_margin for row in rows),
        not_flown=sum(row.outcome in ("refused", "failed") for row in rows),
        least_m=min((row.nearest_m for row in rows if row.nearest_m is not None), default=np.nan),
        time_s=_median([row.time_s for row in arrived]),
        mean_mps=_median([row.mean_mps for row in arrived]),
        top_mps=max((row.top_mps for row in rows if row.top_mps is not None), default=np.nan),
        decision_ms_p50=_median([row.decision_ms_p50 for row in rows]),
        decision_ms_p99=_median([row.decision_ms_p99 for row in rows]),
    )


def _median(values: Sequence[float | None]) -> float:
    there = [value for value in values if value is not None]
    return float(np.median(there)) if there else float("nan")


def share_in_words(number: int, flights: int) -> str:
    """Return a count with the exact 95 % interval of its share."""
    low, high = exact_share(number, flights)
    return f"{number} ({100.0 * low:.1f}-{100.0 * high:.1f} %)"


def _plain(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"
