"""Limits and labels of views in space, from above and from the side, all to one scale."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.gridspec import SubplotSpec
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray

SPARE = 0.05
SLIMMEST = 0.16
"""Room around what is shown, and the shortest side of a view, as shares of the longest."""
MOST_TICKS = 7
"""Along the longest axis in space."""
LABEL_PAD = 8.0
"""Points between ticks and names of axes in space: letters of either are drawn level."""
VIEWS_HIGH_IN = 4.3
WIDEST_VIEWS_IN = 6.5
SLIMMEST_VIEWS_IN = 3.2
"""Height of two views, and how wide their column is at most and at least."""

Limits = tuple[FloatArray, FloatArray]
"""[3] lowest and highest x, y, z."""


def limits_around(points_m: FloatArray) -> Limits:
    """Limits that hold points [n, 3] with some room, and no side too slim to be seen."""
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    longest = max(float((high - low).max()), 1e-6)
    middle, half = 0.5 * (low + high), 0.5 * (high - low) + SPARE * longest
    half = np.maximum(half, 0.5 * SLIMMEST * longest)
    return middle - half, middle + half


def within(points_m: FloatArray, limits: Limits) -> BoolArray:
    """[n] which points [n, 3] lie within limits: pictures in space do not cut lines off."""
    return np.asarray(np.all((points_m >= limits[0]) & (points_m <= limits[1]), axis=1))


def clip_line(line_m: FloatArray, limits: Limits) -> FloatArray:
    """[n, 3] a line with NaN for the points beyond limits."""
    return np.where(within(line_m, limits)[:, None], line_m, np.nan)


def stack_views(figure: Figure | SubFigure, place: SubplotSpec, limits: Limits) -> list[Axes]:
    """A view from above and one from the side below it, to one scale and with one x axis."""
    low, high = limits
    ratios = [float(high[1] - low[1]), float(high[2] - low[2])]
    rows = place.subgridspec(2, 1, height_ratios=ratios)
    views = []
    for row, (axis, name) in enumerate(((1, "y"), (2, "z"))):
        axes = figure.add_subplot(rows[row])
        axes.set(xlim=(low[0], high[0]), ylim=(low[axis], high[axis]))
        axes.set(xlabel="x (m)", ylabel=f"{name} (m)")
        axes.set_aspect("equal", adjustable="box")
        share = ratios[row] / float(high[0] - low[0])
        axes.yaxis.set_major_locator(MaxNLocator(nbins=int(np.clip(round(12 * share), 2, 8))))
        axes.grid(alpha=0.25)
        views.append(axes)
    figure.align_ylabels(views)
    return views


def column_in(limits: Limits) -> float:
    """Inches across that two stacked views fill, with the names of their axes."""
    wide, deep, high = (limits[1] - limits[0]).tolist()
    return float(
        np.clip(VIEWS_HIGH_IN * wide / (deep + high) + 0.9, SLIMMEST_VIEWS_IN, WIDEST_VIEWS_IN)
    )


def frame_space(axes: Axes3D, limits: Limits, zoom: float = 1.0) -> None:
    """One scale on all axes of a view in space, with few ticks, so that they stay apart."""
    low, high = limits
    size = high - low
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(size), zoom=zoom)
    for axis, side in zip((axes.xaxis, axes.yaxis, axes.zaxis), size.tolist(), strict=True):
        most = max(2, round(MOST_TICKS * side / float(size.max())))
        axis.set_major_locator(MaxNLocator(nbins=most))
        axis.labelpad = LABEL_PAD


def name_height(axes: Axes3D, name: str) -> None:
    """The label of the third axis, to be read from below upwards however the view is turned."""
    axes.zaxis.set_rotate_label(False)
    axes.set_zlabel(name, rotation=90.0)
