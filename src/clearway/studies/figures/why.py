"""Picture of the last decisive seconds of a flight: from above, and distance over time."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from clearway.base.frames import FloatArray
from clearway.studies.why.causes import Answer, CrashCause
from clearway.studies.why.ending import Event
from clearway.studies.why.explain import Explained
from clearway.studies.why.words import explain_because
from clearway.view.plot.style import OWN, halo

FLOWN = "#333333"
DANGER = "#d62728"
SEEN = "#6f6f6f"
LATER = "#cfcfcf"
WIDEST_S = 16.0
BEFORE_SIGHT_S = 2.0
"""Of flight that are drawn at most, and before the first sight."""
LEVEL_SHARE = 3.0
LEAST_LEVEL_M = 1.5
"""Returns within so many margins of the height of the danger are drawn, or so many metres."""
MOST_POINTS = 6000
CAPTION_LETTERS = 150
"""In a line below both pictures."""
LABEL_HEIGHTS = 0.62, 0.3
"""Of the words beside vertical lines, in turn: two of them may be near each other."""
BODY_LABEL = 0.14
"""Where the body's label begins, along the axis: the margin's may be at its height."""


def draw_why(explained: Explained) -> Figure:
    """What was flown, what was seen of the danger when, and what clearway would have flown."""
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    above, over_time = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
    figure.suptitle(_title(explained), fontsize="large", x=0.01, ha="left")
    if explained.answer.cause is not CrashCause.NONE:
        because = textwrap.fill(f"because {explain_because(explained)}", CAPTION_LETTERS)
        figure.supxlabel(because, fontsize="medium", x=0.01, ha="left")
    times = _choose_drawn_times(explained)
    _draw_above(above, explained, times)
    _draw_distances(over_time, explained, times)
    return figure


def _title(explained: Explained) -> str:
    answer = explained.answer
    end = f"{answer.ending.event} at {answer.ending.time_s - explained.start_s:.1f} s"
    acted = answer.acted
    if answer.cause is CrashCause.NONE or acted is None:
        return f"{answer.cause}: {end}"
    at = f"{acted.time_s - explained.start_s:.1f} s"
    only = "" if acted.kept_m > explained.judge.body_m else "only "
    return (
        f"{answer.cause}: {end}; clearway would have {acted.manoeuvre} at {at} "
        f"and kept {only}{max(acted.kept_m, 0.0):.1f} m"
    )


def _choose_drawn_times(explained: Explained) -> FloatArray:
    """Times of the poses that are drawn."""
    answer, track = explained.answer, explained.flight.track
    end_s, sights = answer.ending.time_s, answer.evidence.sights
    since_s = sights[0].time_s - BEFORE_SIGHT_S if sights else end_s - WIDEST_S
    since_s = max(min(since_s, end_s - 4.0), end_s - WIDEST_S)
    drawn = (track.time_s >= since_s) & (track.time_s <= end_s + 1e-9)
    return np.asarray(track.time_s[drawn])


def _draw_above(axes: Axes, explained: Explained, times: FloatArray) -> None:
    answer, judge = explained.answer, explained.judge
    ending = answer.ending
    way = _places(explained, times)
    _draw_returns(axes, explained, times)
    axes.plot(way[:, 0], way[:, 1], color=FLOWN, lw=2.4, label="flown", zorder=4)
    _draw_heading(axes, way, FLOWN)
    acted = answer.acted
    if acted is not None and len(acted.way_m):
        _draw_plan(axes, explained, way)
    danger = ending.danger_m
    axes.plot(*danger[:2], marker="X", ms=13, color=DANGER, mec="white", ls="none", zorder=7,
              label="contact" if ending.event is Event.CONTACT else "danger")  # fmt: skip
    axes.add_patch(
        Circle((ending.place_m[0], ending.place_m[1]), judge.body_m, fill=False, color=FLOWN)
    )
    _draw_sight(axes, explained)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_title("from above, at the height of the danger", loc="left", fontsize="medium")
    axes.grid(alpha=0.2)
    axes.legend(loc="upper left", fontsize="small", frameon=True, framealpha=0.9)
    around = np.vstack([way[:, :2], danger[None, :2]])
    spare = 2.0 * judge.margin_m + 0.25 * float(np.ptp(around, axis=0).max())
    low, high = around.min(axis=0) - spare, around.max(axis=0) + spare
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max())
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)


def _draw_returns(axes: Axes, explained: Explained, times: FloatArray) -> None:
    """Returns at the danger's height: those before the end dark, later ones pale; the map too."""
    ending, judge = explained.answer.ending, explained.judge
    height = max(LEVEL_SHARE * judge.margin_m, LEAST_LEVEL_M)
    for late, colour, label in ((False, SEEN, "returns before"), (True, LATER, "returns after")):
        points = [
            one.points_m
            for one in explained.seen
            if len(times) and (one.reading.time_s > ending.time_s) is late
        ]
        level = np.concatenate([np.zeros((0, 3)), *points])
        level = level[np.abs(level[:, 2] - ending.danger_m[2]) <= height]
        level = level[:: max(1, len(level) // MOST_POINTS)]
        if len(level):
            axes.scatter(level[:, 0], level[:, 1], s=5, color=colour, label=label, lw=0)
    shapes = judge.setup.obstacle_map
    if len(shapes.obstacles):
        _draw_map(axes, explained)


def _draw_map(axes: Axes, explained: Explained) -> None:
    """Outline of what the map shows."""
    end, charted = explained.answer.ending, explained.judge.setup.obstacle_map
    reach = 2.5 * explained.judge.needed_m
    x = np.linspace(end.danger_m[0] - reach, end.danger_m[0] + reach, 160)
    y = np.linspace(end.danger_m[1] - reach, end.danger_m[1] + reach, 160)
    mesh = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    level = np.column_stack([mesh, np.full(len(mesh), end.danger_m[2])])
    away = charted.distance_m(level).reshape(160, 160)
    if away.min() < 0.0 < away.max():
        axes.contour(x, y, away, levels=[0.0], colors="#b8860b", linewidths=1.6, linestyles="--")
        axes.plot([], [], color="#b8860b", ls="--", label="map")


def _draw_plan(axes: Axes, explained: Explained, way: FloatArray) -> None:
    """What clearway would have flown, as far as the picture goes, and where it begins."""
    acted = explained.answer.acted
    assert acted is not None
    reach = 1.5 * float(np.ptp(way[:, :2], axis=0).max()) + explained.judge.needed_m
    plan = acted.way_m[np.linalg.norm(acted.way_m - acted.way_m[0], axis=1) <= reach]
    axes.plot(plan[:, 0], plan[:, 1], color=OWN, lw=2.4, ls="-", zorder=5, label="clearway")
    axes.plot(*plan[0, :2], marker="o", ms=7, color=OWN, mec="white", zorder=6)
    _draw_heading(axes, plan, OWN)


def _draw_heading(axes: Axes, way: FloatArray, colour: str) -> None:
    """An arrow in the middle of a way."""
    middle = len(way) // 2
    before = way[max(0, middle - max(1, len(way) // 20)), :2]
    if np.linalg.norm(way[middle, :2] - before) > 1e-6:
        arrow = {"arrowstyle": "-|>", "color": colour, "mutation_scale": 18}
        tip = (float(way[middle, 0]), float(way[middle, 1]))
        axes.annotate("", tip, (float(before[0]), float(before[1])), zorder=6, arrowprops=arrow)


def _draw_sight(axes: Axes, explained: Explained) -> None:
    """The line of the first sight, with its time."""
    answer, sights = explained.answer, explained.answer.evidence.sights
    if not sights:
        return
    state = explained.flight.track.at(sights[0].time_s)
    if state is None:
        return
    danger = answer.ending.danger_at(sights[0].time_s)
    axes.plot(
        [state.position_m[0], danger[0]], [state.position_m[1], danger[1]], color=DANGER, lw=1.0,
        ls=":", zorder=3,
    )  # fmt: skip
    at = f"first sight: {sights[0].time_s - explained.start_s:.1f} s, {sights[0].away_m:.1f} m away"
    axes.plot(*state.position_m[:2], marker="s", ms=7, color=DANGER, mec="white", zorder=6,
              ls="none", label=at)  # fmt: skip


def _draw_distances(axes: Axes, explained: Explained, times: FloatArray) -> None:
    """Distance to the danger as flown, and what each of clearway's decisions would have kept."""
    answer, judge, start = explained.answer, explained.judge, explained.start_s
    ending = answer.ending
    places = _places(explained, times)
    dangers = np.array([ending.danger_at(float(time_s)) for time_s in times]).reshape(-1, 3)
    away = np.linalg.norm(places - dangers, axis=1) - ending.radius_m
    axes.plot(times - start, away, color=FLOWN, lw=2.4, label="flown: to the danger")
    _draw_decisions(axes, explained, times)
    axes.axhline(judge.margin_m, color=SEEN, lw=0.9, ls=":")
    axes.axhline(judge.body_m, color=DANGER, lw=0.9, ls=":")
    axes.axhline(judge.needed_m, color=SEEN, lw=0.9, ls="--")
    for height, word, along in (
        (judge.needed_m, "needed to see it", 0.01), (judge.margin_m, "margin", 0.01),
        (judge.body_m, "body", BODY_LABEL),
    ):  # fmt: skip
        axes.annotate(word, (along, height), xycoords=("axes fraction", "data"), ha="left",
                      va="bottom", fontsize="small", path_effects=halo())  # fmt: skip
    _mark_times(axes, answer, start)
    highest = max(1.15 * float(away.max(initial=1.0)), 1.3 * judge.needed_m)
    axes.set_ylim(-0.02 * highest, highest)
    axes.set_xlabel("time of flight (s)")
    axes.set_ylabel("distance (m)")
    axes.grid(alpha=0.2)
    axes.legend(loc="upper right", fontsize="small", frameon=True, framealpha=1.0)


def _draw_decisions(axes: Axes, explained: Explained, times: FloatArray) -> None:
    """What each of clearway's decisions would have kept; those that would have hit in red."""
    body, start = explained.judge.body_m, explained.start_s
    shown = [one for one in explained.answer.decisions if len(times) and one.time_s >= times[0]]
    at = np.array([one.time_s - start for one in shown])
    kept = np.array([max(one.kept_m, 0.0) for one in shown])
    axes.plot(at, kept, color=OWN, lw=0.8, alpha=0.5)
    clear = np.array([one.kept_m > body for one in shown], dtype=bool)
    for chosen, colour, label in (
        (clear, OWN, "clearway acting then: least distance kept"),
        (~clear, DANGER, "acting then, it would have hit"),
    ):
        if chosen.any():
            axes.scatter(at[chosen], kept[chosen], color=colour, s=22, zorder=4, label=label)


def _mark_times(axes: Axes, answer: Answer, start: float) -> None:
    marks = [(answer.ending.time_s, DANGER, str(answer.ending.event))]
    if answer.evidence.sights:
        marks.append((answer.evidence.sights[0].time_s, DANGER, "first sight"))
    for one in answer.evidence.silent:
        if np.isfinite(one.last_s):
            marks.append((one.last_s, FLOWN, f"{one.sensor} silent"))
    if answer.last_clear is not None:
        marks.append((answer.last_clear.time_s, OWN, "last way clear"))
    low, _ = axes.get_xlim()
    seen = sorted(mark for mark in marks if mark[0] - start >= low)
    for number, (time_s, colour, word) in enumerate(seen):
        axes.axvline(time_s - start, color=colour, lw=1.0, alpha=0.7)
        height = LABEL_HEIGHTS[number % 2]
        axes.annotate(word, (time_s - start, height), xycoords=("data", "axes fraction"),
                      rotation=90, ha="right", va="center", fontsize="small", color=colour,
                      path_effects=halo())  # fmt: skip


def _places(explained: Explained, times: FloatArray) -> FloatArray:
    track = explained.flight.track
    chosen = np.isin(track.time_s, times)
    return np.asarray(track.position_m[chosen])
