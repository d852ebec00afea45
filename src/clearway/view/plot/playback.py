"""Picture of a recording played through the avoidance system: what was near, how sure it was."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from clearway.base.frames import FloatArray
from clearway.missions.recorded_scan import beams_in_words

MODES = {
    "navigation": "#2e9e4f",
    "landing": "#16a2b8",
    "avoidance": "#e08a00",
    "escape": "#8e44ad",
    "hold": "#5a6b7d",
    "narrow": "#c2408a",
    "emergency": "#d62728",
}


def draw_playback(result: Mapping[str, Any]) -> Figure:
    """Distances, ratings and returns over time, of what `assess --all` found; modes as colours."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    scans = result["scans"]
    left_out = sum(result["left_out"].values())
    figure.suptitle(
        f"{result['name']}: {len(scans)} scans decided, {left_out} left out\n"
        f"beams {beams_in_words(result['pattern_from'], result['pattern'])}"
    )
    distances, ratings, returns = figure.subplots(3, 1, sharex=True)
    times = _column(scans, "time_s")
    times = times - times[0] if len(times) else times
    _draw(distances, times, scans, {"nearest_m": "nearest return", "clearance_m": "clearance"})
    _draw(ratings, times, scans, {"p_reach": "$P_R$ of the trajectory", "p_decision": "$P_D$"})
    _draw(returns, times, scans, {"hits": "returns in the grid", "points": "returns in all"})
    margin = _column(scans, "margin_m")
    distances.plot(times, margin, color="#111111", lw=0.8, ls=":", label="margin")
    for axes, label in (
        (distances, "distance (m)"),
        (ratings, "probability"),
        (returns, "returns"),
    ):
        axes.set_ylabel(label)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.grid(alpha=0.25)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ratings.set_ylim(0.0, 1.05)
    figure.align_ylabels([distances, ratings, returns])
    returns.set_xlabel("time after the first scan (s)")
    modes = dict.fromkeys(one["mode"] for one in scans)
    marks = [Line2D([], [], color=MODES[mode], marker="o", linestyle="none") for mode in modes]
    figure.legend(marks, modes, loc="outside lower center", ncols=len(MODES), frameon=False)
    return figure


def _draw(
    axes: Axes, times: FloatArray, scans: list[Mapping[str, Any]], curves: Mapping[str, str]
) -> None:
    colours = [MODES[one["mode"]] for one in scans]
    for (key, label), style in zip(curves.items(), ("-", "--"), strict=True):
        values = _column(scans, key)
        axes.plot(times, values, color="#5a6b7d", lw=1.0, ls=style, label=label)
        axes.scatter(times, values, c=colours, s=16.0, zorder=3)


def _column(scans: list[Mapping[str, Any]], key: str) -> FloatArray:
    return np.array([np.nan if one[key] is None else one[key] for one in scans], dtype=np.float64)
