"""What `clearway faults` tells of its flights: tables for the console and pages, and curves."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from clearway.cli.tables import TABLE_WIDTH

if TYPE_CHECKING:
    from pathlib import Path

    from clearway.studies.faults import Point
    from clearway.studies.figures.faults import Panel

COLUMNS = ("fault", "unit", "with", "level: arrived with margin")
REST = "the rest kept the margin too, but were not there when their time was up"
OTHERS = "Where sensors see too little for that, another `escape` was flown, as stated."


def title_of(points: Sequence[Point]) -> str:
    """Return how many flights there were, and by which escapes."""
    first = points[0]
    return f'{len(first.flights)} flights at each level, escape = "{first.escape_asked}"'


def panels_of(points: Sequence[Point]) -> list[Panel]:
    """Return the points as curves to be drawn."""
    from clearway.studies.faults import STUDIES
    from clearway.studies.figures.faults import Curve, Panel

    panels: dict[str, Panel] = {}
    for (name, variant), mine in _by_row(points).items():
        curve = Curve(
            variant,
            [p.kept for p in mine],
            [p.not_reached for p in mine],
            [p.margin_lost for p in mine],
            [p.crashed for p in mine],
        )
        levels = [p.level for p in mine]
        before = panels.get(name, Panel(_title(mine), STUDIES[name].unit, levels, ()))
        panels[name] = before._replace(curves=(*before.curves, curve))
    return list(panels.values())


def put_table(points: Sequence[Point], page: Path) -> None:
    """The table between the marks of a page, which are named after the escapes asked for."""
    from clearway.io.marked_page import put_between_marks

    first = points[0]
    caption = (
        f"Of {len(first.flights)} flights at each level, flown with `escape = "
        f'"{first.escape_asked}"`, so many arrived with the margin kept; where it says so, others '
        f"crashed, or lost the margin without a crash; {REST}.{_others(points)}"
    )
    lines = [caption, "", f"| {' | '.join(COLUMNS)} |", "| --- | --- | --- | --- |"]
    lines += [f"| {' | '.join(row)} |" for row in _rows(points)]
    put_between_marks(page, f"faults-{first.escape_asked}", "\n".join(lines))


def print_faults_table(points: Sequence[Point]) -> None:
    """Print the points for the console: a line for each fault and variant, its levels below."""
    print(f"{title_of(points)}; level: arrived with margin")
    for title, unit, variant, levels in _rows(points):
        print(f"{title}, {unit}; {variant}")
        print(textwrap.fill(levels, TABLE_WIDTH, initial_indent="    ", subsequent_indent="    "))
    print(f"{REST.capitalize()}.{_others(points)}")


def _by_row(points: Sequence[Point]) -> dict[tuple[str, str], list[Point]]:
    """Points by study and variant, in their order."""
    rows: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        rows.setdefault((point.study, point.variant), []).append(point)
    return rows


def _rows(points: Sequence[Point]) -> list[tuple[str, str, str, str]]:
    """Fault, unit, variant, and what came of flights at each level."""
    from clearway.studies.faults import STUDIES

    return [
        (_title(mine), STUDIES[name].unit, variant, "; ".join(map(_cell, mine)))
        for (name, variant), mine in _by_row(points).items()
    ]


def _title(points: Sequence[Point]) -> str:
    """Of one study, with the escapes that were flown where these are others."""
    from clearway.studies.faults import STUDIES

    others = dict.fromkeys(p.escape_mode for p in points if p.escape_mode != p.escape_asked)
    flown = f" (flown as {', '.join(others)})" if others else ""
    return STUDIES[points[0].study].title + flown


def _others(points: Sequence[Point]) -> str:
    """A sentence, where it is due."""
    return f" {OTHERS}" if any(p.escape_mode != p.escape_asked for p in points) else ""


def _cell(point: Point) -> str:
    """Level and how many were kept; crashes and lost margins where there are any."""
    told = [f"{point.level:g}: {point.kept}"]
    told += [f"{point.crashed} crashed"] if point.crashed else []
    told += [f"{point.margin_lost} lost the margin"] if point.margin_lost else []
    return ", ".join(told)
