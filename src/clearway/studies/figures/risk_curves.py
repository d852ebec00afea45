"""Risk ratios against range, surveillance and detour, of several studies."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.errors import InputError
from clearway.traffic.surveillance import SURVEILLANCES
from clearway.view.plot.style import lines_of

"""Of planners, in the order in which studies name them."""
SPARE = 0.04
"""Of an axis, below zero, so that marks there are whole."""
ASIDE_KM = 0.09
ASIDE_KIND = 0.1
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
    """Ratios with their intervals against range, surveillance and what avoiding costs.

    Against range stand the studies of the surveillance that most ranges were flown with, against
    surveillance those of the range that most kinds were flown at; where there is but one kind,
    nothing does. The same planner is drawn once where several studies of it are of one kind: by the
    one with most encounters, or against surveillance with as many as most others have.
    """
    studies = sorted(studies, key=lambda study: -study["encounters"])
    names = list(dict.fromkeys(name for study in studies for name in study["planners"]))
    by_range, by_kind = _series(studies)
    kinds = sorted({study["surveillance"] for study in by_kind}, key=list(SURVEILLANCES).index)
    columns = 2 + (len(kinds) > 1)
    figure = Figure(figsize=(4.6 * columns + 1.0, 8.0), layout="constrained")
    rows = figure.subplots(2, columns)
    for places, (measure, title) in zip(rows, MEASURES, strict=True):
        ranges, detours = places[0], places[-1]
        for told, study, planner, style, beside in _list_told(by_range, names):
            # Beside each other, or intervals would hide each other.
            at = study["range_m"] / 1e3 + ASIDE_KM * beside
            _point(ranges, at, told[measure], style, planner)
        for told, _, planner, style, _ in _list_told(studies, names):
            _point(detours, told["mean_aside_m"], told[measure], style, planner)
        if len(kinds) > 1:
            for told, study, planner, style, beside in _list_told(by_kind, names):
                at = kinds.index(study["surveillance"]) + ASIDE_KIND * beside
                _point(places[1], at, told[measure], style, planner)
            places[1].set_xticks(range(len(kinds)), [_kind(kind) for kind in kinds], fontsize=8)
            places[1].set_xlabel(f"known by, within {by_kind[0]['range_m'] / 1e3:g} km")
        for axes in places:
            axes.set_ylim(-SPARE * axes.get_ylim()[1], None)
            axes.grid(alpha=0.25)
        ranges.set_ylabel(f"risk ratio, {title}")
        ranges.set_xlabel(f"detected within (km), {by_range[0]['surveillance']}")
        detours.set_xlabel("lateral detour, mean over all that enter (m)")
    handles: dict[str, Any] = {}
    for axes in rows[0]:
        found, labels = axes.get_legend_handles_labels()
        handles |= dict(zip(labels, found, strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3,
                  frameon=False)  # fmt: skip
    return figure


def _series(
    studies: Sequence[dict[str, Any]],
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Studies to be drawn against range, and those against surveillance."""
    ranges: dict[str, set[float]] = {}
    kinds: dict[float, set[str]] = {}
    for study in studies:
        ranges.setdefault(study["surveillance"], set()).add(study["range_m"])
        kinds.setdefault(study["range_m"], set()).add(study["surveillance"])
    kind = max(ranges, key=lambda name: len(ranges[name]))
    range_m = max(kinds, key=lambda far: len(kinds[far]))
    there = [study for study in studies if study["range_m"] == range_m]
    # Kinds are compared by the same encounters, as far as there are such studies.
    alike = Counter(study["encounters"] for study in there)
    there.sort(key=lambda study: -alike[study["encounters"]])
    return [study for study in studies if study["surveillance"] == kind], there


Told = tuple[dict[str, Any], dict[str, Any], str, tuple[str, str], float]


def _list_told(studies: Sequence[dict[str, Any]], names: Sequence[str]) -> Iterator[Told]:
    """What each study says of each planner, with its label, colour, mark and place beside others;
    of several of one kind the first."""
    known = set()
    for study in studies:
        for planner, told in study["planners"].items():
            key = (planner, study["vehicle"], study["surveillance"], study["range_m"])
            if key in known:
                continue
            known.add(key)
            number, mark = names.index(planner), MARKS.get(study["vehicle"], "s")
            beside = 2 * number + (mark != MARKS["copter"]) - len(names) + 0.5
            style = (lines_of(names)[planner][0], mark)
            yield told, study, f"{planner}, {study['vehicle']}", style, beside


def _kind(name: str) -> str:
    """A surveillance as a mark of an axis."""
    return name.replace("ads-b-minimum", "ads-b,\nminimum").replace("remote-id", "remote\nid")


def _point(
    axes: Axes, at: float, measure: dict[str, Any], style: tuple[str, str], label: str
) -> None:
    colour, mark = style
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
        for planner, rows in told["curves"].items():
            rows = sorted(rows, key=lambda row: row["aside_m"])
            aside = [row["aside_m"] for row in rows]
            value, low, high = zip(*(row[measure] for row in rows), strict=True)
            colour = lines_of(list(told["curves"]))[planner][0]
            axes.plot(aside, value, color=colour, marker="o", markersize=5, label=planner)
            axes.fill_between(aside, low, high, color=colour, alpha=0.12, linewidth=0.0)
            highest = max(highest, *value)
        # Intervals of so few flights go far beyond: what they hold of the curves is drawn.
        top = max(1.25 * highest, 0.1)
        axes.set_ylim(-SPARE * top, top)
        axes.set_xlim(0.0, None)
        axes.set_xlabel("lateral detour, mean over all that enter (m)")
        axes.set_ylabel(f"risk ratio, {title}")
        axes.grid(alpha=0.25)
    figure.axes[0].legend(frameon=False)
    figure.suptitle(f"{told['kind']}: {told['encounters']} encounters")
    return figure
