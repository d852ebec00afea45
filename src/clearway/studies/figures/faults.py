"""Curves of what faults cost: shares of flights that kept their margin, and that crashed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.intervals import wilson

COLOURS = ("#1f5fbf", "#2ca02c", "#e08a00")
COLUMNS = 3


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
    figure = Figure(figsize=(4.4 * across, 3.1 * rows + 0.3), layout="constrained")
    panels = figure.subplots(rows, across, squeeze=False).ravel()
    for axes, fault in zip(panels, faults, strict=False):
        _draw_fault(axes, fault)
    for axes in panels[len(faults) :]:
        axes.set_axis_off()
    for row in range(rows):
        panels[row * across].set_ylabel("share of flights (%)")
    return figure


def _draw_fault(axes: Axes, fault: Panel) -> None:
    places = np.arange(len(fault.levels))
    for number, curve in enumerate(fault.curves):
        color = COLOURS[number % len(COLOURS)]
        flown = np.array(curve.flown)
        low, high = np.array([wilson(*pair) for pair in zip(curve.kept, flown, strict=True)]).T
        axes.fill_between(places, 100 * low, 100 * high, color=color, alpha=0.12, linewidth=0)
        kept, crashed = 100 * np.array(curve.kept) / flown, 100 * np.array(curve.crashed) / flown
        axes.plot(places, kept, "o-", color=color, markersize=4, label=curve.label)
        axes.plot(places, crashed, "x--", color=color, markersize=5, linewidth=1.0)
    axes.plot([], [], "x--", color="grey", linewidth=1.0, label="crashed")
    axes.set_xticks(places, [f"{level:g}" for level in fault.levels])
    axes.set_xlabel(fault.unit)
    axes.set_title(fault.title, fontsize=9)
    axes.set_ylim(-4, 104)
    axes.grid(alpha=0.25)
    axes.legend(fontsize=7, loc="center left")
