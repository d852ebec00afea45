"""Reproductions told: as text for a terminal, as plain values for JSON, as a page of documents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

from clearway.studies.reproduction.target import Exhibit, Measure, Target

Made = Mapping[Target, Sequence[Exhibit]]
"""The exhibits of each target."""

AS_CLAIMED = "None."
ROUNDING = 1e-12

HEAD = """\
# What the paper shows, and what it shows here

`{command} --docs FILE` wrote this page, and draws each figure into `clearway-out/reproduce`.
*Reference* is an independent implementation, *paper* the printed value,
and numbers agree within the tolerance of the computation. What the paper draws by hand is computed
from a scene like it. The flights of 6.4 and 6.5 are the missions that ship with the package, with
noise and drop-outs of the sensor. For figs. 6.2 to 6.13 the paper calls the
five rows of cells layers, from 1 at the top to 5 at the bottom, and so do we; the top of its panels
is the left of the vehicle. Cells in brackets are (layer, column, row) counted from 0: near to far,
right to left, bottom to top. Colours are ours, safe for the colour-blind: red is an obstacle or
blocked, blue is free.
"""


def as_values(made: Made) -> dict[str, Any]:
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
        "difference": findings.difference or None,
        "picture": exhibit.picture,
        "measures": [
            {
                "name": measure.name,
                "ours": measure.ours,
                "expected": measure.expected,
                "source": None if measure.expected is None else measure.source,
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
            said = f"difference: {exhibit.findings.difference or AS_CLAIMED}"
            lines.append(fill(said, 100, initial_indent="  ", subsequent_indent="    "))
            blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def _columns(measure: Measure) -> str:
    known = ""
    if measure.expected is not None and measure.difference is not None:
        close = abs(measure.difference) <= ROUNDING
        difference = "0" if close else f"{measure.difference:+.{1 if measure.agrees else 4}g}"
        known = f"{measure.source:<10}{measure.expected:<10.6g}{difference}"
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
        f"- Difference: {findings.difference or AS_CLAIMED}",
        "",
    ]
    if findings.measures:
        lines += ["| | here | expected | difference |", "|---|---|---|---|"]
        lines += [_table_row(measure) for measure in findings.measures]
        lines.append("")
    return "\n".join(lines)


def _table_row(measure: Measure) -> str:
    """Differences within the tolerance are left out: their last digits vary between machines."""
    expected = difference = ""
    if measure.expected is not None and measure.difference is not None:
        expected = f"{measure.expected:.6g} ({measure.source})"
        difference = "none" if measure.agrees else f"{measure.difference:+.4g}"
    digits = 4 if measure.expected is None and measure.ours % 1.0 else 6
    return f"| {measure.name} | {measure.ours:.{digits}g} | {expected} | {difference} |"
