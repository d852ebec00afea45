"""Parts of pictures of a vehicle with inertia: its track by speed, sight and escapes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from clearway.avoidance.decision import Decision
from clearway.avoidance.speed_choice import Sight
from clearway.base.frames import FloatArray
from clearway.view.plot.flight import DASHES, ESCAPE_COLOUR

MAP = "viridis"
SEEN_FREE = "#cfe8d5"


def measure_speeds(time_s: FloatArray, places_m: FloatArray) -> FloatArray:
    """Return the speed [n - 1] between places [n, 3] at times [n]."""
    moved_m = np.linalg.norm(np.diff(places_m, axis=0), axis=1)
    return np.asarray(moved_m / np.maximum(np.diff(time_s), 1e-9))


def draw_speed(
    axes: Axes, places: FloatArray, speed_mps: FloatArray, fastest_mps: float
) -> LineCollection:
    """Draw a track [n, 2] in the colours of its speeds [n - 1]."""
    lines = LineCollection(
        list(np.stack([places[:-1], places[1:]], axis=1)),
        cmap=MAP,
        norm=Normalize(0.0, fastest_mps),
        linewidth=3.0,
        capstyle="round",
    )
    lines.set_array(speed_mps)
    axes.add_collection(lines)
    return lines


def draw_sight(axes: Axes, decision: Decision, sight: Sight | None, reach_m: float) -> None:
    """Fill observed free space around a decision, at its height, so far from the vehicle."""
    if sight is None:
        return
    place, directions = decision.state.position_m, sight.azimuths_rad
    edge = np.minimum(sight.free_m, reach_m)[:, None] * np.stack(
        [np.cos(directions), np.sin(directions)], axis=1
    )
    edge = edge + place[:2]
    axes.fill(edge[:, 0], edge[:, 1], color=SEEN_FREE, zorder=0.3, label="observed free space")


def draw_escape(axes: Axes, decision: Decision, *, named: bool = True, wide: float = 2.0) -> None:
    """Draw the chain that brakes to rest after the first movement, and where it stops."""
    path = decision.way_out_path_m
    if not len(path):
        return
    axes.plot(
        path[:, 0],
        path[:, 1],
        color=ESCAPE_COLOUR,
        linewidth=wide,
        linestyle=DASHES,
        label="escape: brakes to rest" if named else None,
        zorder=3,
    )
    axes.plot(*path[-1, :2], "s", color=ESCAPE_COLOUR, markersize=2.0 + 2.0 * wide, zorder=3)


def measure_braking(decision: Decision) -> FloatArray:
    """Return [n, 2] distance (m) and speed (m/s) at the ends of movements: the first one of the
    plan, then the escape, until the vehicle stands."""
    automaton, way = decision.found_again.planner.automaton, decision.way_out
    classes = automaton.classes
    assert classes is not None
    lasts_s = automaton.movements[0].duration_s
    at = classes.class_at(float(decision.state.attitude_rad[0]))
    rows = [(0.0, float(classes.speed_mps[at]))]
    begins = () if way is None else way.begins
    first = () if decision.escapes or decision.under_way_s is not None else decision.movements[:1]
    for name in (*first, *begins):
        at = classes.after(at, classes.names.index(name))
        away, before = rows[-1]
        speed = float(classes.speed_mps[at])
        rows.append((away + 0.5 * (before + speed) * lasts_s, speed))
    return np.array(rows)


def measure_plan(decision: Decision) -> FloatArray:
    """Return [n, 2] distance (m) and speed (m/s) at the ends of the movements of a plan."""
    speed = decision.speed
    assert speed is not None
    lasts_s = decision.found_again.planner.automaton.movements[0].duration_s
    speeds = np.array([speed.now_mps, *speed.plan_mps])
    steps = 0.5 * (speeds[1:] + speeds[:-1]) * lasts_s
    return np.column_stack([np.concatenate([[0.0], np.cumsum(steps)]), speeds])
