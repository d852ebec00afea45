"""Picture of an encounter flown in place of one of its aircraft: plan view, altitudes, distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray
from clearway.view.plot.flight import EXECUTED, WAYPOINT

if TYPE_CHECKING:
    from clearway.missions.in_place import InPlaceFlight, Way

RECORDED = "#2e9e4f"
WITHOUT = "#555555"
OTHER = "#d62728"
THIRD = "#d9b3b3"
GAP_S = 1.5
"""Rows of a track further apart are not joined."""
TICK_S = 30.0


def draw_in_place(found: InPlaceFlight) -> Figure:
    """The three ways and the other aircraft from above, altitudes and distances over time."""
    part = found.part
    figure = Figure(figsize=(15.0, 9.0), layout="constrained")
    own, other = (one.callsign or one.address for one in (part.own, part.other))
    figure.suptitle(f"in place of {own}, which met {other}: distance to keep {found.keep_m:.0f} m")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
    above = figure.add_subplot(grid[:, 0])
    heights = figure.add_subplot(grid[0, 1])
    distance = figure.add_subplot(grid[1, 1], sharex=heights)
    flown = np.array(found.run.intruder_tracks.get(part.other.address, np.zeros((0, 4))))
    _draw_above(above, found, other, flown)
    ways = (
        ("as recorded", RECORDED, found.recorded, ":"),
        ("without avoidance", WITHOUT, found.without, "--"),
        ("with avoidance", EXECUTED, found.avoiding, "-"),
    )
    for label, colour, way, line in ways:
        _line(above, way.track, (1, 2), colour, line, label)
        _line(heights, way.track, (0, 3), colour, line, None)
        _draw_distance(distance, way, flown, colour, line)
    _line(heights, flown, (0, 3), OTHER, "-", None)
    heights.set_ylabel("altitude above that of the closest point (m)")
    distance.axhline(found.keep_m, color=OTHER, linewidth=0.9, linestyle="-.", label="to keep")
    distance.set_ylabel(f"distance to {other} (m)")
    distance.set_xlabel("time (s)")
    distance.set_ylim(bottom=0.0)
    for axes in (heights, distance):
        axes.axvline(part.closest_s, color=RECORDED, linewidth=0.8, alpha=0.6)
    for axes in (above, heights, distance):
        axes.grid(alpha=0.25)
    handles, labels = above.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


def _draw_above(axes: Axes, found: InPlaceFlight, other: str, flown: FloatArray) -> None:
    """Everybody else, and where all were at the same moments, marked with the seconds."""
    for name, track in found.others.items():
        if name != found.part.other.address:
            _line(axes, track, (1, 2), THIRD, "-", None)
    _line(axes, flown, (1, 2), OTHER, "-", f"{other}, while received")
    goals = found.setup.mission.waypoints_m
    axes.plot(goals[:, 0], goals[:, 1], "s", color=WAYPOINT, markersize=6, label="waypoints")
    for track, colour in ((flown, OTHER), (found.avoiding.track, EXECUTED)):
        _tick(axes, track, colour)
    points = np.concatenate(
        [found.avoiding.track[:, 1:3], found.recorded.track[:, 1:3], goals[:, :2]]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.12 * float((high - low).max()) + found.keep_m
    axes.set_xlim(low[0] - room, high[0] + room)
    axes.set_ylim(low[1] - room, high[1] + room)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")


def _tick(axes: Axes, track: FloatArray, colour: str) -> None:
    """Dots with the time, every half minute."""
    if not len(track):
        return
    for moment in np.arange(0.0, track[-1, 0], TICK_S):
        at = int(np.argmin(np.abs(track[:, 0] - moment)))
        if abs(track[at, 0] - moment) > 0.6:
            continue
        place = (float(track[at, 1]), float(track[at, 2]))
        axes.plot(*place, "o", color=colour, markersize=4)
        axes.annotate(
            f"{moment:.0f}", place, xytext=(4, 4), textcoords="offset points", color=colour,
            fontsize=8, clip_on=True,
        )  # fmt: skip


def _line(
    axes: Axes,
    track: FloatArray,
    columns: tuple[int, int],
    colour: str,
    line: str,
    label: str | None,
) -> None:
    """Two columns of a track [n, 4] against each other, broken where nothing was reported."""
    after = np.flatnonzero(np.diff(track[:, 0]) > GAP_S) + 1
    x, y = (np.insert(track[:, column], after, np.nan) for column in columns)
    axes.plot(x, y, line, color=colour, linewidth=1.6, label=label)


def _draw_distance(axes: Axes, way: Way, other: FloatArray, colour: str, line: str) -> None:
    """Slant distance of a way to the other aircraft, at times that both have."""
    own = way.track
    if not len(other) or not len(own):
        return
    at = np.clip(np.searchsorted(other[:, 0], own[:, 0]), 0, len(other) - 1)
    together = np.abs(other[at, 0] - own[:, 0]) <= 0.06
    gap = np.linalg.norm(other[at, 1:] - own[:, 1:], axis=1)
    table = np.column_stack([own[together, 0], gap[together], *np.zeros((2, together.sum()))])
    _line(axes, table, (0, 1), colour, line, None)
