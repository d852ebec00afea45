"""Pictures of a flight in space, from above and from the side (figs. 6.14-6.17).

Executed path blue, planned path red, held escape dashed, field of view dashed black, waypoints
green squares, what the sensors have seen so far as dots: the paper's legend.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.sim import LoggedDecision, Run
from clearway.view.plot.space import (
    Limits,
    clip_line,
    column_in,
    frame_space,
    limits_around,
    name_height,
    stack_views,
    within,
)
from clearway.view.plot.style import halo

EXECUTED = "#1f5fbf"
PLANNED = "#d62728"
SEEN = "#7d6b55"
WAYPOINT = "#2e9e4f"
ESCAPE_COLOUR = "#088c82"
DASHES = (0, (4.0, 1.5))
MOST_WAYS_OUT = 5
"""In a picture of a whole flight."""
MOST_DOTS = 12_000
BEHIND = 0.6
"""How much of what was flown a picture of one moment shows, as a share of the range."""
SPACE_IN = 6.6
"""Inches across for the view in space."""
ARC_POINTS = 12
"""In which an arc of the rim is drawn."""


def snapshot_decisions(run: Run, most: int = 3) -> list[int]:
    """Indices of telling decisions: before each closest approach, the last with much in its way.

    Approaches count when they come nearer than 2.5 times the smallest distance or four margins,
    and lie well apart; at most `most` of them, in the order of flight.
    """
    distance = run.metrics.obstacle_distance_m
    if not run.decisions or not np.isfinite(distance).any():
        return []
    times = np.array([entry.flight.time_s for entry in run.decisions])
    apart = run.metrics.time_s / (2.0 * most + 2.0)
    limit = max(2.5 * float(distance.min()), 4.0 * run.safety_margin_m)
    approaches: list[float] = []
    for at in np.argsort(distance):
        when = float(run.time_s[at])
        if distance[at] > limit or len(approaches) == most:
            break
        if all(abs(when - other) > apart for other in approaches):
            approaches.append(when)
    chosen = []
    for when in sorted(approaches):
        before = np.flatnonzero((times <= when) & (times >= when - apart))
        if len(before):
            blocked = np.array([_count_blocked_cells(run.decisions[index]) for index in before])
            chosen.append(int(before[np.flatnonzero(blocked >= 0.5 * blocked.max())[-1]]))
    return chosen


def _count_blocked_cells(entry: LoggedDecision) -> int:
    reach = entry.flight.decision.reach
    return int(np.count_nonzero(reach.passed & (reach.reachability == 0.0)))


def draw_snapshot(run: Run, index: int | None, title: str) -> Figure:
    """The flight up to one decision in space, from above and from the side; None is the end."""
    entry = run.decisions[-1 if index is None else index]
    until = run.time_s[-1] if index is None else entry.flight.time_s
    flown = run.states[run.time_s <= until + 1e-9, :3]
    seen = _find_seen(run.decisions, until)
    planned = entry.flight.decision.path_m if index is not None else None
    outline = field_of_view(entry) if index is not None else []
    ways = _ways_out(run, index)
    shown = [flown, run.mission.waypoints_m, seen, *ways]
    if planned is not None:  # A moment: what is near.
        reach = BEHIND * entry.flight.decision.cells.evidence.grid.range_m
        near = np.linalg.norm(flown - flown[-1], axis=1) <= reach
        shown = [flown[near], planned, *outline, *ways]
    limits = limits_around(np.concatenate(shown))
    column = column_in(limits)
    figure = Figure(figsize=(SPACE_IN + column, 6.4), layout="constrained")
    figure.suptitle(title)
    panels = figure.add_gridspec(1, 2, width_ratios=[SPACE_IN, column])
    space = figure.add_subplot(panels[0], projection="3d")
    assert isinstance(space, Axes3D)
    _draw_space(space, run, flown, planned, seen, outline, ways, limits)
    above, side = stack_views(figure, panels[1], limits)
    for axes, columns in ((above, (0, 1)), (side, (0, 2))):
        _draw_plane(axes, run, flown, planned, seen, outline, ways, columns)
    handles, labels = above.get_legend_handles_labels()
    handles[0] = Line2D([], [], color=SEEN, marker="o", markersize=4, linestyle="none")
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


def _ways_out(run: Run, index: int | None) -> list[FloatArray]:
    """[n, 3] each: the held escape at a decision, or at a few over the whole flight.

    Those that lead through unobserved space, though strict ones are asked for, are left out.
    """
    entries = run.decisions if index is None else run.decisions[index : index + 1]
    decisions = [entry.flight.decision for entry in entries]
    held = [one for one in decisions if one.way_out is not None and one.way_out.certain]
    if not held:
        return []
    few = np.unique(np.linspace(0.0, len(held) - 1.0, MOST_WAYS_OUT).astype(np.int64))
    return [held[at].way_out_path_m for at in few.tolist()]


def _find_seen(decisions: Sequence[LoggedDecision], until_s: float) -> FloatArray:
    """[n, 3] returns used by the decisions until then, world frame, thinned to a drawable few."""
    used = [entry.flight.decision for entry in decisions if entry.flight.time_s <= until_s + 1e-9]
    ends = np.cumsum([len(decision.seen_m) for decision in used])
    every = max(1, int(ends[-1]) // MOST_DOTS) if used else 1
    # Thinned one by one: those of an hour together would fill the memory.
    clouds = [np.zeros((0, 3))]
    for decision, start in zip(used, [0, *ends.tolist()], strict=False):
        clouds.append(decision.seen_m[-start % every :: every].copy())
    return np.concatenate(clouds)


def field_of_view(entry: LoggedDecision) -> list[FloatArray]:
    """Border lines [m, 3] of the avoidance grid of a decision, world frame."""
    decision = entry.flight.decision
    grid = decision.cells.evidence.grid
    return [decision.frame.world_points(line) for line in grid_outline(grid)]


def grid_outline(grid: AvoidanceGrid) -> list[FloatArray]:
    """Border lines [m, 3] of a grid in its own frame: four rays and the rim."""
    right, left = grid.azimuth_edges_rad[[0, -1]]
    bottom, top = grid.elevation_edges_rad[[0, -1]]
    near, far = grid.range_edges_m[[0, -1]]
    across = np.linspace(right, left, ARC_POINTS)
    up = np.linspace(bottom, top, ARC_POINTS)
    ones = np.ones(ARC_POINTS)
    rim = [
        np.stack([far * ones, across, bottom * ones], axis=1),
        np.stack([far * ones, across, top * ones], axis=1),
        np.stack([far * ones, right * ones, up], axis=1),
        np.stack([far * ones, left * ones, up], axis=1),
    ]
    rays = [
        np.array([[near, azimuth, elevation], [far, azimuth, elevation]])
        for azimuth in (right, left)
        for elevation in (bottom, top)
    ]
    return [cartesian_from_spherical(line) for line in rim + rays]


def _draw_space(
    axes: Axes3D,
    run: Run,
    flown: FloatArray,
    planned: FloatArray | None,
    seen: FloatArray,
    outline: Sequence[FloatArray],
    ways: Sequence[FloatArray],
    limits: Limits,
) -> None:
    axes.plot(*seen[within(seen, limits)].T, ".", color=SEEN, markersize=1.5, alpha=0.35)
    axes.plot(*clip_line(flown, limits).T, color=EXECUTED, linewidth=1.8)
    if planned is not None:
        axes.plot(*planned.T, color=PLANNED, linewidth=1.8)
    for way in ways:
        axes.plot(*way.T, color=ESCAPE_COLOUR, linewidth=1.3, linestyle=DASHES)
    for line in outline:
        axes.plot(*line.T, color="black", linewidth=0.7, linestyle="--")
    goals = run.mission.waypoints_m
    goals = goals[within(goals, limits)]
    axes.plot(*goals.T, "s", color=WAYPOINT, markersize=7)
    for place, label in _labels(run.mission.waypoints_m).items():
        if not within(np.array([place]), limits)[0]:
            continue
        axes.text(*place, f"  {label}", color=WAYPOINT, path_effects=halo())
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    name_height(axes, "z (m)")
    frame_space(axes, limits, zoom=0.94)
    axes.view_init(elev=35.0, azim=-60.0)


def _labels(places: FloatArray) -> dict[tuple[float, ...], str]:
    """Waypoint numbers by place; those that coincide in a view share a label."""
    labels: dict[tuple[float, ...], str] = {}
    for number, place in enumerate(places, start=1):
        key = tuple(round(float(value), 3) for value in place)
        labels[key] = f"{labels[key]}, W{number}" if key in labels else f"W{number}"
    return labels


def _draw_plane(
    axes: Axes,
    run: Run,
    flown: FloatArray,
    planned: FloatArray | None,
    seen: FloatArray,
    outline: Sequence[FloatArray],
    ways: Sequence[FloatArray],
    columns: tuple[int, int],
) -> None:
    a, b = columns
    axes.plot(
        seen[:, a], seen[:, b], ".", color=SEEN, markersize=1.2, alpha=0.3, label="seen so far"
    )
    axes.plot(flown[:, a], flown[:, b], color=EXECUTED, linewidth=1.8, label="executed")
    if planned is not None:
        axes.plot(planned[:, a], planned[:, b], color=PLANNED, linewidth=1.8, label="planned")
    for number, way in enumerate(ways):
        label = ("held escape" if len(ways) == 1 else "escapes") if number == 0 else None
        axes.plot(
            way[:, a], way[:, b], color=ESCAPE_COLOUR, linewidth=1.3, linestyle=DASHES, label=label
        )
    for number, line in enumerate(outline):
        label = "field of view" if number == 0 else None
        axes.plot(line[:, a], line[:, b], "--", color="black", linewidth=0.7, label=label)
    goals = run.mission.waypoints_m[:, [a, b]]
    (low_a, high_a), (low_b, high_b) = axes.get_xlim(), axes.get_ylim()
    shown = np.all((goals >= (low_a, low_b)) & (goals <= (high_a, high_b)), axis=1)
    if shown.any():
        axes.plot(
            *goals[shown].T, "s", color=WAYPOINT, markersize=7, label="waypoints", clip_on=False
        )
    for place, label in _labels(goals).items():
        axes.annotate(
            label,
            (place[0], place[1]),
            xytext=(5, 5),
            textcoords="offset points",
            color=WAYPOINT,
            annotation_clip=True,
            path_effects=halo(),
        )
