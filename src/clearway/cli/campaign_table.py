"""The table of a campaign on the terminal, and as the object that `--json` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from clearway.base.intervals import Interval
from clearway.cli.tables import plain_table, print_table
from clearway.io.json_values import finite
from clearway.sim.baselines import NOT_APPLICABLE
from clearway.studies.campaigns.pages import explain_planners
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.summary import (
    FamilyStanding,
    Rate,
    describe_flight,
    failures,
    seconds,
    standings,
)
from clearway.studies.campaigns.totals import HEAD, add_up

FAILURES_SHOWN = 20
# Columns of the totals that fit into a terminal's width; --json has all.
SHOWN = 8
AVOIDING = ("safe", "crashed", "lost_margin", "nearest_min_m", "nearest_median_m")
"""What is stated of avoiding: nothing of a planner that cannot know what there is to avoid."""


def summarize_campaign(
    rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]
) -> dict[str, Any]:
    """Planners by family, where the first is not first, and all failures."""
    table = standings(rows)
    return {
        "campaign": settings["campaign"],
        "version": settings["version"],
        "flights": len(rows),
        "skipped": skipped,
        "table": [_values(standing) for standing in table],
        "totals": [totals.as_values() for totals in add_up(rows)],
        "not_first": [each._asdict() for each in seconds(rows)],
        "failures": [
            {
                "key": row.key,
                "outcome": row.outcome,
                "what": describe_flight(row),
                "replay": row.replay,
            }
            for row in failures(rows)
        ],
    }


def _values(standing: FamilyStanding) -> dict[str, Any]:
    rates = ("safe", "reached", "crashed", "lost_margin")
    means = ("path_ratio", "time_s")
    plain = ("nearest_min_m", "nearest_median_m", "decision_ms")
    values = {
        "family": standing.label,
        "planner": standing.planner,
        "flights": standing.safe.flights,
        "not_flown": standing.not_flown,
        "hidden": standing.hidden,
        **{name: _rate_values(getattr(standing, name)) for name in rates},
        **{name: _mean_values(getattr(standing, name)) for name in means},
        **{name: finite(getattr(standing, name)) for name in plain},
    }
    return values | (dict.fromkeys(AVOIDING) if standing.hidden else {})


def _rate_values(rate: Rate) -> dict[str, Any]:
    return {"flights": rate.number, "wilson_95": list(rate.interval)}


def _mean_values(mean: Interval) -> dict[str, Any]:
    return {"mean": finite(mean.value), "bootstrap_95": [finite(mean.low), finite(mean.high)]}


def print_campaign(
    rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]
) -> None:
    """Families one after the other, then failures with the commands that show them."""
    if not rows:
        print("no flights yet")
        return
    title = f"{settings['campaign']}: {len(rows)} flights"
    columns = ("safe", "crashed", "margin lost", "nearest m", "path", "time s", "decision ms")
    table = plain_table(("family", "planner"), columns, title)
    before = ""
    everything = standings(rows)
    for number, standing in enumerate(everything):
        label = standing.label if standing.label != before else ""
        before = standing.label
        last = number + 1 == len(everything) or everything[number + 1].label != before
        table.add_row(label, *_cells(standing), end_section=last)
    print_table(table)
    print("safe: reached, never nearer than the margin; with 95 % Wilson intervals. path: as a")
    print("multiple of the straight one. path and time: means of flights that arrived. --json and")
    print("--docs have the other intervals")
    _print_totals(rows)
    for line in explain_planners(rows):
        print(line)
    for label, why in skipped.items():
        print(f"skipped {label}: {why}")
    _print_failures(rows)


def _print_totals(rows: Sequence[FlightRow]) -> None:
    """What the flights add up to, a line a cell."""
    table = plain_table(HEAD[:2], HEAD[2:SHOWN])
    for totals in add_up(rows):
        table.add_row(*(cell.replace(" (", "\n(") for cell in totals.as_cells()[:SHOWN]))
    print_table(table)
    print("contact: of the body; margin lost: contacts included; shares with exact 95 % intervals")
    print("(Clopper-Pearson). time: median of flights that arrived")


def _cells(standing: FamilyStanding) -> tuple[str, ...]:
    avoiding = (
        _rate(standing.safe),
        _count(standing.crashed),
        _count(standing.lost_margin),
        _number(standing.nearest_min_m),
    )
    return (
        standing.planner,
        *([NOT_APPLICABLE] * len(avoiding) if standing.hidden else avoiding),
        _number(standing.path_ratio.value),
        _number(standing.time_s.value, 1),
        _number(standing.decision_ms),
    )


def _rate(rate: Rate) -> str:
    low, high = (100.0 * share for share in rate.interval)
    return f"{rate.number}/{rate.flights} {f'{low:.0f}-{high:.0f} %':>8}"


def _count(rate: Rate) -> str:
    return f"{rate.number}/{rate.flights}"


def _number(value: float, digits: int = 2) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


def _print_failures(rows: Sequence[FlightRow]) -> None:
    """Those of the first planner first; the others are reported by number."""
    first = rows[0].planner
    failed = failures(rows)
    own = [row for row in failed if row.planner == first]
    for row in own[:FAILURES_SHOWN]:
        print(f"{row.key} {describe_flight(row)}; see it with {row.replay}")
    if len(own) > FAILURES_SHOWN:
        print(f"{len(own) - FAILURES_SHOWN} more of {first}")
    others = [row for row in failed if row.planner != first]
    if others:
        flights = "flight" if len(others) == 1 else "flights"
        print(
            f"{len(others)} {flights} of other planners failed; see one with {others[0].replay}, "
            "all with --json"
        )
