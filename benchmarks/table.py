"""Rows, how a benchmark makes one, and the table as text, markdown and short, for a page."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from clearway.base.verdict import DemandVerdict

COLUMNS = (
    "name", "what", "median", "p99 or spread", "CPU", "load", "pace", "target",
    "against a reference",
)  # fmt: skip
HEADLINES = ("what", "median", "p99 or spread", "target")
BEGIN, END = "<!-- bench:begin -->", "<!-- bench:end -->"
FIRST_PAGE_BEGIN, FIRST_PAGE_END = "<!-- speed:begin -->", "<!-- speed:end -->"


@dataclass(frozen=True, slots=True)
class Target:
    """A demand and whether it is met; where there is an interval, whether that shows it."""

    text: str
    met: bool | DemandVerdict

    def __str__(self) -> str:
        return f"{self.text}: {self._said}"

    @property
    def _said(self) -> str:
        if isinstance(self.met, bool):
            return "met" if self.met else "MISSED"
        return "not shown yet" if self.met is DemandVerdict.NOT_SHOWN else str(self.met)

    @property
    def missed(self) -> bool:
        return self.met is False or self.met is DemandVerdict.MISSED


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table, already in words."""

    what: str
    result: str
    spread: str = ""
    target: Target | None = None
    reference: str = ""
    measured: float | None = None
    """What the result says, as a number: of several runs the one in the middle counts."""
    cpu: str = ""
    """What the processor took on average, where that was measured."""
    load: float | None = None
    """Of the machine, when it was measured."""
    pace: float | None = None
    """How many times as long as at its quickest a loop of Python took beside it (`pace`)."""

    @property
    def cells(self) -> tuple[str, ...]:
        """All but the name."""
        load = "" if self.load is None else f"{self.load:.1f}"
        pace = "" if self.pace is None else f"{self.pace:.2f}"
        target = str(self.target or "")
        return (self.what, self.result, self.spread, self.cpu, load, pace, target, self.reference)


@dataclass(frozen=True, slots=True)
class Benchmark:
    """Something to measure; `measure` is told whether to be quick about it."""

    name: str
    measure: Callable[[bool], Row]
    headline: bool = False
    """Whether the page shows it."""
    first_page: bool = False
    """Whether README quotes it, the median of several runs."""


@dataclass(frozen=True, slots=True)
class Results:
    """All rows in order, and what they were measured on."""

    rows: Sequence[tuple[Benchmark, Row]]
    machine: str


def machine(load: float) -> str:
    """What the figures are measured on, and when; `load` is that of others before the start."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy",))
    return (
        f"{_processor()}, {os.cpu_count()} cores, one thread each; "
        f"Python {platform.python_version()}, {packages}; {datetime.now(UTC):%Y-%m-%d}, "
        f"load {load:.1f} before the start"
    )


def _processor() -> str:
    """The processor's name, as Linux tells it."""
    try:
        names = re.findall(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.M)
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def print_table(results: Results) -> None:
    """The whole table on standard output, as wide as it needs to be where that is no terminal."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console()
    if not console.is_terminal:
        console = Console(width=190)
    table = Table(title=results.machine, title_justify="left", title_style="")
    for column in COLUMNS:
        table.add_column(column, no_wrap=column == "name")
    for benchmark, row in results.rows:
        colour = "" if row.target is None else "bold red" if row.target.missed else "green"
        target = Text(str(row.target or ""), style=colour)
        *measured, _, reference = row.cells
        table.add_row(benchmark.name, *measured, target, reference)
    console.print(table)


def as_markdown(results: Results) -> str:
    """The whole table."""
    rows = [(benchmark.name, *row.cells) for benchmark, row in results.rows]
    return f"{_markdown(COLUMNS, rows)}\nMeasured on {results.machine}.\n"


def short_form(results: Results) -> str:
    """The headlines, without names and references."""
    rows = [
        (row.what, row.result, row.spread, str(row.target or ""))
        for benchmark, row in results.rows
        if benchmark.headline
    ]
    return f"{_markdown(HEADLINES, rows)}\nMeasured on {results.machine}.\n"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def middle_of(rows: Sequence[Row]) -> Row:
    """Of the rows of several runs the one in the middle, with the least and the greatest; of an
    even number the greater of the two. The only one as it is."""
    if len(rows) == 1 or any(row.measured is None for row in rows):
        return rows[-1]
    ranked = sorted(rows, key=lambda row: row.measured or 0.0)
    return replace(
        ranked[len(rows) // 2],
        spread=f"{ranked[0].result} to {ranked[-1].result} in {len(rows)} runs",
    )


def first_page_form(results: Results) -> str:
    """What README quotes."""
    rows = [
        (row.what, row.result, row.spread)
        for benchmark, row in results.rows
        if benchmark.first_page
    ]
    table = _markdown(("how fast", "median", "least and greatest"), rows)
    return f"{table}\nMeasured on {results.machine}.\n"


def replace_short_form(page: Path, results: Results) -> None:
    """Put the short form between the marks of a page."""
    _replace_between(page, BEGIN, END, short_form(results))


def replace_first_page_form(page: Path, results: Results) -> None:
    """Put what README quotes between its marks in a page."""
    _replace_between(page, FIRST_PAGE_BEGIN, FIRST_PAGE_END, first_page_form(results))


def _replace_between(page: Path, begin: str, end: str, text: str) -> None:
    whole = page.read_text(encoding="utf-8")
    before, mark, rest = whole.partition(begin)
    _, close, after = rest.partition(end)
    if not mark or not close:
        raise SystemExit(f"{page}: no {begin} ... {end}")
    page.write_text(f"{before}{begin}\n{text}{end}{after}", encoding="utf-8")
