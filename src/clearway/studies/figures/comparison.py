"""Tracks of several planners in one world, from above, and how near each came to things."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray
from clearway.obstacles.world import World
from clearway.sim import Run
from clearway.sim.baselines import CLEARWAY
from clearway.sim.pilot import Steering
from clearway.view.plot.flight import PLANNED, WAYPOINT
from clearway.view.plot.ground_plan import draw_ground_plan
from clearway.view.plot.style import lines_of

INTRUDER = "#8a8a8a"
SPARE = 0.08
"""Of the longer side, about what was flown; intruders come from farther away."""
WIDE_IN = 11.0
TALL_IN = (2.0, 5.6)
NEAR_IN = 2.6
"""Inches of the view from above, across and at least and most high, and of the distances."""


def draw_tracks(runs: Mapping[str, Run[Steering]], world: World, title: str) -> Figure:
    """Tracks by planner over the obstacles at the heights flown, and distances over time."""
    tracks_m = np.concatenate([run.states[:, :3] for run in runs.values()])
    shown_m = np.concatenate([tracks_m, next(iter(runs.values())).mission.waypoints_m])
    low, high = _limits(shown_m)
    tall = float(np.clip(WIDE_IN * (high - low)[1] / (high - low)[0], *TALL_IN))
    figure = Figure(figsize=(WIDE_IN + 1.0, tall + NEAR_IN + 1.8), layout="constrained")
    figure.suptitle(title)
    above, near = figure.subplots(2, 1, height_ratios=[tall, NEAR_IN])
    draw_ground_plan(above, tracks_m, world, next(iter(runs.values())).safety_margin_m)
    _draw_intruders(above, next(iter(runs.values())), (low, high))
    looks = lines_of(list(runs))
    for planner, run in runs.items():
        alone = planner == CLEARWAY or len(runs) == 1
        _draw_run(above, near, run, planner, (*looks[planner], alone))
    _finish(above, near, next(iter(runs.values())))
    above.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    handles, labels = above.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=min(6, len(labels)), frameon=False
    )
    return figure


def _limits(places_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[2] lowest and highest x, y of what was flown, and where to: nothing of the ways of others
    beyond it."""
    low, high = places_m[:, :2].min(axis=0), places_m[:, :2].max(axis=0)
    spare = SPARE * float((high - low).max()) + 1.0
    return low - spare, high + spare


def _draw_intruders(
    axes: Axes, run: Run[Steering], limits_m: tuple[FloatArray, FloatArray]
) -> None:
    """Where intruders flew during the first flight as far as they came near, with an arrow each."""
    low, high = limits_m
    label: str | None = "intruders, while near"
    for name, whole in run.intruder_tracks.items():
        track = whole[((whole[:, 1:3] >= low) & (whole[:, 1:3] <= high)).all(axis=1)]
        if not len(track):
            continue
        axes.plot(track[:, 1], track[:, 2], color=INTRUDER, linewidth=0.8, zorder=2, label=label)
        label = None
        end = (float(track[-1, 1]), float(track[-1, 2]))
        if len(track) > 1:
            axes.annotate(
                "",
                xy=end,
                xytext=(float(track[-2, 1]), float(track[-2, 2])),
                arrowprops={"arrowstyle": "->", "color": INTRUDER},
            )
        axes.annotate(
            name,
            (float(track[0, 1]), float(track[0, 2])),
            xytext=(4, -9),
            textcoords="offset points",
            color=INTRUDER,
            fontsize=8,
        )


def _draw_run(
    above: Axes, near: Axes, run: Run[Steering], planner: str, style: tuple[str, str, bool]
) -> None:
    """One track; style: colour, line, and whether it is drawn broader, over the others."""
    color, line, broad = style
    width, order = (2.4, 5) if broad else (1.3, 3)
    x, y = run.states[:, 0], run.states[:, 1]
    above.plot(x, y, line, color=color, linewidth=width, label=planner, zorder=order)
    if run.crashed_s is not None:
        at = int(np.searchsorted(run.time_s, run.crashed_s - 1e-9))
        above.plot(x[at], y[at], "X", color=color, markersize=10, markeredgecolor="w", zorder=6)
    nearest = run.nearest_surface_m
    if np.isfinite(nearest).any():
        near.plot(run.time_s, nearest, line, color=color, linewidth=0.75 * width, zorder=order)


def _finish(above: Axes, near: Axes, run: Run[Steering]) -> None:
    goals = run.mission.waypoints_m
    above.plot(
        goals[:, 0], goals[:, 1], "s", color=WAYPOINT, markersize=7, label="waypoints", zorder=7
    )
    above.set_xlabel("x (m)")
    above.set_ylabel("y (m)")
    above.set_aspect("equal", adjustable="box")
    near.axhline(run.safety_margin_m, linestyle="--", color=PLANNED)
    near.annotate(
        f"margin {run.safety_margin_m:g} m",
        (1.0, run.safety_margin_m),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 3),
        textcoords="offset points",
        horizontalalignment="right",
        color=PLANNED,
    )
    near.set_xlabel("time (s)")
    near.set_ylabel("to the nearest surface (m)")
    near.set_ylim(bottom=min(0.0, near.get_ylim()[0]))
    near.grid(alpha=0.25)
