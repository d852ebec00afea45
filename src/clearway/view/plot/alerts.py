"""Alerts over time, and under them the bands of heading, climb and speed."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from clearway.avoidance.long_range.bands import Band, Bands
from clearway.missions.alert_history import AlertHistory
from clearway.traffic.volumes import AlertLevel

COLOURS = {
    AlertLevel.NONE: "#ffffff",
    AlertLevel.PREVENTIVE: "#f6e8b1",
    AlertLevel.CORRECTIVE: "#f0b14a",
    AlertLevel.WARNING: "#c0392b",
    AlertLevel.RECOVERY: "#2e9e4f",
}
"""Of bands; recovery is what to fly, in green; hatched, since not all can tell that from red."""
HATCH = {AlertLevel.RECOVERY: "////"}


def draw_alerts(history: AlertHistory) -> Figure:
    """One row of levels by intruder, then the three bands; empty bands where there is no alert."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True, height_ratios=(1.0, 1.6, 1.0, 1.0))
    figure.suptitle(f"Alerts for {history.own}, by {history.volumes.about}")
    _levels(axes[0], history)
    shown = [(second.time_s, second.bands) for second in history.seconds if second.bands]
    for row, (name, band, unit) in zip(
        axes[1:],
        (("heading", "compass", "deg from north"), ("climb", "climb", "m/s"),
         ("speed", "speed", "m/s")),
        strict=True,
    ):  # fmt: skip
        _band(row, shown, band)
        row.set_ylabel(f"{name}\n{unit}")
    axes[1].set_yticks(range(0, 361, 90))
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels(axes)
    named = [level for level in AlertLevel if level]
    handles = [
        Patch(
            facecolor=COLOURS[level],
            edgecolor="white",
            linewidth=0.0,
            hatch=HATCH.get(level),
            label=level.name.lower(),
        )
        for level in named
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _levels(axes: Axes, history: AlertHistory) -> None:
    names = sorted({alert.name for second in history.seconds for alert in second.alerts.alerts})
    alerted = {name for _, name, _ in history.changes()}
    for name in (name for name in names if name in alerted):
        at = [
            (second.time_s, int(alert.level))
            for second in history.seconds
            for alert in second.alerts.alerts
            if alert.name == name
        ]
        axes.step(*zip(*at, strict=True), where="post", label=name)
    axes.set_yticks(range(len(AlertLevel)), [level.name.lower() for level in AlertLevel])
    axes.set_ylim(-0.2, len(AlertLevel) - 0.8)
    axes.grid(alpha=0.25)
    if alerted and len(alerted) <= 8:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)


def _band(axes: Axes, shown: list[tuple[float, Bands]], name: str) -> None:
    for time_s, bands in shown:
        band: Band = getattr(bands, name)
        values = band.values
        half = 0.5 * float(values[1] - values[0])
        levels = np.where(band.recovery, int(AlertLevel.RECOVERY), band.levels)
        starts = np.flatnonzero(np.diff(levels, prepend=-1))
        for start, stop in zip(starts, [*starts[1:], len(levels)], strict=True):
            if levels[start]:
                level = AlertLevel(int(levels[start]))
                low, high = values[start] - half, values[stop - 1] + half
                axes.fill_between(
                    [time_s, time_s + 1.0],
                    low,
                    high,
                    facecolor=COLOURS[level],
                    edgecolor="white",
                    linewidth=0.0,
                    hatch=HATCH.get(level),
                )
    axes.grid(alpha=0.25)
