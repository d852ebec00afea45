"""The cone in which an intruder may be: in space, across its flight, and in the grid."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.view.plot.flight import grid_outline
from clearway.view.plot.space import name_height

LINE = "#1f3fd6"
DEVIATED = "#2e9e4f"
EDGE = "#c1272d"
START = "#222222"
PROBABLE = (0.5, 0.4)
"""The position that is drawn as one of the probable ones, in semi-axes."""


def draw_position(
    start_m: FloatArray,
    along: FloatArray,
    distance_m: float,
    semi_axes_m: FloatArray,
    title: str,
) -> Figure:
    """The straight line, the ellipse at its end, and one probable position in it (fig. 5.1)."""
    figure = Figure(figsize=(8.5, 6.5), layout="constrained")
    figure.suptitle(title)
    axes = figure.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    center = start_m + distance_m * along
    across, up = _axes_of(along)
    rim = center + _rim(semi_axes_m, across, up)
    probable = center + PROBABLE[0] * semi_axes_m[0] * across + PROBABLE[1] * semi_axes_m[1] * up
    axes.plot(*np.stack([start_m, center], axis=1), color=LINE, label="straight line")
    axes.plot(*np.stack([start_m, probable], axis=1), color=DEVIATED, ls="--", lw=1.0)
    axes.plot(*rim.T, color=EDGE, label="ellipse (5.17)")
    axes.plot(*start_m, "o", color=START, label="detected here")
    axes.plot(*center, "o", color=LINE, label="expected position")
    axes.plot(*probable, "o", color=DEVIATED, label="a probable position")
    axes.set(xlabel="x ahead (m)", ylabel="y left (m)")
    name_height(axes, "z up (m)")
    _to_one_scale(axes, np.concatenate([rim, start_m[None]]))
    axes.view_init(elev=18.0, azim=-20.0)
    figure.legend(loc="outside lower center", ncols=5, frameon=False)
    return figure


def draw_on_ellipse(
    offsets_m: FloatArray, values: FloatArray, semi_axes_m: FloatArray, label: str, title: str
) -> Figure:
    """Values [n] at offsets [n, 2] across the flight, and the ellipse around them."""
    figure = Figure(figsize=(8.5, 6.5), layout="constrained")
    figure.suptitle(title)
    axes = figure.add_subplot()
    width = 6.0 if len(offsets_m) > 5000 else 30.0
    dots = axes.scatter(
        offsets_m[:, 0], offsets_m[:, 1], c=values, s=width, marker="s" if width < 10 else "o"
    )
    axes.add_patch(Ellipse((0.0, 0.0), *(2.0 * semi_axes_m), fill=False, edgecolor=EDGE, lw=1.5))
    axes.plot(0, 0, "+", color=START, ms=12)
    figure.colorbar(dots, ax=axes, label=label, shrink=0.8)
    axes.set(xlabel="across the flight (m)", ylabel="up (m)", aspect="equal")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def draw_cone_in_grid(
    grid: AvoidanceGrid,
    met: BoolArray,
    start_m: FloatArray,
    along: FloatArray,
    growth: FloatArray,
    title: str,
) -> Figure:
    """The grid's outline, the cone, and the centres of the cells that it meets (fig. 5.3).

    growth: [2] semi-axes per metre of flight.
    """
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    figure.suptitle(title)
    axes = figure.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    for number, line in enumerate(grid_outline(grid)):
        axes.plot(*line.T, color=LINE, lw=0.9, label="" if number else "avoidance grid")
    across, up = _axes_of(along)
    far = 16.0
    for distance in np.linspace(2.0, far, 8):
        rim = start_m + distance * along + _rim(distance * growth, across, up)
        axes.plot(*rim.T, color=EDGE, lw=0.8, label="cone" if distance == far else "")
    for ray in _rim(far * growth, across, up)[::12]:
        end = start_m + far * along + ray
        axes.plot(*np.stack([start_m, end], axis=1), color=EDGE, lw=0.6)
    axes.plot(*grid.centers_m[met].T, ".", color="#8a5a00", ms=4, label="cells met")
    axes.plot(*start_m, "o", color=START, label="intruder")
    axes.set(xlabel="x ahead (m)", ylabel="y left (m)")
    name_height(axes, "z up (m)")
    _to_one_scale(axes, np.array([[0.0, -9.0, -6.0], [12.0, 9.0, 6.0]]))
    axes.view_init(elev=28.0, azim=-60.0)
    figure.legend(loc="outside lower center", ncols=4, frameon=False)
    return figure


def _axes_of(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Level across a level flight, and up."""
    up = np.array([0.0, 0.0, 1.0])
    return np.cross(up, along), up


def _rim(semi_axes_m: FloatArray, across: FloatArray, up: FloatArray) -> FloatArray:
    """[n, 3] offsets round an ellipse."""
    turn = np.linspace(0.0, 2.0 * np.pi, 97)[:, None]
    rim: FloatArray = semi_axes_m[0] * np.cos(turn) * across + semi_axes_m[1] * np.sin(turn) * up
    return rim


def _to_one_scale(axes: Axes3D, points_m: FloatArray) -> None:
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    room = 0.5
    axes.set(
        xlim=(low[0] - room, high[0] + room),
        ylim=(low[1] - room, high[1] + room),
        zlim=(low[2] - room, high[2] + room),
    )
    axes.set_box_aspect(tuple(high - low + 2.0 * room))
