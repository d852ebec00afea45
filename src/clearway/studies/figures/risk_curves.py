"""Risk ratios against range and detour, of several studies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.errors import InputError

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#000000")
"""Of planners, in the order in which studies name them."""
SPARE = 0.04
"""Of an axis, below zero, so that marks there are whole."""
ASIDE_KM = 0.05
MARKS = {"copter": "o", "wing": "^"}
MEASURES = (
    ("near_collision", "near mid-air collision"),
    ("lost_well_clear", "loss of well clear"),
)


def read_study(path: Path) -> dict[str, Any]:
    """A result of `clearway risk --json` at real scale; InputError for anything else."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as cause:
        raise InputError(str(path), "is no JSON of clearway risk") from cause
    if not isinstance(told, dict) or not told.get("planners") or not told.get("vehicle"):
        raise InputError(str(path), "is no result of clearway risk --vehicle ... --json")
    return told


def draw_risk_curves(studies: Sequence[dict[str, Any]]) -> Figure:
    """Ratios with their intervals against range, and against what avoiding costs."""
    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    rows = figure.subplots(2, 2)
    for (ranges, detours), (measure, title) in zip(rows, MEASURES, strict=True):
        names = list(dict.fromkeys(name for study in studies for name in study["planners"]))
        for study in studies:
            for planner, told in study["planners"].items():
                number = names.index(planner)
                style = COLOURS[number % len(COLOURS)]
                mark = MARKS.get(study["vehicle"], "s")
                label = f"{planner}, {study['vehicle']}"
                # Beside each other, or intervals would hide each other.
                beside = ASIDE_KM * (2 * number + (mark != MARKS["copter"]))
                _point(ranges, study["range_m"] / 1e3 + beside, told[measure], style, mark, label)
                _point(detours, told["mean_aside_m"], told[measure], style, mark, label)
        for axes in (ranges, detours):
            axes.set_ylabel(f"risk ratio, {title}")
            axes.set_ylim(-SPARE * axes.get_ylim()[1], None)
            axes.grid(alpha=0.25)
        ranges.set_xlabel("heard within, km")
        detours.set_xlabel("farthest aside, mean over all that enter, m")
    handles, labels = rows[0][0].get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _point(
    axes: Axes, at: float, measure: dict[str, Any], colour: str, mark: str, label: str
) -> None:
    value, (low, high) = measure["ratio"], measure["ratio_95"]
    if value is None or high is None:
        return
    axes.errorbar(
        [at], [value], yerr=[[value - low], [high - value]], color=colour, marker=mark,
        markersize=6, capsize=3, linestyle="none", label=label,
    )  # fmt: skip


def draw_detour_curves(told: dict[str, Any]) -> Figure:
    """Ratios against detour, a curve for each planner: its variants, from little detour to much.

    told: `curves` by planner, rows with `aside_m` and a ratio with its interval by measure, as
    `tools.equal_detour` writes them.
    """
    figure = Figure(figsize=(12.0, 4.6), layout="constrained")
    for axes, (measure, title) in zip(figure.subplots(1, 2), MEASURES, strict=True):
        highest = 0.0
        for number, (planner, rows) in enumerate(told["curves"].items()):
            rows = sorted(rows, key=lambda row: row["aside_m"])
            aside = [row["aside_m"] for row in rows]
            value, low, high = zip(*(row[measure] for row in rows), strict=True)
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(aside, value, color=colour, marker="o", markersize=5, label=planner)
            axes.fill_between(aside, low, high, color=colour, alpha=0.12, linewidth=0.0)
            highest = max(highest, *value)
        # Intervals of so few flights go far beyond: what they hold of the curves is drawn.
        top = max(1.25 * highest, 0.1)
        axes.set_ylim(-SPARE * top, top)
        axes.set_xlim(0.0, None)
        axes.set_xlabel("farthest aside, mean over all that enter, m")
        axes.set_ylabel(f"risk ratio, {title}")
        axes.grid(alpha=0.25)
    figure.axes[0].legend(frameon=False)
    figure.suptitle(f"{told['kind']}: {told['encounters']} encounters", fontsize=11)
    return figure
