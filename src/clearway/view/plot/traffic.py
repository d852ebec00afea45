"""Pictures of flights among traffic: tracks and decision points, collision distance (6.23-6.28)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray
from clearway.obstacles.world import World
from clearway.sim import LoggedDecision, Run
from clearway.sim.metrics import IntruderDistances
from clearway.sim.pilot import Steering
from clearway.view.plot.flight import EXECUTED, PLANNED, WAYPOINT, field_of_view
from clearway.view.plot.flight_curves import finish_distances
from clearway.view.plot.ground_plan import draw_ground_plan, draw_kept_out
from clearway.view.plot.space import Limits, limits_around, stack_views
from clearway.view.plot.style import halo

DECISION = "#12336b"
TRACK = "#d98ab5"
INTRUDER = "#b0125b"
STRAIGHT_COLOUR = "#9a9a9a"
LEGEND_INCHES = 1.7
"""That an entry of the legend takes."""
COURSE_S = 2.0
"""Arrows show where an intruder is after so long, as it reports itself."""


def first_detection(run: Run) -> int | None:
    """Index of the first decision that knows of an intruder."""
    for index, entry in enumerate(run.decisions):
        if len(entry.flight.decision.hazards.moving.radius_m):
            return index
    return None


def draw_traffic(
    run: Run, index: int | None, title: str, world: World, kept_out: World | None = None
) -> Figure:
    """The flight among its intruders up to one decision, from above and from the side.

    kept_out: volumes that rules keep out of.
    """
    until = run.time_s[-1] if index is None else run.decisions[index].flight.time_s
    taken = [entry for entry in run.decisions if entry.flight.time_s <= until + 1e-9]
    limits = limits_around(_choose_shown(run, taken, until, whole=index is None))
    figure = Figure(figsize=_size(limits), layout="constrained")
    figure.suptitle(title)
    above, side = stack_views(figure, figure.add_gridspec(1, 1)[0], limits)
    for axes, columns in ((above, (0, 1)), (side, (0, 2))):
        _draw_view(axes, run, taken, until, columns, whole=index is None)
    draw_ground_plan(above, run.states[:, :3], world, run.safety_margin_m)
    if kept_out is not None:
        draw_kept_out(above, run.states[:, :3], kept_out)
    handles, labels = above.get_legend_handles_labels()
    most = min(len(labels), int(figure.get_size_inches()[0] / LEGEND_INCHES))
    figure.legend(handles, labels, loc="outside lower center", ncols=most, frameon=False)
    return figure


def _size(limits: Limits) -> tuple[float, float]:
    """Inches of a picture that both views fill."""
    wide, deep, high = (limits[1] - limits[0]).tolist()
    tall = (deep + high) / wide
    width = float(np.clip(7.0 / tall, 6.5, 12.0))
    return width, float(np.clip(width * tall, 3.0, 7.0)) + 1.6


def _choose_shown(
    run: Run, taken: list[LoggedDecision], until_s: float, *, whole: bool
) -> FloatArray:
    """[n, 3] places that the picture must hold: all of a flight, or what is near at a moment."""
    flown = run.states[run.time_s <= until_s + 1e-9, :3]
    ends = [track[-1:, 1:] for track in _near_tracks(run, until_s).values()]
    if whole:
        plans = [entry.flight.decision.path_m for entry in taken]
        starts = [track[:1, 1:] for track in _near_tracks(run, until_s).values()]
        return np.concatenate([flown, run.mission.waypoints_m, *plans, *starts, *ends])
    decision, outline = taken[-1].flight.decision, field_of_view(taken[-1])
    near = np.linalg.norm(flown - flown[-1], axis=1) <= decision.cells.evidence.grid.range_m
    return np.concatenate([flown[near], decision.path_m, *outline, *ends])


def _near_tracks(run: Run, until_s: float) -> dict[str, FloatArray]:
    """[n, 4] each: the tracks as far as they are drawn."""
    reach = 1.5 * run.decisions[0].flight.decision.cells.evidence.grid.range_m
    near = {name: _while_near(run, track, reach) for name, track in run.intruder_tracks.items()}
    until = {name: track[track[:, 0] <= until_s + 1e-9] for name, track in near.items()}
    return {name: track for name, track in until.items() if len(track)}


def _draw_view(
    axes: Axes,
    run: Run,
    taken: list[LoggedDecision],
    until_s: float,
    columns: tuple[int, int],
    *,
    whole: bool,
) -> None:
    a, b = columns
    flown = run.states[run.time_s <= until_s + 1e-9, :3]
    _draw_plans(axes, taken if whole else taken[-1:], columns, thin=whole)
    axes.plot(flown[:, a], flown[:, b], color=EXECUTED, linewidth=1.8, label="executed")
    points = np.array([entry.flight.decision.state.position_m for entry in taken])
    axes.plot(
        points[:, a],
        points[:, b],
        "o",
        markerfacecolor="none",
        color=DECISION,
        markersize=5,
        label="decisions",
    )
    _draw_intruders(axes, run, until_s, columns)
    if not whole:
        _draw_courses(axes, taken[-1], columns)
        for number, line in enumerate(field_of_view(taken[-1])):
            label = "field of view" if number == 0 else None
            axes.plot(line[:, a], line[:, b], "--", color="black", linewidth=0.7, label=label)
    goals = run.mission.waypoints_m
    axes.plot(goals[:, a], goals[:, b], "s", color=WAYPOINT, markersize=7, label="waypoints")


def _draw_plans(
    axes: Axes, entries: list[LoggedDecision], columns: tuple[int, int], *, thin: bool
) -> None:
    a, b = columns
    for number, entry in enumerate(entries):
        path = entry.flight.decision.path_m
        axes.plot(
            path[:, a],
            path[:, b],
            color=PLANNED,
            linewidth=0.6 if thin else 1.8,
            alpha=0.5 if thin else 1.0,
            label="planned" if number == 0 else None,
        )


def _draw_intruders(axes: Axes, run: Run, until_s: float, columns: tuple[int, int]) -> None:
    """Positions at past decision times joined, the last one full, within what the flight spans."""
    a, b = columns
    decided = np.array([entry.flight.time_s for entry in run.decisions])
    first = True
    for name, shown in _near_tracks(run, until_s).items():
        at = np.isclose(shown[:, 0, None], decided[None, :], atol=1e-6).any(axis=1)
        places = shown[:, 1:]
        axes.plot(
            places[at][:, a],
            places[at][:, b],
            ".-",
            color=TRACK,
            linewidth=0.8,
            markersize=4,
            label="intruder tracks" if first else None,
        )
        axes.plot(
            places[-1, a],
            places[-1, b],
            "o",
            color=INTRUDER,
            markersize=6,
            label="intruders" if first else None,
        )
        axes.annotate(
            name,
            (places[-1, a], places[-1, b]),
            xytext=(4, 4),
            textcoords="offset points",
            verticalalignment="bottom",
            zorder=6,
            color=INTRUDER,
            fontsize=8,
            annotation_clip=True,
            path_effects=halo(),
        )
        first = False


def _draw_courses(axes: Axes, entry: LoggedDecision, columns: tuple[int, int]) -> None:
    """Where intruders are going, as the decision knows it."""
    frame, moving = entry.flight.decision.frame, entry.flight.decision.hazards.moving
    places = frame.world_points(moving.position_m)
    ways = frame.world_vectors(COURSE_S * moving.velocity_mps)
    for place, way in zip(places[:, columns], ways[:, columns], strict=True):
        axes.annotate(
            "",
            xy=place + way,
            xytext=place,
            arrowprops={"arrowstyle": "->", "color": INTRUDER, "linewidth": 1.2},
        )


def _while_near(run: Run, track: FloatArray, reach_m: float) -> FloatArray:
    """Rows of a track during which the ownship is within reach of the intruder."""
    at = np.minimum(np.searchsorted(run.time_s, track[:, 0] - 1e-9), len(run.time_s) - 1)
    gap = np.linalg.norm(run.states[at, :3] - track[:, 1:], axis=1)
    near = np.flatnonzero(gap <= reach_m)
    return track[: near[-1] + 1] if len(near) else track[:0]


def draw_collision_distance(run: Run[Steering]) -> Figure:
    """Distance to the closest intruder over time, with which one it is (fig. 6.28)."""
    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    axes = figure.add_subplot()
    traffic, straight = run.metrics.intruders, run.metrics.straight
    if traffic is not None:
        if straight is not None:
            axes.plot(
                run.time_s, straight.nearest_m, color=STRAIGHT_COLOUR, label="straight flight"
            )
        _draw_closest(axes, run, traffic)
        margin = float(traffic.margin_m.max())
        axes.axhline(margin, linestyle="--", color=PLANNED, label=f"margin (6.16): {margin:.2f} m")
    title = f"{run.mission.name}: collision distance"
    finish_distances(axes, "distance between centres (m)", title)
    figure.legend(loc="outside lower center", ncols=4, frameon=False)
    return figure


def _draw_closest(axes: Axes, run: Run[Steering], traffic: IntruderDistances) -> None:
    """The distance flown, and which intruder is the closest: at each decision, and by name."""
    nearest, closest = traffic.nearest_m, traffic.closest
    known = np.isfinite(nearest)
    axes.plot(run.time_s[known], nearest[known], color=EXECUTED, label="flown")
    decided = np.searchsorted(run.time_s, [each.flight.time_s - 1e-9 for each in run.decisions])
    at = decided[known[decided]]
    axes.plot(
        run.time_s[at],
        nearest[at],
        "o",
        color=WAYPOINT,
        markersize=4,
        label="closest intruder at a decision",
    )
    changes = np.flatnonzero(known & np.r_[True, np.diff(np.where(known, closest, -1)) != 0])
    for start, end in zip(changes, [*changes[1:], len(nearest)], strict=True):
        if start != changes[0]:
            axes.axvline(run.time_s[start], color=STRAIGHT_COLOUR, linewidth=0.6, linestyle=":")
        lowest = start + int(np.argmin(nearest[start:end]))
        axes.annotate(
            f"{traffic.names[closest[lowest]]}\n{nearest[lowest]:.2f} m",
            (run.time_s[lowest], 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, -6),
            textcoords="offset points",
            horizontalalignment="center",
            verticalalignment="top",
            fontsize=8,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
        )
