"""Curves of what faults cost: of how many flights came what, at each level of a fault."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from clearway.base.frames import FloatArray
from clearway.base.intervals import wilson
from clearway.view.plot.style import SERIES

Line = Literal["-", "--", "-.", ":"]
COLUMNS = 3
NARROWEST_IN = 6.4
"""Of a figure: the legend takes so much."""
NEAREST_NAMES = 0.06
"""Between names of levels, as a share of the axis."""
LETTERS = 56
"""In a line of a title."""
CROWDED = 12.0
"""Times the lowest level, from which on a linear axis would crowd the low ones."""
OUTCOMES: dict[str, tuple[str, Line, str, bool]] = {
    "kept": ("arrived with margin, 95 % interval", "-", "o", True),
    "not_reached": ("safe, but not there in time", "-.", "o", False),
    "margin_lost": ("margin lost, no crash", ":", "v", True),
    "crashed": ("crashed", "--", "x", True),
}
"""Of a flight, by their field of `Curve`: in words, line, marker, whether that is full."""
SIZES = ((3.0, 7.0), (1.3, 3.8))
"""Line and markers of the first curve, and of the others, which are seen on top of it."""


class Curve(NamedTuple):
    """Flights of one kind as a fault grows, at each level."""

    label: str
    kept: Sequence[int]
    not_reached: Sequence[int]
    margin_lost: Sequence[int]
    """Without a crash."""
    crashed: Sequence[int]

    @property
    def flown(self) -> FloatArray:
        """At each level."""
        counts = np.array((self.kept, self.not_reached, self.margin_lost, self.crashed))
        return np.asarray(counts.sum(axis=0), dtype=np.float64)


class Panel(NamedTuple):
    """One fault."""

    title: str
    unit: str
    levels: Sequence[float]
    curves: Sequence[Curve]


def draw_faults(faults: Sequence[Panel], title: str) -> Figure:
    """One panel a fault: a line for each outcome that any flight had, arrivals with 95 % intervals.

    title: of the whole, such as which escapes were flown.
    """
    across = min(COLUMNS, len(faults))
    rows = -(-len(faults) // across)
    width, height = max(NARROWEST_IN, 4.4 * across), 3.1 * rows + 0.7 + (across < COLUMNS)
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(fill(title, int(10 * width)))
    panels = figure.subplots(rows, across, squeeze=False).ravel()
    labels = list(dict.fromkeys(curve.label for fault in faults for curve in fault.curves))
    for axes, fault in zip(panels, faults, strict=False):
        _draw_fault(axes, fault, labels)
    for axes in panels[len(faults) :]:
        axes.set_axis_off()
    for row in range(rows):
        panels[row * across].set_ylabel("share of flights (%)")
    handles = _legend(faults, labels)
    columns = -(-len(handles) // 2)
    figure.legend(handles=handles, loc="outside lower center", ncols=columns)
    return figure


def _legend(faults: Sequence[Panel], labels: Sequence[str]) -> list[Artist]:
    """Colours say what the vehicle has, lines what came of its flights."""
    handles: list[Artist] = [
        Patch(color=SERIES[number % len(SERIES)], label=label)
        for number, label in enumerate(labels)
    ]
    if len(labels) % 2:
        handles.append(Patch(alpha=0.0, label=" "))  # Lines begin a column of their own.
    for field, (words, line, marker, full) in OUTCOMES.items():
        if any(any(getattr(curve, field)) for fault in faults for curve in fault.curves):
            one = Line2D([], [], color="black", marker=marker, markersize=5.0, label=words)
            one.set_linestyle(line)
            one.set_markerfacecolor("black" if full else "white")
            handles.append(one)
    return handles


def _draw_fault(axes: Axes, fault: Panel, labels: Sequence[str]) -> None:
    places = np.array(fault.levels)
    for number, curve in enumerate(fault.curves):
        _draw_curve(axes, places, curve, labels.index(curve.label), SIZES[min(number, 1)])
    _scale_levels(axes, places)
    axes.set_xlabel(fault.unit)
    axes.set_title(fill(fault.title, LETTERS), fontsize=9)
    axes.set_ylim(-4, 104)
    axes.grid(alpha=0.25)


def _draw_curve(
    axes: Axes, places: FloatArray, curve: Curve, number: int, size: tuple[float, float]
) -> None:
    color, flown = SERIES[number % len(SERIES)], curve.flown
    low, high = np.array([wilson(int(k), int(n)) for k, n in zip(curve.kept, flown, strict=True)]).T
    order = np.argsort(places)
    axes.fill_between(
        places[order], 100 * low[order], 100 * high[order], color=color, alpha=0.12, linewidth=0
    )
    for field, (_, line, marker, full) in OUTCOMES.items():
        count = np.array(getattr(curve, field))
        if field == "kept" or count.any():
            axes.plot(
                places,
                100 * count / flown,
                color=color,
                linestyle=line,
                linewidth=size[0],
                marker=marker,
                markersize=size[1],
                markerfacecolor=color if full else "white",
            )


def _scale_levels(axes: Axes, levels: FloatArray) -> None:
    """Levels where they are; by powers, linear up to the lowest, where most would crowd at 0."""
    above = levels[levels > 0.0]
    if len(above) > 1 and above.max() > CROWDED * above.min():
        axes.set_xscale("symlog", linthresh=float(above.min()))
    axes.set_xticks(levels, _apart(axes.xaxis.get_transform().transform(levels), levels))
    axes.minorticks_off()


def _apart(places: FloatArray, levels: FloatArray) -> list[str]:
    """Names of the levels, without those that the next larger one would print over."""
    names = [""] * len(levels)
    last, span = np.inf, float(np.ptp(places)) or 1.0
    for at in np.argsort(places)[::-1].tolist():
        if last - places[at] >= NEAREST_NAMES * span:
            names[at], last = f"{levels[at]:g}", float(places[at])
    return names
