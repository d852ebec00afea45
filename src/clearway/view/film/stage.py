"""The picture that moves: from above, from the side, and how near things are, at any time."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon

from clearway.base.frames import FloatArray
from clearway.view.film.scenes import Scenes
from clearway.view.plot.flight import DASHES, ESCAPE_COLOUR, EXECUTED, PLANNED, SEEN, WAYPOINT
from clearway.view.plot.ground_plan import PIXELS, draw_ground_plan
from clearway.view.plot.playback import MODES
from clearway.view.plot.style import OWN

SIZE_IN = (9.6, 5.4)
WHOLE = 8.0
"""A flight of up to so many ranges is shown whole; the view follows the vehicle of a longer one."""
BESIDE = 1.6
"""Ranges shown on either side of a vehicle that is followed."""
SPARE = 0.06
"""About a flight that is shown whole, of its longer side."""
SHAPE = 1.35
"""Width of the view from above by its height."""
SHARPEST = 900
"""Pixels of the map of obstacles, at most."""
VEHICLE = 0.022
"""Half of its length, as a share of the view."""
INTRUDER = "#d55e00"
LETTERS = 114
LINES = 2
"""Of the explanation."""


class Stage:
    """One figure, and what of it changes from moment to moment."""

    def __init__(self, scenes: Scenes) -> None:
        self.scenes = scenes
        self.figure = Figure(figsize=SIZE_IN, layout="constrained")
        grid = self.figure.add_gridspec(3, 2, width_ratios=[1.7, 1.0], height_ratios=[1, 1, 0.16])
        self.above = self.figure.add_subplot(grid[:2, 0])
        self.height = self.figure.add_subplot(grid[0, 1])
        self.near = self.figure.add_subplot(grid[1, 1], sharex=self.height)
        words = self.figure.add_subplot(grid[2, :])
        words.axis("off")
        self.words = words.text(
            0.022, 0.9, "", va="top", fontsize=8.5, color="#222222", transform=words.transAxes
        )
        self.mode = words.plot([0.008], [0.62], "s", markersize=9, transform=words.transAxes)[0]
        self.figure.suptitle(scenes.title, fontsize=11, fontweight="bold")
        self._follows, self._centre_m, self._half_m = _view(scenes)
        self._set_above()
        self._set_curves()
        handles, labels = self.above.get_legend_handles_labels()
        handles[0] = Line2D([], [], color=SEEN, marker="o", markersize=4, linestyle="none")
        self.figure.legend(
            handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8,
            frameon=False,
        )  # fmt: skip
        self.show(float(scenes.time_s[0]))
        # Where everything stands is settled once: else it would waver from frame to frame.
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")

    def _set_above(self) -> None:
        scenes, axes = self.scenes, self.above
        draw_ground_plan(axes, self._stage_m(), scenes.world, scenes.margin_m, self._pixels())
        self.dots = axes.plot([], [], ".", color=SEEN, markersize=1.6, alpha=0.5, label="seen")[0]
        self.flown = axes.plot([], [], color=EXECUTED, linewidth=1.8, label="flown")[0]
        self.plan = axes.plot([], [], color=PLANNED, linewidth=1.6, label="planned")[0]
        self.way = axes.plot(
            [], [], color=ESCAPE_COLOUR, linewidth=1.3, linestyle=DASHES, label="held escape"
        )[0]
        goals = scenes.waypoints_m
        axes.plot(goals[:, 0], goals[:, 1], "s", color=WAYPOINT, markersize=6, label="waypoints")
        self.trails = {
            name: axes.plot([], [], color=INTRUDER, linewidth=1.2, label="intruders" * (not at))[0]
            for at, name in enumerate(scenes.intruders)
        }
        self.bodies = {
            name: Circle((0.0, 0.0), max(radius, VEHICLE * self._half_m), color=INTRUDER, zorder=6)
            for name, radius in (
                (name, scenes.intruder_radius_m.get(name, 0.0)) for name in scenes.intruders
            )
        }
        for body in self.bodies.values():
            axes.add_patch(body)
        self.vehicle = Polygon(np.zeros((4, 2)), color=OWN, zorder=7)
        axes.add_patch(self.vehicle)
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.set_aspect("equal", adjustable="box")
        _look(axes, self._centre_m, self._half_m)

    def _stage_m(self) -> FloatArray:
        """[n, 3] places flown, and the corners of all that is ever shown."""
        flown = self.scenes.place_m
        middles = flown[:, :2] if self._follows else self._centre_m[None]
        half = np.array([self._half_m, self._half_m / SHAPE])
        low, high = middles.min(axis=0) - half, middles.max(axis=0) + half
        corners = np.column_stack([np.stack([low, high]), np.full(2, flown[0, 2])])
        return np.concatenate([flown, corners])

    def _pixels(self) -> int:
        """As sharp where the vehicle is followed as where all is shown."""
        width = float(np.ptp(self._stage_m()[:, :2], axis=0).max())
        return int(min(PIXELS * max(1.0, 0.5 * width / self._half_m), SHARPEST))

    def _set_curves(self) -> None:
        scenes = self.scenes
        self.height.plot(scenes.time_s, scenes.place_m[:, 2], color=EXECUTED, linewidth=1.4)
        self.height.set_ylabel("height z (m)")
        low, high = scenes.place_m[:, 2].min(), scenes.place_m[:, 2].max()
        spare = max(0.5 * scenes.margin_m, 0.1 * (high - low))
        self.height.set_ylim(low - spare, high + spare)
        finite = np.isfinite(scenes.nearest_m)
        top = 8.0 * scenes.margin_m
        self.near.plot(
            scenes.time_s, np.where(finite, scenes.nearest_m, np.nan), color=EXECUTED, linewidth=1.4
        )
        self.near.axhline(scenes.margin_m, color=PLANNED, linestyle="--", linewidth=1.0)
        self.near.annotate(
            f"margin {scenes.margin_m:g} m", (1.0, scenes.margin_m), color=PLANNED, fontsize=8,
            xycoords=("axes fraction", "data"), xytext=(-2, 2), textcoords="offset points",
            horizontalalignment="right",
        )  # fmt: skip
        least = float(scenes.nearest_m[finite].min()) if finite.any() else 0.0
        self.near.set_ylim(min(0.0, least), max(top, 1.3 * least))
        self.near.set_ylabel("to the nearest (m)")
        self.near.set_xlabel("time (s)")
        self.cursors = [
            axes.axvline(0.0, color="#555555", linewidth=0.9) for axes in (self.height, self.near)
        ]
        for axes in (self.height, self.near):
            axes.grid(alpha=0.25)
        self.figure.align_ylabels([self.height, self.near])

    def show(self, time_s: float) -> None:
        """Make the figure that of a time."""
        scenes = self.scenes
        at = int(np.searchsorted(scenes.time_s, time_s + 1e-6))
        place = np.array([np.interp(time_s, scenes.time_s, axis) for axis in scenes.place_m.T])
        yaw = float(np.interp(time_s, scenes.time_s, scenes.yaw_rad))
        flown = np.concatenate([scenes.place_m[:at], place[None]])
        self.flown.set_data(flown[:, 0], flown[:, 1])
        known = scenes.seen_m[: int(np.searchsorted(scenes.seen_s, time_s + 1e-6))]
        self.dots.set_data(known[:, 0], known[:, 1])
        decision = scenes.decision_at(time_s) or {}
        _set_path(self.plan, decision.get("path_m"))
        _set_path(self.way, decision.get("way_out_m"))
        self.vehicle.set_xy(_arrow(place, yaw, VEHICLE * 2.0 * self._half_m))
        for name, line in self.trails.items():
            trail = scenes.trail(name, time_s)
            line.set_data(trail[:, 0], trail[:, 1])
            self.bodies[name].set_visible(bool(len(trail)))
            if len(trail):
                self.bodies[name].set_center((float(trail[-1, 0]), float(trail[-1, 1])))
        if self._follows:
            _look(self.above, place[:2], self._half_m)
        for cursor in self.cursors:
            cursor.set_xdata([time_s, time_s])
        self._say(time_s, decision)

    def _say(self, time_s: float, decision: Mapping[str, Any]) -> None:
        mode = str(decision.get("mode", "no decision yet"))
        why = str(decision.get("explanation", ""))
        said = f"{time_s:.1f} s   {why if why.startswith(mode) else f'{mode}: {why}'}"
        lines = textwrap.wrap(said, LETTERS, max_lines=LINES, placeholder=" ...")
        self.words.set_text("\n".join(lines))
        self.mode.set_color(MODES.get(mode, "#bbbbbb"))


def _view(scenes: Scenes) -> tuple[bool, FloatArray, float]:
    """Whether the vehicle is followed, the middle [2] of the first view and half of its width."""
    places = np.concatenate([scenes.place_m, scenes.waypoints_m])[:, :2]
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = (float(side) for side in high - low)
    if max(width, height) > WHOLE * scenes.range_m:
        return True, scenes.place_m[0, :2], BESIDE * scenes.range_m
    spare = SPARE * max(width, height) + 1.0
    half = max(0.5 * width + spare, SHAPE * (0.5 * height + spare))
    return False, 0.5 * (low + high), half


def _look(axes: Axes, place: FloatArray, half_m: float) -> None:
    axes.set_xlim(place[0] - half_m, place[0] + half_m)
    axes.set_ylim(place[1] - half_m / SHAPE, place[1] + half_m / SHAPE)


def _set_path(line: Line2D, path: Sequence[Sequence[float]] | None) -> None:
    places = np.array(path or [], dtype=np.float64).reshape(-1, 3)
    line.set_data(places[:, 0], places[:, 1])


def _arrow(place: FloatArray, yaw_rad: float, length_m: float) -> FloatArray:
    """[4, 2] corners of an arrowhead that points where the nose does."""
    shape = np.array([[1.0, 0.0], [-0.8, 0.65], [-0.4, 0.0], [-0.8, -0.65]]) * length_m
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    turned: FloatArray = shape @ np.array([[cos, sin], [-sin, cos]])
    return turned + place[:2]
