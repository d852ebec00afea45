"""Curves of what faults cost: shares of flights that kept their margin, and that crashed."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray
from clearway.base.intervals import wilson
from clearway.view.plot.style import SERIES

COLUMNS = 3
NARROWEST_IN = 6.4
"""Of a figure: the legend takes so much."""
NEAREST_NAMES = 0.06
"""Between names of levels, as a share of the axis."""
LETTERS = 56
"""In a line of a title."""
CROWDED = 12.0
"""Times the lowest level, from which on a linear axis would crowd the low ones."""


class Curve(NamedTuple):
    """Flights of one kind as a fault grows, at each level."""

    label: str
    kept: Sequence[int]
    crashed: Sequence[int]
    flown: Sequence[int]


class Panel(NamedTuple):
    """One fault."""

    title: str
    unit: str
    levels: Sequence[float]
    curves: Sequence[Curve]


def draw_faults(faults: Sequence[Panel]) -> Figure:
    """One panel a fault: kept in full lines with 95 % intervals, crashed in dashed ones."""
    across = min(COLUMNS, len(faults))
    rows = -(-len(faults) // across)
    width, height = max(NARROWEST_IN, 4.4 * across), 3.1 * rows + 0.3 + (across < COLUMNS)
    figure = Figure(figsize=(width, height), layout="constrained")
    panels = figure.subplots(rows, across, squeeze=False).ravel()
    labels = list(dict.fromkeys(curve.label for fault in faults for curve in fault.curves))
    for axes, fault in zip(panels, faults, strict=False):
        _draw_fault(axes, fault, labels)
    for axes in panels[len(faults) :]:
        axes.set_axis_off()
    for row in range(rows):
        panels[row * across].set_ylabel("share of flights (%)")
    named = {
        label: handle
        for axes in panels[: len(faults)]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    columns = min(2 if across < COLUMNS else 4, len(named))
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=columns)
    return figure


def _draw_fault(axes: Axes, fault: Panel, labels: Sequence[str]) -> None:
    places = np.array(fault.levels)
    for curve in fault.curves:
        color = SERIES[labels.index(curve.label) % len(SERIES)]
        flown = np.array(curve.flown)
        low, high = np.array([wilson(*pair) for pair in zip(curve.kept, flown, strict=True)]).T
        axes.fill_between(places, 100 * low, 100 * high, color=color, alpha=0.12, linewidth=0)
        kept, crashed = 100 * np.array(curve.kept) / flown, 100 * np.array(curve.crashed) / flown
        axes.plot(places, kept, "o-", color=color, markersize=4, label=curve.label)
        label = f"{curve.label}: crashed"
        axes.plot(places, crashed, "x--", color=color, markersize=5, linewidth=1.0, label=label)
    _scale_levels(axes, places)
    axes.set_xlabel(fault.unit)
    axes.set_title(fill(fault.title, LETTERS), fontsize=9)
    axes.set_ylim(-4, 104)
    axes.grid(alpha=0.25)


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
