"""One encounter of a risk study: from above, over time, and how far apart in both directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M
from clearway.view.plot.style import lines_of
from clearway.view.plot.traffic import INTRUDER, STRAIGHT_COLOUR

LIMITS_FT = ((2000.0, 250.0), (500.0, 100.0))
"""Well clear, and near mid-air collision: horizontal, vertical."""
SHOWN_FT = (6000.0, 1000.0)
"""As far apart as is drawn, and farther where they never come so near."""
BEYOND = 1.6
"""Times the least distances, there."""


class EncounterTracks(NamedTuple):
    """What was flown, in the true world."""

    title: str
    time_s: FloatArray
    """[n] of straight flight and of the intruder."""
    intruder_m: FloatArray
    """[n, 3]"""
    straight_m: FloatArray
    """[n, 3] of the ownship without avoidance."""
    flown: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]]
    """By planner: times [k], own path [k, 3], the intruder's [k, 3] at the same times."""


def draw_encounter(tracks: EncounterTracks) -> Figure:
    """Paths from above, heights over time, horizontal against vertical distance."""
    figure = Figure(figsize=(13.0, 4.8), dpi=120)
    above, height, apart = figure.subplots(1, 3, width_ratios=(1.2, 1.0, 1.0))
    _above(above, tracks)
    _heights(height, tracks)
    _apart(apart, tracks)
    handles, labels = above.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=min(6, len(labels)), frameon=False)
    figure.suptitle(tracks.title)
    figure.tight_layout(rect=(0.0, 0.08, 1.0, 1.0))
    return figure


def _above(axes: Axes, tracks: EncounterTracks) -> None:
    axes.plot(*_km(tracks.straight_m), "--", color=STRAIGHT_COLOUR, label="straight flight")
    axes.plot(*_km(tracks.intruder_m), color=INTRUDER, label="intruder")
    looks = lines_of(list(tracks.flown))
    for name, (_, own, _) in tracks.flown.items():
        colour, line = looks[name]
        axes.plot(*_km(own), line, color=colour, label=name)
    for path, colour in ((tracks.straight_m, STRAIGHT_COLOUR), (tracks.intruder_m, INTRUDER)):
        axes.plot(*_km(path[:1]), "o", color=colour, markersize=5)
    axes.set(title="from above (dots: where it begins)", xlabel="x (km)", ylabel="y left (km)")
    axes.set_aspect("equal", adjustable="datalim")


def _heights(axes: Axes, tracks: EncounterTracks) -> None:
    axes.plot(tracks.time_s, tracks.straight_m[:, 2] / FOOT_M, "--", color=STRAIGHT_COLOUR)
    axes.plot(tracks.time_s, tracks.intruder_m[:, 2] / FOOT_M, color=INTRUDER)
    looks = lines_of(list(tracks.flown))
    for name, (time_s, own, _) in tracks.flown.items():
        colour, line = looks[name]
        axes.plot(time_s, own[:, 2] / FOOT_M, line, color=colour)
    axes.set(title="height", xlabel="time (s)", ylabel="above the ownship's first height (ft)")


def _apart(axes: Axes, tracks: EncounterTracks) -> None:
    for (level, up), style in zip(LIMITS_FT, (":", "-"), strict=True):
        axes.plot([0.0, level, level], [up, up, 0.0], style, color="black", linewidth=0.9)
        axes.annotate(f"{level:g} x {up:g} ft", (level, up), fontsize=8, va="bottom", ha="left")
    looks = lines_of(list(tracks.flown)) | {"": (STRAIGHT_COLOUR, "--")}
    ways = {"": _feet_apart(tracks.straight_m, tracks.intruder_m)} | {
        name: _feet_apart(own, other) for name, (_, own, other) in tracks.flown.items()
    }
    nearest = [max(float(way[axis].min()) for way in ways.values()) for axis in (0, 1)]
    across, up = (max(far, BEYOND * near) for far, near in zip(SHOWN_FT, nearest, strict=True))
    for name, (across_ft, up_ft) in ways.items():
        colour, line = looks[name]
        near = (across_ft <= across) & (up_ft <= up)
        axes.plot(
            np.where(near, across_ft, np.nan), np.where(near, up_ft, np.nan), line, color=colour
        )
    axes.locator_params(axis="x", nbins=5)
    axes.set(
        title=f"distance, within {across:,.0f} x {up:,.0f} ft",
        xlabel="horizontal (ft)",
        ylabel="vertical (ft)",
        xlim=(0.0, across),
        ylim=(0.0, up),
    )


def _km(path_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    return path_m[:, 0] / 1e3, path_m[:, 1] / 1e3


def _feet_apart(own_m: FloatArray, other_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    off = (other_m - own_m) / FOOT_M
    return np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])
