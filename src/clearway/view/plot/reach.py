"""Pictures of reach sets: their trajectories in space, from above and from the side.

They answer figs. 4.1-4.3; colours tell how smooth each trajectory is.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray
from clearway.reach.choose.coverage import smoothness
from clearway.reach.tree import LAST_LAYER, SIDE, ReachSet
from clearway.view.plot.space import name_height

INK = "#222222"
EDGE = "#9aa0a6"
VEHICLE = "#c1272d"
SMOOTH: Colormap = LinearSegmentedColormap.from_list(
    "smooth", ["#35193e", "#7b1c5a", "#c8475a", "#e58a5f", "#e8c384"][::-1]
)
"""Light for all turns to dark for straight flight, so that the few smooth ones stand out."""


def draw_reach_set_views(reach_set: ReachSet, title: str = "Reach set") -> Figure:
    """A figure with the trajectories in 3-D, from above and from the side, grid frame."""
    figure = Figure(figsize=(15.0, 6.6), dpi=130)
    wide, above, beside = _layout(figure, reach_set.grid)
    leaves = reach_set.trajectories
    shares = smoothness(reach_set, leaves)
    # Smooth ones last, on top of the others.
    order = np.argsort(shares, kind="stable")
    paths = [path_m(reach_set, int(leaf)) for leaf in leaves[order]]
    colors = SMOOTH(shares[order])
    width = float(np.clip(14.0 / np.sqrt(len(paths)), 0.35, 1.3))
    lines = Line3DCollection(paths, colors=colors, linewidths=width, alpha=0.85)
    wide.add_collection3d(lines)
    _field_of_view(wide, reach_set.grid)
    for axes, axis in ((above, 1), (beside, 2)):
        flat = [path[:, [0, axis]] for path in paths]
        axes.add_collection(LineCollection(flat, colors=colors, linewidths=width, alpha=0.85))
        axes.plot(0, 0, marker="o", color=VEHICLE, markersize=6, zorder=5, clip_on=False)
    grid = reach_set.grid
    _outline(above, grid.range_edges_m, grid.azimuth_edges_rad)
    _outline(beside, grid.range_edges_m, grid.elevation_edges_rad)
    _mark_ends(wide, above, beside, reach_set)
    bar = figure.colorbar(
        ScalarMappable(Normalize(0.0, 1.0), SMOOTH),
        cax=figure.add_axes((0.955, 0.16, 0.01, 0.56)),
        label="smoothness (4.28)",
    )
    bar.ax.tick_params(labelsize=9)
    _headings(figure, reach_set, title)
    return figure


def path_m(reach_set: ReachSet, leaf: int) -> FloatArray:
    """[points, 3] of a trajectory from the start on, at its samples."""
    samples = reach_set.samples_m[reach_set.path(leaf)].reshape(-1, 3)
    return np.concatenate([np.zeros((1, 3)), samples])


def _layout(figure: Figure, grid: AvoidanceGrid) -> tuple[Axes3D, Axes, Axes]:
    """Room for the three views, each to one scale on all axes."""
    wide = figure.add_axes((0.0, 0.0, 0.45, 0.84), projection="3d")
    assert isinstance(wide, Axes3D)
    above = figure.add_axes((0.5, 0.11, 0.2, 0.66))
    beside = figure.add_axes((0.735, 0.11, 0.2, 0.66))
    corners = _corners(grid)
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = 0.04 * (high - low).max()
    wide.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        zlim=(low[2], high[2]),
        xlabel="x ahead (m)",
        ylabel="y left (m)",
        xticks=_ticks(low[0], high[0]),
        yticks=_ticks(low[1], high[1]),
        zticks=_ticks(low[2], high[2]),
    )
    name_height(wide, "z up (m)")
    wide.set_box_aspect(tuple(np.maximum(high - low, 1e-9)), zoom=1.0)
    wide.view_init(elev=22.0, azim=-125.0)
    for pane in (wide.xaxis, wide.yaxis, wide.zaxis):
        pane.set_pane_color((1.0, 1.0, 1.0, 0.0))
    wide.grid(visible=False)
    for axes, axis, label in ((above, 1, "y left (m)"), (beside, 2, "z up (m)")):
        axes.set(
            xlim=(low[0] - room, high[0] + room),
            ylim=(low[axis] - room, high[axis] + room),
            xlabel="x ahead (m)",
            ylabel=label,
            aspect="equal",
        )
        axes.spines[["top", "right"]].set_visible(False)
    return wide, above, beside


def _ticks(low: float, high: float) -> FloatArray:
    """Few round numbers, so that labels in 3-D stay apart."""
    ticks = MaxNLocator(nbins=5, integer=high - low > 5.0).tick_values(low, high)
    return np.asarray(ticks, dtype=np.float64)[1:-1]


def _corners(grid: AvoidanceGrid) -> FloatArray:
    """Points on the outline of the field of view, with the vehicle."""
    azimuth, elevation = np.meshgrid(
        np.linspace(grid.azimuth_edges_rad[0], grid.azimuth_edges_rad[-1], 41),
        np.linspace(grid.elevation_edges_rad[0], grid.elevation_edges_rad[-1], 41),
    )
    distance = np.full_like(azimuth, grid.range_m)
    shell = cartesian_from_spherical(np.stack([distance, azimuth, elevation], axis=-1))
    return np.concatenate([shell.reshape(-1, 3), np.zeros((1, 3))])


def _field_of_view(axes: Axes3D, grid: AvoidanceGrid) -> None:
    """Edges of the field of view, dashed as in the paper's figures."""
    az, el, far = grid.azimuth_edges_rad, grid.elevation_edges_rad, grid.range_m
    turn, rise = np.linspace(az[0], az[-1], 60), np.linspace(el[0], el[-1], 60)
    rims = [(np.full(60, far), turn, np.full(60, e)) for e in (el[0], el[-1])]
    rims += [(np.full(60, far), np.full(60, a), rise) for a in (az[0], az[-1])]
    rims += [
        (np.linspace(0.0, far, 60), np.full(60, a), np.full(60, e))
        for a in (az[0], az[-1])
        for e in (el[0], el[-1])
    ]
    for rim in rims:
        line = cartesian_from_spherical(np.stack(rim, axis=-1))
        axes.plot(*line.T, color=EDGE, linestyle="--", linewidth=0.9)
    axes.scatter([0], [0], [0], marker="o", color=VEHICLE, s=40, depthshade=False)


def _outline(axes: Axes, ranges_m: FloatArray, angles_rad: FloatArray) -> None:
    """Borders of cells in a plane through the origin: arcs between layers, rays between angles."""
    turn = np.linspace(angles_rad[0], angles_rad[-1], 90)
    for radius in ranges_m:
        axes.plot(radius * np.cos(turn), radius * np.sin(turn), color=EDGE, lw=0.4, zorder=0)
    rays = ranges_m[[0, -1]]
    for angle in angles_rad:
        axes.plot(rays * np.cos(angle), rays * np.sin(angle), color=EDGE, lw=0.4, zorder=0)


def _mark_ends(wide: Axes3D, above: Axes, beside: Axes, reach_set: ReachSet) -> None:
    """Where trajectories end: dots in the last layer, crosses through the side."""
    shrink = min(1.0, 12.0 / np.sqrt(len(reach_set.trajectories)))
    for kind, marker, area in ((LAST_LAYER, ".", 16.0), (SIDE, "x", 14.0)):
        size = area * shrink
        leaves: IntArray = np.flatnonzero(reach_set.exit_kind == kind)
        x, y, z = reach_set.states[leaves, :3].T
        wide.scatter(x, y, z, s=size, marker=marker, color=INK, linewidths=0.6, depthshade=False)
        for axes, up in ((above, y), (beside, z)):
            axes.scatter(
                x, up, s=size, marker=marker, color=INK, linewidths=0.6, zorder=4, clip_on=False
            )


def _headings(figure: Figure, reach_set: ReachSet, title: str) -> None:
    last = int(np.count_nonzero(reach_set.exit_kind == LAST_LAYER))
    side = int(np.count_nonzero(reach_set.exit_kind == SIDE))
    layers, columns, rows = reach_set.grid.shape
    figure.text(0.02, 0.93, title, fontsize=17, color=INK, weight="bold")
    figure.text(
        0.02,
        0.885,
        f"{reach_set.nodes} nodes, {last} trajectories to the last layer, {side} through the side"
        f"   |   {layers} x {columns} x {rows} cells to {reach_set.grid.range_m:g} m"
        f"   |   start pitch {np.degrees(reach_set.start_pitch_rad):g}°",
        fontsize=10.5,
        color=INK,
    )
    figure.text(0.5, 0.79, "From above", fontsize=11, weight="bold", color=INK)
    figure.text(0.735, 0.79, "From the side", fontsize=11, weight="bold", color=INK)
    handles: list[Line2D | Patch] = [
        Line2D([], [], marker="o", color=VEHICLE, linestyle="", label="vehicle at the start"),
        Line2D([], [], marker=".", color=INK, linestyle="", label="end in the last layer"),
        Line2D([], [], marker="x", color=INK, linestyle="", label="exit through the side"),
        Line2D([], [], color=EDGE, linestyle="--", label="field of view"),
    ]
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.68, 0.985),
        ncols=2,
        frameon=False,
        columnspacing=2.5,
    )
