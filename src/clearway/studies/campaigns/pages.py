"""The tables of a campaign as Markdown, put between marks of a page."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError, naming
from clearway.base.intervals import Interval
from clearway.io.staging import stage_file
from clearway.sim.baselines import NOT_APPLICABLE, PLANNERS
from clearway.sim.baselines.notes import list_shared_notes, not_known
from clearway.studies.campaigns.beside import BESIDE_HEAD, barn_score, beside_cells
from clearway.studies.campaigns.direct import DIRECT_HEAD, direct_cells
from clearway.studies.campaigns.families import CAMPAIGN_FAMILIES
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.summary import (
    FamilyStanding,
    Rate,
    describe_flight,
    seconds,
    standings,
)
from clearway.studies.campaigns.totals import HEAD, add_up

FULL = "campaign"
SHORT = "campaign-short"
TOTALS = "campaign-totals"
DIRECT = "campaign-direct"
BESIDE = "campaign-beside"
"""Marks are `<!-- campaign:begin -->` and `<!-- campaign:end -->`."""
COLUMNS = (
    "planner",
    "reached with margin",
    "crashed",
    "margin lost",
    "nearest, m",
    "path",
    "time, s",
    "decision, ms",
)


def write_pages(
    page: Path, rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]
) -> list[str]:
    """Put the full form, the short form or the totals between their marks in a page; what was put.

    Raises InputError where the page cannot be read or written, or has no marks.
    """
    with naming(page, "written"):
        text = page.read_text(encoding="utf-8")
        done = []
        for name, made in FORMS.items():
            begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
            if begin in text and end in text:
                before, _, rest = text.partition(begin)
                after = rest.partition(end)[2]
                text = f"{before}{begin}\n{made(rows, settings, skipped)}{end}{after}"
                done.append(name)
        if not done:
            marks = " or ".join(f"<!-- {name}:begin --> ... :end -->" for name in FORMS)
            raise InputError(str(page), f"no {marks}")
    with stage_file(page) as scratch:
        scratch.write_text(text, encoding="utf-8")
    return done


def short_form(rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]) -> str:
    """Families by planners: flights that reached with margin, and crashes."""
    table = standings(rows)
    planners = list(dict.fromkeys(standing.planner for standing in table))
    cells = {(standing.label, standing.planner): standing for standing in table}
    lines = [("family", "flights", *planners)]
    for label in dict.fromkeys(standing.label for standing in table):
        there = [cells.get((label, planner)) for planner in planners]
        flights = max(each.safe.flights for each in there if each is not None)
        lines.append((label, str(flights), *(_short(each, flights) for each in there)))
    said = explain_planners(rows)
    notes = f"\n{_list(said)}" if said else ""
    return f"{_markdown(lines)}{notes}{_below(rows, settings, skipped)}"


def explain_planners(rows: Sequence[FlightRow]) -> list[str]:
    """What tables of a campaign say of their planners: why some have n/a, what they share with
    clearway, and with what settings variants flew."""
    hidden = not_known((row.planner, row.hidden) for row in rows)
    return [
        *hidden,
        *list_shared_notes(list(dict.fromkeys(row.planner for row in rows))),
        *_list_varied(rows),
    ]


def _list_varied(rows: Sequence[FlightRow]) -> list[str]:
    """Columns that are no planners', each with what its missions had changed beside others'."""
    plain = {row.label: _settings(row) for row in rows if row.planner in PLANNERS}
    varied: dict[str, dict[str, None]] = {}
    for row in rows:
        if row.planner not in PLANNERS and row.label in plain:
            own = _settings(row).items() - plain[row.label].items()
            varied.setdefault(row.planner, {}).update(dict.fromkeys(sorted(map(" = ".join, own))))
    return [f"{name}: with {', '.join(own)}" for name, own in varied.items() if own]


def _settings(row: FlightRow) -> dict[str, str]:
    """What a flight's mission had changed: values as JSON, by table and key."""
    return {
        f"{table}.{key}": json.dumps(value)
        for table, values in json.loads(row.changes).items()
        for key, value in values.items()
    }


def _short(standing: FamilyStanding | None, flights: int) -> str:
    """Reached with margin and crashed; of how many, where that are not as many as in the row."""
    if standing is None:
        return ""
    if standing.hidden:
        return NOT_APPLICABLE
    fewer = standing.safe.flights
    of = "" if fewer == flights else f" of {fewer}"
    return f"{standing.safe.number} / {standing.crashed.number}{of}"


def full_form(rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]) -> str:
    """A table for each family, then where the first planner is not first, and its failures."""
    table = standings(rows)
    parts = []
    for label in dict.fromkeys(standing.label for standing in table):
        own = [standing for standing in table if standing.label == label]
        parts.append(f"### {label}\n\n{CAMPAIGN_FAMILIES[own[0].family].about}\n")
        parts.append(_markdown([COLUMNS, *(_full(standing) for standing in own)]))
    said = explain_planners(rows)
    if said:
        parts.append(f"### What planners share, and what some cannot know\n\n{_list(said)}")
    first = rows[0].planner
    parts.append(f"### Where {first} is not first\n\n{_list(_behind(rows))}")
    lost = [row for row in rows if row.planner == first and not row.safe]
    told = [f"`{row.replay}`: {describe_flight(row)}" for row in lost]
    parts.append(f"### Flights of {first} that failed\n\n{_list(told)}")
    return "\n".join(parts) + "\n" + _below(rows, settings, skipped).lstrip("\n")


def _behind(rows: Sequence[FlightRow]) -> list[str]:
    return [
        f"{each.label}, {each.measure}: {each.own} of {each.flights}; "
        + ", ".join(f"{planner} {count}" for planner, count in each.others.items())
        for each in seconds(rows)
    ]


def _list(lines: Sequence[str]) -> str:
    return "".join(f"- {line}\n" for line in lines) or "None.\n"


def _full(standing: FamilyStanding) -> tuple[str, ...]:
    nearest = f"{_number(standing.nearest_min_m, 2)}, {_number(standing.nearest_median_m, 2)}"
    avoiding = (_rate(standing.safe), _rate(standing.crashed), _rate(standing.lost_margin), nearest)
    return (
        standing.planner,
        *([NOT_APPLICABLE] * len(avoiding) if standing.hidden else avoiding),
        mean_in_words(standing.path_ratio, 2),
        mean_in_words(standing.time_s, 1),
        _number(standing.decision_ms, 2),
    )


def _rate(rate: Rate) -> str:
    low, high = (100.0 * share for share in rate.interval)
    return f"{rate.number} of {rate.flights} ({low:.0f}-{high:.0f} %)"


def mean_in_words(mean: Interval, digits: int) -> str:
    """A mean with its interval, which one value alone does not have."""
    if not np.isfinite(mean.value):
        return "-"
    if not np.isfinite(mean.low):
        return f"{mean.value:.{digits}f} (one)"
    return f"{mean.value:.{digits}f} ({mean.low:.{digits}f}-{mean.high:.{digits}f})"


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


def _below(rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]) -> str:
    """What was flown, and what not."""
    said = (
        f"\n{len(rows)} flights of the campaign `{settings['campaign']}`, clearway "
        f"{settings['version']}."
    )
    for label, why in skipped.items():
        said += f" Skipped: {label} ({why})."
    return said + "\n"


def totals_form(
    rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]
) -> str:
    """A line a family and planner, then a line a planner: contacts, margins lost, arrivals."""
    lines = [HEAD, *(totals.as_cells() for totals in add_up(rows))]
    return _markdown(lines) + _below(rows, settings, skipped)


def direct_form(
    rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]
) -> str:
    """As `totals_form`, with the flights that arrived by a direct way in place of speeds."""
    lines = [DIRECT_HEAD, *direct_cells(rows)]
    return _markdown(lines) + _below(rows, settings, skipped)


def beside_form(
    rows: Sequence[FlightRow], settings: dict[str, str], skipped: dict[str, str]
) -> str:
    """As `totals_form`, with how hard the worlds are and what others published."""
    lines = [BESIDE_HEAD, *beside_cells(rows, settings["campaign"])]
    score = barn_score(rows)
    said = "" if score is None else f"\n{score}\n"
    return _markdown(lines) + said + _below(rows, settings, skipped)


FORMS: Mapping[str, Callable[[Sequence[FlightRow], dict[str, str], dict[str, str]], str]] = {
    FULL: full_form,
    SHORT: short_form,
    TOTALS: totals_form,
    DIRECT: direct_form,
    BESIDE: beside_form,
}
"""What can be put into a page, by the name of its marks."""


def _markdown(lines: Sequence[Sequence[str]]) -> str:
    head, *rest = lines
    rows = [head, ["---"] * len(head), *rest]
    return "".join("| " + " | ".join(line) + " |\n" for line in rows)
