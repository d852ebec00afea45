"""The table of clearances that are kept with 95 %, and its part of the page of results."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.conformal import MISSES
from clearway.io.marked_page import put_between_marks
from clearway.live.outputs.kept_clearance import TABLE, KeptClearance
from clearway.studies.reliability.kept import HeldShare, Kept, fit_scores
from tools.reliability.kept_flights import FIT, RING, SCALES, SENSORS, WORLDS
from tools.reliability.scale_page import rating_table

PAGE = Path("docs/results/calibration.md")
Row = dict[str, Any]


def fit(rows: list[Row]) -> None:
    """The table that bounds are made from."""
    rows = [row for row in rows if not below_beams(row)]
    decisions = [one for row in rows for one in decisions_of(row)]
    told = {
        "made_by": "python -m tools.reliability --of clearances --fit",
        "flights": len(rows),
    }
    groups = [
        f'  "{group}": {{\n'
        + ",\n".join(f'   "{name}": {_listed(each)}' for name, each in kinds.items())
        + "\n  }"
        for group, kinds in fit_scores(decisions).items()
    ]
    head = json.dumps(told, indent=1).removesuffix("\n}")
    text = head + ',\n "quantiles": {\n' + ",\n".join(groups) + "\n }\n}\n"
    TABLE.write_text(text, encoding="utf-8")


def _listed(quantiles: Sequence[float]) -> str:
    return json.dumps([round(one, 4) if np.isfinite(one) else None for one in quantiles])


def decisions_of(row: Row) -> list[Kept]:
    """The decisions of a flight of the journal, in order."""
    group = row["calibrated_with"]
    return [
        Kept(KeptClearance(foreseen_m, scale_m, most_m, group, level), measured_m, true_m)
        for foreseen_m, scale_m, most_m, level, measured_m, true_m in row["decisions"]
    ]


def below_beams(row: Row) -> bool:
    """Whether a level ring flew among columns, some of which end below its beams."""
    return bool(row["sensor"] == RING and row["family"] == "columns")


def write(rows: list[Row]) -> None:
    """Tables into the page."""
    put_between_marks(PAGE, "clearances", _tables(rows))
    put_between_marks(PAGE, "scales", rating_table(rows))


def _tables(rows: list[Row]) -> str:
    judged = [row for row in rows if not below_beams(row)]
    lines = [
        f"{len(rows)} held-out flights, {sum(len(row['decisions']) for row in rows):,} decisions "
        "that move the vehicle. Intervals (95 %) take flights as independent, not decisions.",
        "",
        "| scale | sensor | flights | decisions | held | held, nothing learned | "
        "held, something near | predicted, median | bound, median | true, median |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for scale in SCALES:
        for sensor in SENSORS:
            cell = scale, sensor
            these = [row for row in judged if (row["scale"], row["sensor"]) == cell]
            if these:
                lines.append(_line(f"{scale} | {sensor}", these))
    lines.append(_line("all | all", judged))
    lines += [
        "",
        "| kind of world | flights | decisions | held | held, nothing learned | "
        "held, something near | predicted, median | bound, median | true, median |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for family in sorted({row["family"] for row in judged}):
        known = ", calibrated on" if family in WORLDS[FIT] else ""
        these = [row for row in judged if row["family"] == family]
        lines.append(_line(f"{family}{known}", these))
    apart = [row for row in rows if below_beams(row)]
    if apart:
        lines.append(_line("columns that end below the beams of a level ring", apart))
    return "\n".join(lines)


def _line(label: str, rows: Sequence[Row]) -> str:
    flights = [decisions_of(row) for row in rows]
    near = [[one for one in each if _limited(one)] for each in flights]
    number = sum(map(len, flights))
    return (
        f"| {label} | {len(rows)} | {number:,} | {_held(flights, _as_stated)} | "
        f"{_held(flights, _as_calibrated)} | {_held(near, _as_stated)} | "
        f"{_middle(near, lambda one: one.stated.predicted_m)} | "
        f"{_middle(near, lambda one: one.stated.bound_m)} | "
        f"{_middle(near, lambda one: one.true_m)} |"
    )


def _as_stated(one: Kept) -> bool:
    return one.held


def _as_calibrated(one: Kept) -> bool:
    """Whether the bound had held at the level that flights begin with."""
    return one._replace(stated=replace(one.stated, level=MISSES)).held


def _limited(one: Kept) -> bool:
    """Whether anything was known to be nearer than clearances are told."""
    return one.stated.predicted_m < one.stated.most_m - 1e-6


def _held(flights: Sequence[Sequence[Kept]], held: Callable[[Kept], bool]) -> str:
    found = HeldShare.of([held(one) for one in each] for each in flights)
    return f"{100 * found.share:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"


def _middle(flights: Sequence[Sequence[Kept]], value: Callable[[Kept], float]) -> str:
    return f"{np.median([value(one) for each in flights for one in each]):.2f} m"
