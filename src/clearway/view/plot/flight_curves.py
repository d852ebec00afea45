"""Curves of a flight over its time: distances, and coordinates (figs. 6.21, 6.22)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.sim import Run
from clearway.sim.pilot import Steering
from clearway.view.plot.flight import EXECUTED, PLANNED, WAYPOINT

FAR_ABOVE = 3.0
"""Times the greatest distance: a margin above that is named only."""


@dataclass(frozen=True, slots=True)
class Margins:
    """The three margins of fig. 6.21, in metres."""

    safety_m: float
    adaptive_m: float
    """(6.15): six vehicle radii."""
    conservative_m: float
    """(6.14): two turning radii and two vehicle radii."""


def draw_obstacle_distance(run: Run[Steering], margins: Margins) -> Figure:
    """Distance to the nearest obstacle over time with the three margins (fig. 6.21)."""
    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    axes = figure.add_subplot()
    distance = run.metrics.obstacle_distance_m
    axes.plot(run.time_s, distance, color=EXECUTED, label="distance to the nearest obstacle")
    lines = (
        (margins.conservative_m, "conservative margin (6.14)", WAYPOINT),
        (margins.adaptive_m, "adaptive margin (6.15)", "#d9a400"),
        (margins.safety_m, "safety margin", PLANNED),
    )
    for value, label, color in lines:
        # One far above all that was flown would leave no room for that.
        beyond = value > FAR_ABOVE * float(distance.max()) > 0.0
        name = f"{label}: {value:.2f} m" + (", above the picture" if beyond else "")
        if beyond:
            axes.plot([], [], linestyle="--", color=color, label=name)
        else:
            axes.axhline(value, linestyle="--", color=color, label=name)
    if np.isfinite(distance).all():
        lowest = int(np.argmin(distance))
        label = f"nearest: {distance[lowest]:.2f} m at {run.time_s[lowest]:.1f} s"
        axes.plot(run.time_s[lowest], distance[lowest], "o", color=EXECUTED, label=label)
    finish_distances(axes, "distance (m)", f"{run.mission.name}: distance to obstacles")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def finish_distances(axes: Axes, measured: str, title: str) -> None:
    """Labels of axes that show distances over the time of a flight."""
    axes.set_xlabel("time (s)")
    axes.set_ylabel(measured)
    axes.set_ylim(bottom=0.0)
    axes.set_title(title)
    axes.grid(alpha=0.25)


def draw_tracking(run: Run[Steering]) -> Figure:
    """Coordinates over time against the straight lines between waypoints (fig. 6.22)."""
    figure = Figure(figsize=(10.0, 7.2), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    reached = np.array(run.progress.reached_s[: len(run.mission.waypoints_m)])
    goals = run.mission.waypoints_m[: len(reached)]
    times = np.concatenate([[run.time_s[0]], reached])
    corners = np.concatenate([run.states[:1, :3], goals])
    for axis, (axes, name) in enumerate(zip(panels, "xyz", strict=True)):
        axes.plot(times, corners[:, axis], "--", color=WAYPOINT, label="straight between waypoints")
        axes.plot(run.time_s, run.states[:, axis], color=EXECUTED, label="flown")
        axes.plot(reached, goals[:, axis], "s", color=WAYPOINT, label="waypoint reached")
        for number, (when, value) in enumerate(zip(reached, goals[:, axis], strict=True), start=1):
            axes.annotate(
                str(number),
                (when, value),
                xytext=(6, 4),
                textcoords="offset points",
                color=WAYPOINT,
            )
        axes.set_ylabel(f"{name} (m)")
        axes.grid(alpha=0.25)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels(panels)
    panels[-1].set_xlabel("time (s)")
    tracking = run.metrics.tracking_m
    figure.suptitle(
        f"{run.mission.name}: coordinates against the straight legs\n"
        f"off the legs by {tracking.mean():.2f} m on average, {tracking.max():.2f} m at most"
    )
    return figure
