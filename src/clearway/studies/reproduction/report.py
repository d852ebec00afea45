"""Reproductions told: as text for a terminal, as plain values for JSON, as a page of documents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

from clearway.studies.reproduction.target import (
    NO_DIFFERENCE,
    Exhibit,
    Measure,
    Target,
    difference_words,
)

Made = Mapping[Target, Sequence[Exhibit]]
"""The exhibits of each target."""


HEAD = """\
# What the paper shows, and what it shows here

`{command} --docs FILE` wrote this page, and draws each figure into `clearway-out/reproduce`.
*Reference* is an independent implementation, *paper* the printed value, and each number has a
tolerance of its own: what differs by more is set in bold. What the paper draws by hand is computed
from a scene like it. The flights of 6.4 and 6.5 are the missions that ship with the package, with
noise and drop-outs of the sensor. For figs. 6.2 to 6.13 the paper calls the
five rows of cells layers, from 1 at the top to 5 at the bottom, and so do we; the top of its panels
is the left of the vehicle. Cells in brackets are (layer, column, row) counted from 0: near to far,
right to left, bottom to top. Colours are ours, safe for the colour-blind: red is an obstacle or
blocked, blue is free.
"""


def summarize_reproduction(made: Made) -> dict[str, Any]:
    """The object that `reproduce --json` prints."""
    return {
        "targets": [
            {
                "name": target.name,
                "title": target.title,
                "exhibits": [_exhibit_values(exhibit) for exhibit in exhibits],
            }
            for target, exhibits in made.items()
        ]
    }


def _exhibit_values(exhibit: Exhibit) -> dict[str, Any]:
    findings = exhibit.findings
    return {
        "label": exhibit.label,
        "title": exhibit.title,
        "claim": findings.claim,
        "ours": findings.ours,
        "difference": None
        if findings.difference_told == NO_DIFFERENCE
        else findings.difference_told,
        "picture": exhibit.picture,
        "measures": [
            {
                "name": measure.name,
                "ours": measure.ours,
                "expected": measure.expected,
                "source": None if measure.expected is None else measure.source,
                "tolerance": None if measure.expected is None else measure.tolerance,
                "difference": measure.difference,
                "agrees": measure.agrees,
            }
            for measure in findings.measures
        ],
    }


def as_text(made: Made) -> str:
    """Every exhibit's measures in columns, and where it is not as the paper says."""
    blocks = []
    for exhibits in made.values():
        for exhibit in exhibits:
            lines = [f"{exhibit.label}: {exhibit.title}"]
            lines += [f"  {_columns(measure)}".rstrip() for measure in exhibit.findings.measures]
            said = f"difference: {exhibit.findings.difference_told}"
            lines.append(fill(said, 100, initial_indent="  ", subsequent_indent="    "))
            blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def _columns(measure: Measure) -> str:
    known = ""
    if measure.expected is not None:
        within = f"{'within' if measure.agrees else 'beyond'} {measure.tolerance:g}"
        said = difference_words(measure) + ("" if measure.equal else f", {within}")
        known = f"{measure.source:<10}{measure.expected:<10.6g}{said}"
    return f"{measure.name:<54}{measure.ours:>10.6g}   {known}"


def as_page(made: Made, command: str) -> str:
    """A Markdown page; `command` is what makes it again."""
    parts = [HEAD.format(command=command)]
    for target, exhibits in made.items():
        parts.append(f"## {target.title[0].upper()}{target.title[1:]}\n\n`{target.name}`\n")
        parts += [_section(exhibit) for exhibit in exhibits]
    return "\n".join(parts)


def _section(exhibit: Exhibit) -> str:
    findings = exhibit.findings
    lines = [
        f"### {exhibit.label}: {exhibit.title}",
        "",
        f"- Paper: {findings.claim}",
        f"- Here: {findings.ours}",
        f"- Difference: {findings.difference_told}",
        "",
    ]
    if findings.measures:
        lines += ["| | here | expected | tolerance | difference |", "|---|---|---|---|---|"]
        lines += [_table_row(measure) for measure in findings.measures]
        lines.append("")
    return "\n".join(lines)


def _table_row(measure: Measure) -> str:
    expected = tolerance = ""
    if measure.expected is not None:
        expected = f"{measure.expected:.6g} ({measure.source})"
        tolerance = f"{measure.tolerance:g}"
    difference = difference_words(measure)
    if measure.agrees is False:
        difference = f"**{difference}**"
    digits = 4 if measure.expected is None and measure.ours % 1.0 else 6
    return (
        f"| {measure.name} | {measure.ours:.{digits}g} | {expected} | {tolerance} | {difference} |"
    )
