"""Reliability diagrams: what a rating said, and the share of it that was so."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.studies.reliability.bins import Reliability

COLOURS = ("#0072B2", "#E69F00", "#CC79A7", "#56B4E9", "#009E73", "#000000")
MARKS = ("o", "s", "v", "D", "^", "x")
FEWEST = 5
"""Flights in a bin that is drawn: an interval of fewer is as wide as the picture."""


def draw_reliability(panels: Mapping[str, Mapping[str, Reliability]]) -> Figure:
    """One panel for each kind of statement, in it a curve for each rating with 95 % intervals."""
    figure = Figure(figsize=(4.4 * len(panels), 5.0), layout="constrained")
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for place, (title, ratings) in zip(axes, panels.items(), strict=True):
        _draw(place, title, ratings)
    axes[0].set_ylabel("share that was so")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


def _draw(axes: Axes, title: str, ratings: Mapping[str, Reliability]) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#888888", linewidth=1.0, linestyle="--")
    for number, (name, found) in enumerate(ratings.items()):
        points = [point for point in found.points if point.flights >= FEWEST]
        said = [point.said for point in points]
        came = [point.came for point in points]
        below = [point.came - point.low for point in points]
        above = [point.high - point.came for point in points]
        axes.errorbar(
            said, came, yerr=[below, above], label=name, color=COLOURS[number % len(COLOURS)],
            marker=MARKS[number % len(MARKS)], markersize=4.5, linewidth=1.2, elinewidth=0.8,
            capsize=2, zorder=2 + number,
        )  # fmt: skip
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlabel("rating")
    axes.set_title(title, fontsize=10)
    axes.set_aspect("equal")
    axes.grid(alpha=0.25)
