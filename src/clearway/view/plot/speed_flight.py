"""Pictures of a flight with inertia: how fast, where, and what kept it from being faster."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from clearway.avoidance.decision import Decision
from clearway.avoidance.speed_choice import SpeedChoice, SpeedLimit
from clearway.base.brief import runs
from clearway.base.frames import FloatArray
from clearway.sim import LoggedDecision, Run, is_clearway_run
from clearway.sim.pilot import Steering
from clearway.view.plot.flight import DASHES, ESCAPE_COLOUR, PLANNED
from clearway.view.plot.ground_plan import draw_ground_plan
from clearway.view.plot.speed_track import (
    MAP,
    SEEN_FREE,
    draw_escape,
    draw_sight,
    draw_speed,
    measure_braking,
    measure_plan,
    measure_speeds,
)
from clearway.view.plot.style import halo

SEEN = "#5a4634"
WAYPOINT = "#2e9e4f"
CAP = "#088c82"
LIMITS = {
    SpeedLimit.SIGHT: ("#088c82", "sight"),
    SpeedLimit.CLEARANCE: ("#d55e00", "clearance"),
    SpeedLimit.WAY: ("#e6b800", "the turns"),
    SpeedLimit.GOAL: ("#2e9e4f", "the goal"),
    SpeedLimit.GAINING: ("#9fc5e8", "acceleration"),
    SpeedLimit.GREATEST: ("#1f5fbf", "greatest speed"),
    SpeedLimit.ESCAPE: ("#8e44ad", "escape flown"),
}
"""Colour and short name of what limits the speed."""
MOST_ESCAPES = 12
"""In a picture of a whole flight."""
AROUND_M = 6.0
"""Shown about the track, at least."""
WIDE_IN = 12.5
MAP_WIDE_IN = 11.3
LEAST_DEEP_IN = 1.5
"""Width of a picture and of the view from above in it, and the least depth of that."""
TICK_S = 5.0
"""Between the times named along a track."""
NEAR = 1.25
LEAST_AROUND_M = 12.0
"""Shown about a decision, as a multiple of what it sees ahead, and at least."""
BAND_M = 0.6
"""Returns so far above or below the vehicle are drawn."""
MOST_DOTS = 6_000
PIXELS = 900
"""Along the longer side of the world seen from above."""


def has_speeds(run: Run[Steering]) -> bool:
    """Whether a flight is of a vehicle with inertia, decided by clearway."""
    if not is_clearway_run(run) or not run.decisions:
        return False
    return run.decisions[0].flight.decision.speed is not None


def draw_speed_flight(run: Run, title: str) -> Figure:
    """Draw the whole way from above, its speed with what limits it, and its height."""
    track, speeds = run.states[:, :3], measure_speeds(run.time_s, run.states[:, :3])
    fastest = _speed_of(run.decisions[0]).greatest_mps
    shown = [run.decisions[at].flight.decision for at in _few(len(run.decisions), MOST_ESCAPES)]
    escapes = [one.way_out_path_m[:, :2] for one in shown]
    low, high = _limits(np.concatenate([track[:, :2], run.mission.waypoints_m[:, :2], *escapes]))
    deep = max(MAP_WIDE_IN * float((high - low)[1] / (high - low)[0]), LEAST_DEEP_IN)
    figure = Figure(figsize=(WIDE_IN, deep + 5.6), layout="constrained")
    figure.suptitle(title)
    above, fast, tall = figure.subplots(3, 1, height_ratios=[deep, 2.3, 1.1])
    tall.sharex(fast)
    _draw_world(above, run, low, high, track)
    for number, one in enumerate(shown):
        draw_escape(above, one, named=number == 0, wide=1.2)
    draw_speed(above, track[:, :2], speeds, fastest)
    _mark_times(above, run)
    _mark_goals(above, run)
    _frame_above(above, low, high)
    colours = ScalarMappable(draw_speed(above, track[:1, :2], speeds[:0], fastest).norm, MAP)
    figure.colorbar(colours, ax=above, label="speed (m/s)", pad=0.01, aspect=14)
    _draw_speeds(fast, run, speeds, fastest)
    tall.plot(run.time_s, track[:, 2], color="#1f5fbf")
    tall.set(xlabel="time (s)", ylabel="height z (m)")
    tall.margins(y=0.15)
    tall.grid(alpha=0.25)
    figure.align_ylabels([fast, tall])
    _legend(figure, (above, fast))
    return figure


def draw_speed_moment(run: Run, index: int, title: str) -> Figure:
    """Draw one decision from above: what it saw to be free, its plan and its escape; beside it how
    fast both are along their way, and in words why not faster."""
    entry: LoggedDecision = run.decisions[index]
    decision, sight, speed = entry.flight.decision, entry.sight, _speed_of(entry)
    figure = Figure(figsize=(12.5, 7.4), layout="constrained")
    figure.suptitle(title)
    above, beside = figure.subplots(1, 2, width_ratios=[1.6, 1.0])
    reach = max(NEAR * (0.0 if sight is None else sight.ahead_m), LEAST_AROUND_M)
    place, flown = decision.state.position_m, run.time_s <= entry.flight.time_s + 1e-9
    track, fastest = run.states[flown, :3], speed.greatest_mps
    speeds = measure_speeds(run.time_s[flown], track)
    shown = np.concatenate([decision.path_m, decision.way_out_path_m])[:, :2]
    low = np.minimum(place[:2] - reach, shown.min(axis=0) - 1.0)
    high = np.maximum(place[:2] + reach, shown.max(axis=0) + 1.0)
    _draw_world(above, run, low, high, place[None])
    draw_sight(above, decision, sight, reach)
    _draw_returns(above, decision, low, high)
    near = _last_within(track, low, high)
    lines = draw_speed(above, track[near:, :2], speeds[near:], fastest)
    above.plot(*decision.path_m[:, :2].T, color=PLANNED, linewidth=2.2, label="planned")
    draw_escape(above, decision)
    above.plot(*place[:2], "o", color="black", markersize=7, label="vehicle", zorder=4)
    _mark_goals(above, run)
    _frame_above(above, low, high)
    above.set_title(fill(speed.in_words, 64), fontsize=11)
    figure.colorbar(lines, ax=above, label="speed flown (m/s)", shrink=0.7, pad=0.01)
    _draw_braking(beside, entry)
    _legend(figure, (above, beside))
    return figure


def _speed_of(entry: LoggedDecision) -> SpeedChoice:
    """Speeds of a decision of a vehicle with inertia."""
    speed = entry.flight.decision.speed
    assert speed is not None
    return speed


def _draw_braking(axes: Axes, entry: LoggedDecision) -> None:
    """Speed along plan and escape, beside how far observed free space reaches."""
    decision, sight, speed = entry.flight.decision, entry.sight, _speed_of(entry)
    plan, escape = measure_plan(decision), measure_braking(decision)
    axes.plot(*plan.T, "o-", color=PLANNED, markersize=5)
    axes.plot(*escape.T, "s", color=ESCAPE_COLOUR, linestyle=DASHES, markersize=5)
    farthest = max(float(plan[-1, 0]), float(escape[-1, 0]), 1.0)
    if sight is not None:
        axes.axvspan(0.0, sight.ahead_m, color=SEEN_FREE, zorder=0)
        name = f"observed free ahead: {sight.ahead_m:.1f} m"
        axes.axvline(sight.ahead_m, color=CAP, linewidth=1.2)
        axes.annotate(
            name, (sight.ahead_m, 0.98), xycoords=("data", "axes fraction"), rotation=90,
            ha="right", va="top", color=CAP, path_effects=halo(),
        )  # fmt: skip
        farthest = max(farthest, sight.ahead_m)
    greatest = f"greatest speed, {speed.greatest_mps:.3g} m/s"
    axes.axhline(speed.greatest_mps, color="#777777", linewidth=1.0, linestyle=":", label=greatest)
    axes.set(xlabel="distance along the way (m)", ylabel="speed (m/s)")
    axes.set(xlim=(0.0, 1.06 * farthest), ylim=(0.0, 1.12 * speed.greatest_mps))
    way, words = decision.way_out, "no escape"
    if way is not None:
        chain = ", then ".join(runs(part) for part in (way.begins, way.loop) if part)
        words = f"escape after its first: {chain}; at rest after {escape[-1, 0]:.1f} m"
    plan_words = f"plan: {runs(decision.movements)}"
    axes.set_title("\n".join(fill(each, 56) for each in (plan_words, words)), fontsize=10)
    axes.grid(alpha=0.25)


def _draw_speeds(axes: Axes, run: Run, speeds: FloatArray, fastest: float) -> None:
    """Speed over time, what sight allows, and by decision what limits it."""
    times = np.array([entry.flight.time_s for entry in run.decisions])
    ends = np.append(times[1:], run.time_s[-1])
    caps = [np.nan if one.sight is None else one.sight.cap_mps for one in run.decisions]
    if np.isfinite(caps).any():
        axes.stairs(caps, [*times, ends[-1]], baseline=None, color=CAP, linewidth=1.3,
                    label="fastest that stops within sight")  # fmt: skip
    axes.axhline(fastest, color="#777777", linestyle=":", linewidth=1.2, label="greatest speed")
    axes.plot(run.time_s[1:], speeds, color="#1f5fbf", linewidth=1.8, label="speed flown")
    high = 0.09 * fastest
    met: dict[str, Rectangle] = {}
    for entry, begin, end in zip(run.decisions, times, ends, strict=True):
        colour, name = LIMITS[_speed_of(entry).limit]
        bar = Rectangle((begin, -1.3 * high), end - begin, high, facecolor=colour)
        axes.add_patch(bar)
        met.setdefault(name, bar)
    for name, bar in met.items():
        bar.set_label(f"limited by {name}")
    axes.set(ylabel="speed (m/s)", ylim=(-1.6 * high, 1.08 * fastest))
    axes.set_xlim(run.time_s[0], run.time_s[-1])
    axes.yaxis.set_major_locator(MaxNLocator(6))
    axes.tick_params(labelbottom=False)
    axes.grid(alpha=0.25)


def _draw_world(
    axes: Axes, run: Run, low: FloatArray, high: FloatArray, places_m: FloatArray
) -> None:
    """What stands at the heights of places [n, 3], with the margin about it."""
    if run.world is None:
        return
    lowest, highest = places_m[:, 2].min(), places_m[:, 2].max()
    corners = np.array([[*low, lowest], [*high, highest]])
    draw_ground_plan(axes, corners, run.world, run.safety_margin_m, PIXELS)


def _last_within(track_m: FloatArray, low: FloatArray, high: FloatArray) -> int:
    """Where the last part of a track [n, 3] begins that lies within limits."""
    beyond = np.any((track_m[:, :2] < low) | (track_m[:, :2] > high), axis=1)
    return int(np.flatnonzero(beyond)[-1]) + 1 if beyond.any() else 0


def _draw_returns(axes: Axes, decision: Decision, low: FloatArray, high: FloatArray) -> None:
    """Returns known at about the vehicle's height."""
    seen = decision.seen_m
    level = np.abs(seen[:, 2] - decision.state.position_m[2]) <= BAND_M
    near = seen[level & np.all((seen[:, :2] >= low) & (seen[:, :2] <= high), axis=1)]
    near = near[:: max(1, len(near) // MOST_DOTS)]
    axes.plot(*near[:, :2].T, ".", color=SEEN, markersize=2.5, label="returns at this height")


def _mark_times(axes: Axes, run: Run) -> None:
    """Name every few seconds along the track."""
    for when in np.arange(TICK_S, run.time_s[-1], TICK_S):
        x, y = run.states[int(np.searchsorted(run.time_s, when)), :2].tolist()
        axes.plot(x, y, "o", color="white", markeredgecolor="black", markersize=4, zorder=4)
        axes.annotate(f"{when:g} s", (x, y), xytext=(0, 7), textcoords="offset points", fontsize=8,
                      ha="center", path_effects=halo(), zorder=5)  # fmt: skip


def _mark_goals(axes: Axes, run: Run) -> None:
    goals = run.mission.waypoints_m
    axes.plot(goals[:, 0], goals[:, 1], "s", color=WAYPOINT, markersize=8, label="waypoints")


def _frame_above(axes: Axes, low: FloatArray, high: FloatArray) -> None:
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x (m)", ylabel="y (m)")
    axes.set_aspect("equal", anchor="W")


def _limits(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What is shown of a flight from above."""
    return places.min(axis=0) - AROUND_M, places.max(axis=0) + AROUND_M


def _few(count: int, most: int) -> list[int]:
    found = np.unique(np.linspace(0.0, count - 1.0, min(count, most)).astype(np.int64))
    return [int(at) for at in found]


def _legend(figure: Figure, panels: tuple[Axes, ...]) -> None:
    handles, labels = [], []
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.append(handle)
            labels.append(label)
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False)
