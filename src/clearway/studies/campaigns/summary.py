"""What a campaign comes to: planners by family, with intervals, failures and who was first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.base.intervals import Interval, bootstrap_mean, wilson
from clearway.studies.campaigns.row import FlightRow

NAN = float("nan")


class Rate(NamedTuple):
    """Flights of which something holds."""

    number: int
    flights: int

    @property
    def interval(self) -> tuple[float, float]:
        """95 % Wilson interval of the share."""
        return wilson(self.number, self.flights)


@dataclass(frozen=True, slots=True)
class FamilyStanding:
    """What one planner did in one family."""

    label: str
    family: str
    planner: str
    hidden: str
    """What of some flight it cannot know, in words: rates and distances say nothing of it then."""
    safe: Rate
    """Reached, and never nearer than the margin."""
    reached: Rate
    crashed: Rate
    lost_margin: Rate
    """Nearer than the margin at some time, crashes included."""
    not_flown: int
    """Refused or failed."""
    nearest_min_m: float
    """To any surface; NaN where there is none."""
    nearest_median_m: float
    path_ratio: Interval
    """Path by straight length, of flights that reached the last waypoint."""
    time_s: Interval
    """Of the same."""
    decision_ms: float
    """Median over flights of their median."""


Better = Callable[[Sequence[FlightRow]], int]
SAFETY: dict[str, Better] = {
    "reached with margin": lambda rows: sum(row.safe for row in rows),
    "crashes": lambda rows: -sum(row.crashed for row in rows),
    "margin losses": lambda rows: -sum(row.lost_margin for row in rows),
}
"""By what a planner is first on safety in the same cases: larger is better."""


class Second(NamedTuple):
    """A family in which the first planner is not first by some measure."""

    label: str
    measure: str
    own: int
    others: dict[str, int]
    """Planners that did better."""
    flights: int


def standings(rows: Sequence[FlightRow]) -> list[FamilyStanding]:
    """One for each family and planner, in the order of the rows."""
    groups: dict[tuple[str, str], list[FlightRow]] = {}
    for row in rows:
        groups.setdefault((row.label, row.planner), []).append(row)
    return [_standing(group) for group in groups.values()]


def _standing(rows: Sequence[FlightRow]) -> FamilyStanding:
    flights = len(rows)
    nearest = [row.nearest_m for row in rows if row.nearest_m is not None]
    arrived = [row for row in rows if row.reached]
    decisions = [row.decision_ms_p50 for row in rows if row.decision_ms_p50 is not None]
    return FamilyStanding(
        label=rows[0].label,
        family=rows[0].family,
        planner=rows[0].planner,
        hidden=next((row.hidden for row in rows if row.hidden), ""),
        safe=Rate(sum(row.safe for row in rows), flights),
        reached=Rate(len(arrived), flights),
        crashed=Rate(sum(row.crashed for row in rows), flights),
        lost_margin=Rate(sum(row.lost_margin for row in rows), flights),
        not_flown=sum(row.outcome in ("refused", "failed") for row in rows),
        nearest_min_m=min(nearest, default=NAN),
        nearest_median_m=float(np.median(nearest)) if nearest else NAN,
        path_ratio=_mean([(row.path_m or 0.0) / (row.straight_m or NAN) for row in arrived]),
        time_s=_mean([row.time_s or 0.0 for row in arrived]),
        decision_ms=float(np.median(decisions)) if decisions else NAN,
    )


def _mean(values: Sequence[float]) -> Interval:
    return Interval(float(np.mean(values)) if values else NAN, *bootstrap_mean(values))


def seconds(rows: Sequence[FlightRow]) -> list[Second]:
    """Where the first planner of a family is beaten on safety, and by whom: in the cases that both
    flew, which may be fewer than the family has."""
    families: dict[str, dict[str, dict[int, FlightRow]]] = {}
    for row in rows:
        families.setdefault(row.label, {}).setdefault(row.planner, {})[row.seed] = row
    found = []
    for label, planners in families.items():
        (_, first), *others = planners.items()
        alike: dict[tuple[int, ...], list[str]] = {}
        for planner, flown in others:
            seeds = tuple(sorted(first.keys() & flown.keys()))
            if seeds and not any(row.hidden for row in (*first.values(), *flown.values())):
                alike.setdefault(seeds, []).append(planner)
        for measure, better in SAFETY.items():
            for seeds, names in alike.items():
                own = better([first[seed] for seed in seeds])
                told = {name: better([planners[name][seed] for seed in seeds]) for name in names}
                ahead = {name: abs(other) for name, other in told.items() if other > own}
                if ahead:
                    found.append(Second(label, measure, abs(own), ahead, len(seeds)))
    return found


def failures(rows: Sequence[FlightRow]) -> list[FlightRow]:
    """Flights that were not safe, of planners that could know what there was to avoid."""
    return [row for row in rows if not row.safe and not row.hidden]


def describe_flight(row: FlightRow) -> str:
    """What happened in a flight, in half a line."""
    match row.outcome:
        case "crashed":
            return f"crashed at {row.crashed_s:.1f} s"
        case "margin lost":
            arrived = "" if row.reached else ", not reached"
            return f"came within {row.nearest_m:.2f} m of {row.margin_m:g} m{arrived}"
        case "not reached":
            return f"not reached in {row.time_s:.0f} s"
        case "safe":
            return f"reached in {row.time_s:.0f} s, nearest {metres(row.nearest_m)}"
        case _:
            return f"{row.outcome}: {row.why}"


def metres(value: float | None) -> str:
    """A distance for tables."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.2f} m"
