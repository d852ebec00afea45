"""The tables of all filters: counts with Wilson intervals, and where rivals are better."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.filters.flight import FlightRow
from benchmarks.filters.methods import GUARDIAN, METHODS, NONE
from benchmarks.filters.pilots import HEADS_FOR_GOAL, PILOTS
from clearway.base.errors import InputError, naming
from clearway.base.intervals import wilson
from clearway.io.staging import stage_file

HEAD = (
    "flights", "contacts", "margins lost", "missions completed", "changed commands",
    "mean change, m/s", "call, median, ms", "call, 99 %, ms",
)  # fmt: skip
MARKS = "filters", "filters-pilots", "filters-better"


@dataclass(frozen=True)
class Standing:
    """What came of some flights of one method."""

    method: str
    rows: Sequence[FlightRow]

    @property
    def contacts(self) -> int:
        """Flights that ended in an obstacle."""
        return sum(row.contact for row in self.rows)

    @property
    def lost(self) -> int:
        """Flights that came nearer than the margin, contacts too."""
        return sum(row.margin_lost for row in self.rows)

    @property
    def missions(self) -> int:
        """Flights of pilots that head for a goal."""
        return sum(row.pilot in HEADS_FOR_GOAL for row in self.rows)

    @property
    def completed(self) -> int:
        """Of these, those that arrived."""
        return sum(row.arrived for row in self.rows if row.pilot in HEADS_FOR_GOAL)

    @property
    def changed(self) -> float:
        """Share of commands that did not pass."""
        return sum(row.changed for row in self.rows) / max(1, sum(r.commands for r in self.rows))

    @property
    def change_mps(self) -> float:
        """Mean over changed commands; 0 without one."""
        return sum(row.change_mps for row in self.rows) / max(1, sum(r.changed for r in self.rows))

    def call_ms(self, percent: float) -> float:
        """Percentile of the CPU of a call."""
        return float(np.percentile(np.concatenate([row.call_ms for row in self.rows]), percent))

    def cells(self) -> tuple[str, ...]:
        """Return the cells below HEAD."""
        flights, missions = len(self.rows), self.missions
        return (
            str(flights),
            count_of(self.contacts, flights),
            count_of(self.lost, flights),
            count_of(self.completed, missions) if missions else "-",
            f"{100.0 * self.changed:.1f} %",
            f"{self.change_mps:.2f}",
            f"{self.call_ms(50.0):.2f}",
            f"{self.call_ms(99.0):.1f}",
        )


def count_of(count: int, flights: int) -> str:
    """Return a count with its Wilson interval, in percent."""
    low, high = wilson(count, flights)
    return f"{count} ({100.0 * low:.1f}-{100.0 * high:.1f} %)"


def flown_by_all(rows: Iterable[FlightRow]) -> list[FlightRow]:
    """Return the rows of those cases that every method among them has flown."""
    rows = list(rows)
    methods = {row.method for row in rows}
    cases: dict[tuple[str, int, str], set[str]] = {}
    for row in rows:
        cases.setdefault(row.key[:3], set()).add(row.method)
    return [row for row in rows if cases[row.key[:3]] == methods]


def standings(rows: Sequence[FlightRow], pilot: str | None = None) -> list[Standing]:
    """Return one for each method, in the order of all methods; of one pilot or of all."""
    own = [row for row in rows if pilot is None or row.pilot == pilot]
    grouped = ((name, [row for row in own if row.method == name]) for name in METHODS)
    return [Standing(name, group) for name, group in grouped if group]


def method_table(rows: Sequence[FlightRow]) -> str:
    """Return a line a method, pilots pooled."""
    lines: list[Sequence[str]] = [("method", "knows", *HEAD)]
    for one in standings(rows):
        lines.append((one.method, METHODS[one.method].knows, *one.cells()))
    return as_table(lines)


def pilot_table(rows: Sequence[FlightRow]) -> str:
    """Return a line a pilot and method."""
    lines: list[Sequence[str]] = [("pilot", "method", *HEAD)]
    for pilot in PILOTS:
        lines += [(pilot, one.method, *one.cells()) for one in standings(rows, pilot)]
    return as_table(lines)


Figure = tuple[str, Callable[[Standing], float], int]
"""Its name, what it is, and whether less (1) or more (-1) is better."""
FIGURES: tuple[Figure, ...] = (
    ("contacts", lambda one: float(one.contacts), 1),
    ("margins lost", lambda one: float(one.lost), 1),
    ("missions completed", lambda one: float(one.completed), -1),
    ("changed commands, %", lambda one: round(100.0 * one.changed, 1), 1),
    ("mean change, m/s", lambda one: round(one.change_mps, 2), 1),
    ("call, median, ms", lambda one: round(one.call_ms(50.0), 2), 1),
    ("call, 99 %, ms", lambda one: round(one.call_ms(99.0), 1), 1),
)


def better_table(rows: Sequence[FlightRow]) -> str:
    """Return a line for every figure in which a rival is better than the guardian."""
    lines: list[Sequence[str]] = [("pilot", "figure", "guardian", "better")]
    for pilot in (*PILOTS, None):
        found = {one.method: one for one in standings(rows, pilot)}
        ours = found.pop(GUARDIAN, None)
        found.pop(NONE, None)
        if ours is None:
            continue
        for name, figure, sign in FIGURES:
            own = figure(ours)
            better = [
                f"{method} {figure(one):g}"
                for method, one in found.items()
                if sign * figure(one) < sign * own
            ]
            if better:
                lines.append((pilot or "all", name, f"{own:g}", ", ".join(better)))
    return as_table(lines)


def as_table(lines: Sequence[Sequence[str]]) -> str:
    """Return lines as Markdown, the first as its head."""
    head, *rest = [f"| {' | '.join(line)} |" for line in lines]
    return "\n".join([head, f"|{' --- |' * len(lines[0])}", *rest])


def write_page(page: Path, rows: Sequence[FlightRow]) -> None:
    """Put the tables between their marks; raises InputError where a mark is missing."""
    made = dict(
        zip(MARKS, (method_table(rows), pilot_table(rows), better_table(rows)), strict=True)
    )
    with naming(page, "written"):
        text = page.read_text(encoding="utf-8")
        for name, table in made.items():
            begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
            before, there, rest = text.partition(begin)
            _, ends, after = rest.partition(end)
            if not there or not ends:
                raise InputError(str(page), f"no {begin} ... {end}")
            text = f"{before}{begin}\n{table}\n{end}{after}"
    with stage_file(page) as scratch:
        scratch.write_text(text, encoding="utf-8")
