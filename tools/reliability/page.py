"""The tables and the picture of docs/results/calibration.md."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.rate.calibration import CLASSES, calibration
from clearway.avoidance.rate.fusion import RATINGS
from clearway.base.frames import FloatArray
from clearway.base.intervals import bootstrap_mean, wilson
from clearway.io.marked_page import put_between_marks
from clearway.studies.figures.reliability import draw_reliability
from clearway.studies.reliability.bins import COARSE, Reliability, bin_ratings, reliability
from clearway.studies.reliability.record import CELLS, CHOSEN, PASSAGES, TRAJECTORIES
from clearway.view.plot.style import house_style
from tools.reliability.flights import CHANGES, TABLE, counts_of

PAGE, PICTURE = Path("docs/results/calibration.md"), Path("docs/images/reliability.png")
TITLES = {
    CELLS: "cells: nothing solid stands in it",
    PASSAGES: "passages of cells that keep the margin",
    TRAJECTORIES: "trajectories (P_R) that keep the margin",
    CHOSEN: "chosen trajectories that keep the margin",
}


def write(rows: list[dict[str, Any]]) -> None:
    """Tables into the page, and its picture."""
    found = {
        kind: {name: reliability(_all(rows, kind, name)) for name in RATINGS} for kind in TITLES
    }
    parts = [
        _head(rows), _scores(found), _said(found[TRAJECTORIES]),
    ]  # fmt: skip
    put_between_marks(PAGE, "reliability", "\n\n".join(parts))
    put_between_marks(PAGE, "map", _map())
    put_between_marks(PAGE, "in-flight", _in_flight(rows))
    with house_style():
        panels = {TITLES[kind]: found[kind] for kind in (CELLS, PASSAGES, TRAJECTORIES)}
        draw_reliability(panels).savefig(PICTURE, dpi=110)


def _all(rows: list[dict[str, Any]], kind: str, rating: str) -> FloatArray:
    return np.stack([counts_of(row, kind, rating) for row in rows])


def _head(rows: list[dict[str, Any]]) -> str:
    decisions = sum(row["decisions"] for row in rows)
    return f"{len(rows)} held-out flights, {decisions:,} decisions."


def _scores(found: dict[str, dict[str, Reliability]]) -> str:
    lines = [
        "| what | rating | number | true | mean rating | Brier score | saved | off by |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind, ratings in found.items():
        for name, one in ratings.items():
            mean = sum(p.said * p.number for p in one.points) / one.number
            low, high = one.interval
            lines.append(
                f"| {TITLES[kind]} | `{name}` | {one.number:,} | {100 * one.came:.1f} % | "
                f"{100 * mean:.1f} % | {one.brier:.4f} ({max(low, 0.0):.4f} to {high:.4f}) | "
                f"{100 * one.skill:.0f} % | {100 * one.error:.1f} % |"
            )
    return "\n".join(lines)


def _said(ratings: dict[str, Reliability]) -> str:
    """What came of trajectories by what P_R said, in tenths."""
    lines = [
        "| P_R said | " + " | ".join(f"`{name}`" for name in ratings) + " |",
        "| --- |" + " --- |" * len(ratings),
    ]
    names = ["0", *(f"0.{k} to {(k + 1) / 10:g}" for k in range(10)), "1"]
    for number, label in enumerate(names):
        cells = []
        for one in ratings.values():
            point = next((p for p in one.points if _tenth(p.said) == number), None)
            cells.append(
                "" if point is None
                else f"{100 * point.came:.0f} % ({100 * point.low:.0f} to {100 * point.high:.0f})"
            )  # fmt: skip
        if any(cells):
            lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _tenth(said: float) -> int:
    return int(COARSE[bin_ratings(np.array([said]))[0]])


def _map() -> str:
    told = json.loads(TABLE.read_text(encoding="utf-8"))
    at = (0.0, 0.25, 0.5, 0.75, 0.9, 0.97, 0.99, 1.0)
    lines = [
        f"{told['flights']} flights, {told['decisions']:,} decisions.",
        "",
        "| cells | passages | " + " | ".join(f"total {x:g}" for x in at) + " |",
        "| --- | --- |" + " --- |" * len(at),
    ]
    made = calibration()
    for number, name in enumerate(CLASSES):
        came = made(np.array(at), np.full(len(at), number))
        lines.append(
            f"| {name} | {told['passages'][name]:,} | "
            + " | ".join(f"{100 * one:.1f} %" for one in came) + " |"
        )  # fmt: skip
    return "\n".join(lines)


def _in_flight(rows: list[dict[str, Any]]) -> str:
    lines = [
        "| flown | rating | safe | reached | margin lost | crashed | nearest, median | "
        "path, mean | emergencies | decided by rating |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for way in CHANGES:
        how, rating = way.split("/")
        told = [row["flights"][way] for row in rows]
        n = len(told)
        low, high = wilson(sum(one["safe"] for one in told), n)
        nearest = [one["nearest_m"] for one in told if one["nearest_m"] is not None]
        decided = sum(one["by_rating"] for one in told) / sum(one["decisions"] for one in told)
        lines.append(
            f"| {how} | `{rating}` | {sum(one['safe'] for one in told)} of {n} "
            f"({100 * low:.0f} to {100 * high:.0f} %) | {sum(one['reached'] for one in told)} | "
            f"{sum(not one['kept'] for one in told)} | {sum(one['crashed'] for one in told)} | "
            f"{np.median(nearest):.2f} m | {np.mean([one['path_m'] for one in told]):.1f} m | "
            f"{sum(one['emergencies'] for one in told)} | {100 * decided:.1f} % |"
        )
    for how in dict.fromkeys(way.split("/")[0] for way in CHANGES):
        lines += ["", _paired(rows, how)]
    return "\n".join(lines)


def _paired(rows: list[dict[str, Any]], how: str) -> str:
    """The same flights by both ratings."""
    pairs = [(row["flights"][f"{how}/total"], row["flights"][f"{how}/calibrated"]) for row in rows]
    won = sum(new["safe"] and not old["safe"] for old, new in pairs)
    lost = sum(old["safe"] and not new["safe"] for old, new in pairs)
    same = sum(old["path_m"] == new["path_m"] for old, new in pairs)
    both = [(old, new) for old, new in pairs if old["safe"] and new["safe"]]
    longer = [new["path_m"] / old["path_m"] - 1.0 for old, new in both]
    nearer = [
        new["nearest_m"] - old["nearest_m"]
        for old, new in both
        if None not in (old["nearest_m"], new["nearest_m"])
    ]
    mean, (low, high) = float(np.mean(longer)), bootstrap_mean(longer)
    return (
        f"Paired, {how}: {same} of {len(pairs)} flights are the same; {won} are safe with "
        f"`calibrated` alone, {lost} with `total` alone. Where both are safe, `calibrated` flies "
        f"{100 * mean:+.1f} % ({100 * low:+.1f} to {100 * high:+.1f} %) of the way more, and "
        f"passes {np.median(nearer):+.2f} m farther off in the middle."
    )
