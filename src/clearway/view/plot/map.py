"""Pictures of maps: what stands where from above, coloured by height, and zones to keep out of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from clearway.base.frames import FloatArray, world_from_body
from clearway.obstacles.obstacle import Obstacle

ZONE = "#c0392b"
COLOURS = "viridis"
LEAST_POINTS = 4.0
WIDTH_POINTS = 600.0
"""Obstacles smaller than this on a picture of this width get a dot, or nobody would find them."""


SPARE_IN = 0.16
"""On both sides, for the numbers of limits that are widened after the layout is settled."""
ROUNDS = 3
"""Of layout and widening: wider numbers on an axis leave less room for its box."""


def draw_map(
    obstacles: Sequence[Obstacle],
    floor: Sequence[Obstacle],
    zones: Mapping[str, Sequence[Obstacle]],
    title: str,
) -> Figure:
    """Everything from above, and from the south below it; zones by name."""
    figure = Figure(figsize=(11.0, 10.0), layout=ConstrainedLayoutEngine(w_pad=SPARE_IN))
    figure.suptitle(title)
    solid = sorted([*floor, *obstacles], key=_top_m)
    if not solid:
        above = figure.subplots()
    else:
        above, side = figure.subplots(2, 1, height_ratios=[4.0, 1.0], sharex=True)
        tops = np.array([_top_m(one) for one in solid])
        scale = Normalize(tops.min(), tops.max())
        drawn = _colour([_footprint(one) for one in solid], tops, scale)
        above.add_collection(drawn)
        figure.colorbar(drawn, ax=[above, side], label="top above the origin (m)")
        side.add_collection(_colour([_from_south(one) for one in solid], tops, scale))
        side.autoscale_view()
    _zones(above, zones)
    _frame(above)
    if not solid:
        above.set_aspect("equal", adjustable="box")
        (west, east), (south, north) = above.get_xlim(), above.get_ylim()
        figure.set_figheight(
            float(np.clip(10.0 * (north - south) / (east - west) + 0.9, 4.5, 10.0))
        )
    if solid:
        above.tick_params(labelbottom=True)
        side.set(xlabel="x, east (m)", ylabel="z, up (m)")
        figure.align_ylabels([above, side])
        _widen_to_one_scale(figure, above)
        _dots(above, obstacles, scale)
    return figure


def _frame(axes: Axes) -> None:
    """Limits that are not much wider one way than the other."""
    axes.autoscale_view()
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    spare_x = max(0.0, 0.35 * (north - south) - 0.5 * (east - west))
    spare_y = max(0.0, 0.35 * (east - west) - 0.5 * (north - south))
    axes.set(xlim=(west - spare_x, east + spare_x), ylim=(south - spare_y, north + spare_y))
    axes.set(xlabel="x, east (m)", ylabel="y, north (m)")
    axes.locator_params(nbins=8)


def _widen_to_one_scale(figure: Figure, axes: Axes) -> None:
    """Widen the limits of one axis until a metre is as long along both, and cut nothing off.

    matplotlib's own equal scales either shrink the box, which then no longer stands above the view
    from the south, or narrow the limits of the axis that is not shared.
    """
    for _ in range(ROUNDS):
        figure.draw_without_rendering()
        box = axes.get_window_extent()
        limits = np.array([axes.get_xlim(), axes.get_ylim()])
        metres = limits[:, 1] - limits[:, 0]
        wanted = max(metres[0] / box.width, metres[1] / box.height) * np.array(box.size)
        spare = 0.5 * (wanted - metres)
        (west, east), (south, north) = limits + spare[:, None] * np.array([-1.0, 1.0])
        axes.set(xlim=(west, east), ylim=(south, north))


def _top_m(obstacle: Obstacle) -> float:
    return float(obstacle.position_m[2] + obstacle.half_m[2] + obstacle.radius_m)


def _footprint(obstacle: Obstacle) -> FloatArray:
    """[4, 2] corners from above; map obstacles stand upright."""
    half_x, half_y = obstacle.half_m[:2] + obstacle.radius_m
    corners = np.array(
        [[-half_x, -half_y, 0], [half_x, -half_y, 0], [half_x, half_y, 0], [-half_x, half_y, 0]]
    )
    turned = corners @ world_from_body(obstacle.orientation_rad).T + obstacle.position_m
    return turned[:, :2]


def _zones(axes: Axes, zones: Mapping[str, Sequence[Obstacle]]) -> None:
    for name, volumes in zones.items():
        outlines = [_footprint(one) for one in volumes]
        axes.add_collection(
            PolyCollection(outlines, facecolors=ZONE, alpha=0.25, edgecolors="none")
        )
        middle = np.concatenate(outlines).mean(axis=0)
        axes.plot(*middle, "+", color=ZONE)
        axes.annotate(
            _name_zone(name, volumes),
            middle,
            xytext=(0, 6),
            textcoords="offset points",
            ha="center",
            color=ZONE,
        )


def _name_zone(name: str, volumes: Sequence[Obstacle]) -> str:
    """The name of a zone over the heights that it spans."""
    top = max(_top_m(one) for one in volumes)
    foot = min(2.0 * float(one.position_m[2]) - _top_m(one) for one in volumes)
    return f"{name}\n{foot:z.0f} to {top:z.0f} m"


def _colour(corners: list[FloatArray], tops: FloatArray, scale: Normalize) -> PolyCollection:
    return PolyCollection(
        corners, array=tops, norm=scale, cmap=COLOURS, edgecolors="face", linewidths=0.3
    )


def _from_south(obstacle: Obstacle) -> FloatArray:
    """[4, 2] corners seen from the south, from foot to top."""
    low, high = _footprint(obstacle)[:, 0].min(), _footprint(obstacle)[:, 0].max()
    top = _top_m(obstacle)
    foot = 2.0 * float(obstacle.position_m[2]) - top
    return np.array([[low, foot], [high, foot], [high, top], [low, top]])


def _dots(axes: Axes, obstacles: Sequence[Obstacle], scale: Normalize) -> None:
    """Dots on obstacles that are too small to be seen at the picture's scale."""
    low, high = axes.get_xlim()
    least_m = LEAST_POINTS * (high - low) / WIDTH_POINTS
    small = [one for one in obstacles if 2.0 * one.half_m[:2].max() < least_m]
    if not small:
        return
    places = np.array([one.position_m for one in small])
    tops = [_top_m(one) for one in small]
    axes.scatter(places[:, 0], places[:, 1], s=10, c=tops, norm=scale, cmap=COLOURS, zorder=3)
