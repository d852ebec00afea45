"""Reachability, obstacles and visibility of one moment (figs. 6.18-6.20).

Left the trajectories in space, coloured by what they meet; right every row of cells from above,
"Layer 1 (top)" first, as the pilot sees it: ahead is up, left is left. Colours are safe for the
colour-blind: blue passable, red blocked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.frames import FloatArray, spherical_from_cartesian
from clearway.fusion import CellAssessment, ReachAssessment
from clearway.grid import AvoidanceGrid
from clearway.reach.tree import ReachSet
from clearway.state import BoolArray

PASSABLE = LinearSegmentedColormap.from_list(
    "passable", ["#a50026", "#f46d43", "#f5c25b", "#a6cde3", "#4a98c9", "#2155a0"]
)
OBSTACLES = LinearSegmentedColormap.from_list(
    "obstacles", ["#c3ccd1", "#f7c79c", "#ef8a62", "#b2182b", "#5d0018"]
)
VISIBLE = LinearSegmentedColormap.from_list("visible", ["#2d3463", "#7f86b5", "#ded5a4"])
UNIT = Normalize(0.0, 1.0)
POINT_COLOR = "#111111"
WITHOUT_FACE, WITHOUT_EDGE, WITHOUT_HATCH = "#e3e3e3", "#8c8c8c", "////"
MOST_POINTS = 3000
ARC_PIECES = 8
"""Straight pieces in which the arc of a cell is drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Quantity:
    """A [cells] array to draw: its values, words and colours."""

    label: str
    """For the colour bar, with its meaning at both ends."""
    values: FloatArray
    """[cells] in [0, 1]."""
    colors: Colormap
    without: BoolArray
    """[cells] true for cells that have no value; grey and hatched."""
    without_label: str = "no value"


def draw_assessment(
    cells: CellAssessment,
    reach: ReachAssessment,
    reach_set: ReachSet,
    points_m: FloatArray,
    title: str,
) -> dict[str, Figure]:
    """The three figures by name: "reachability", "obstacle" and "visibility".

    points_m: hit points [n, 3] in the grid's frame.
    """
    visibility = cells.evidence.visibility
    trajectories = {
        "reachability": ("Trajectories by their rating", reach.node_rating),
        "obstacle": (
            "Trajectories by the largest obstacle probability on the way",
            worst_on_the_way(reach_set, cells.obstacle),
        ),
        "visibility": (
            "Trajectories by the least visibility on the way",
            1.0 - worst_on_the_way(reach_set, 1.0 - visibility),
        ),
    }
    return {
        name: draw_panels(
            reach_set, values, _quantity(name, cells, reach), points_m, f"{title}: {name}", caption
        )
        for name, (caption, values) in trajectories.items()
    }


def _quantity(name: str, cells: CellAssessment, reach: ReachAssessment) -> Quantity:
    unseen = ~cells.evidence.seen
    match name:
        case "reachability":
            return Quantity(
                "reachability: 0 blocked, 1 free",
                reach.reachability,
                PASSABLE,
                ~reach.passed,
                "no trajectory passes",
            )
        case "obstacle":
            empty = unseen & (cells.obstacle == 0.0)
            return Quantity(
                "obstacle probability", cells.obstacle, OBSTACLES, empty, "no beam looks here"
            )
        case _:
            return Quantity(
                "visibility: 0 hidden, 1 visible",
                cells.evidence.visibility,
                VISIBLE,
                unseen,
                "no beam looks here",
            )


def worst_on_the_way(reach_set: ReachSet, values: FloatArray) -> FloatArray:
    """[nodes] largest value [cells] of the cells on the way to the end of each node."""
    worst = np.zeros(reach_set.nodes)
    for node in range(reach_set.nodes):
        parent = reach_set.parent[node]
        passed = reach_set.cell_index[reach_set.cell_start[node] : reach_set.cell_start[node + 1]]
        before = worst[parent] if parent >= 0 else 0.0
        worst[node] = max(before, values[passed].max(initial=0.0))
    return worst


def draw_panels(
    reach_set: ReachSet,
    node_values: FloatArray,
    quantity: Quantity,
    points_m: FloatArray,
    title: str,
    caption: str,
) -> Figure:
    """One figure: trajectories by `node_values` [nodes] at left, cells by row at right."""
    grid = reach_set.grid
    figure = Figure(figsize=(14.0, 8.0), layout="constrained")
    figure.suptitle(title, fontsize=15)
    halves = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.15])
    left, right = figure.add_subfigure(halves[0]), figure.add_subfigure(halves[1])
    space = left.add_subplot(projection="3d")
    assert isinstance(space, Axes3D)
    draw_reach_set(reach_set, node_values, space, quantity.colors)
    inside = points_m[grid.cell_of(points_m) >= 0]
    near = inside[:: max(1, len(inside) // MOST_POINTS)]
    space.plot(*near.T, ".", color=POINT_COLOR, markersize=2.0)
    space.set_title(caption, fontsize=11)
    draw_cells(right, grid, quantity, near)
    return figure


def draw_reach_set(
    reach_set: ReachSet, node_values: FloatArray, axes: Axes3D, colors: Colormap = PASSABLE
) -> None:
    """Trajectories in space, each movement coloured by its node's value in [0, 1]."""
    starts = np.zeros((reach_set.nodes, 1, 3))
    below = reach_set.parent >= 0
    starts[below, 0] = reach_set.samples_m[reach_set.parent[below], -1]
    lines = np.concatenate([starts, reach_set.samples_m], axis=1)
    order = np.argsort(-node_values, kind="stable")
    axes.add_collection3d(
        Line3DCollection(
            list(lines[order]),
            array=node_values[order],
            cmap=colors,
            norm=UNIT,
            linewidths=1.0,
            alpha=0.9,
        )
    )
    axes.plot([0.0], [0.0], [0.0], ">", color="black", markersize=7)
    low, high = lines.min(axis=(0, 1)), lines.max(axis=(0, 1))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(tuple(high - low), zoom=0.92)
    axes.set_xlabel("x ahead (m)")
    axes.set_ylabel("y left (m)")
    axes.set_zlabel("z up (m)")
    axes.view_init(elev=28.0, azim=-160.0)


def draw_cells(
    target: Figure | SubFigure, grid: AvoidanceGrid, quantity: Quantity, points_m: FloatArray
) -> None:
    """Every row of cells from above, top row first, with a colour bar and a legend.

    points_m: [n, 3] hit points in the grid, drawn in the row that they are in.
    """
    across = 2 if grid.rows <= 6 else 3 if grid.rows <= 12 else 4
    down = -(-grid.rows // across)
    panels = list(target.subplots(down, across, squeeze=False, sharex=True, sharey=True).flat)
    rows = grid.cell_of(points_m) % grid.rows
    wedges = cell_wedges(grid)
    for number, axes in enumerate(panels):
        row = grid.rows - 1 - number
        if row < 0:
            axes.set_visible(False)
            continue
        _draw_row(axes, grid, row, wedges, quantity)
        _draw_points(axes, points_m[rows == row])
        axes.set_title(_row_title(grid, row), fontsize=10)
    _label(panels, grid.rows, across)
    bar = target.colorbar(ScalarMappable(UNIT, quantity.colors), ax=panels, shrink=0.8, pad=0.02)
    bar.set_label(quantity.label)
    _draw_legend(target, quantity, len(points_m) > 0)


def cell_wedges(grid: AvoidanceGrid) -> list[list[FloatArray]]:
    """[layers][columns] outlines [m, 2] of cells from above: (y left, x ahead) in metres."""
    near, far = grid.range_edges_m[:-1], grid.range_edges_m[1:]
    outlines = []
    for inner, outer in zip(near, far, strict=True):
        layer = []
        for right, left in zip(
            grid.azimuth_edges_rad[:-1], grid.azimuth_edges_rad[1:], strict=True
        ):
            arc = np.linspace(right, left, ARC_PIECES + 1)
            direction = np.stack([np.sin(arc), np.cos(arc)], axis=1)
            layer.append(np.concatenate([inner * direction, outer * direction[::-1]]))
        outlines.append(layer)
    return outlines


def _draw_row(
    axes: Axes,
    grid: AvoidanceGrid,
    row: int,
    wedges: Sequence[Sequence[FloatArray]],
    quantity: Quantity,
) -> None:
    """Coloured cells of one row; those without a value grey and hatched."""
    outlines = [outline for layer in wedges for outline in layer]
    values = grid.shaped(quantity.values)[:, :, row].ravel()
    axes.add_collection(
        PolyCollection(
            outlines,
            array=values,
            cmap=quantity.colors,
            norm=UNIT,
            edgecolors="#9a9a9a",
            linewidths=0.4,
        )
    )
    without = grid.shaped(quantity.without)[:, :, row].ravel()
    axes.add_collection(
        PolyCollection(
            [outline for outline, hatched in zip(outlines, without, strict=True) if hatched],
            facecolors=WITHOUT_FACE,
            edgecolors=WITHOUT_EDGE,
            hatch=WITHOUT_HATCH,
            linewidths=0.4,
        )
    )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.tick_params(labelsize=8)


def _draw_points(axes: Axes, points_m: FloatArray) -> None:
    """Hit points at their range and azimuth, as the cells of a row are drawn."""
    if not len(points_m):
        return
    distance, azimuth, _ = spherical_from_cartesian(points_m).T
    axes.plot(
        distance * np.sin(azimuth), distance * np.cos(azimuth), ".", color=POINT_COLOR, markersize=2
    )


def _row_title(grid: AvoidanceGrid, row: int) -> str:
    low, high = np.degrees(grid.elevation_edges_rad[row : row + 2])
    place = " (top)" if row == grid.rows - 1 else " (bottom)" if row == 0 else ""
    return f"Layer {grid.rows - row}{place}: {low:.0f}° to {high:.0f}°"


def _label(panels: Sequence[Axes], rows: int, across: int) -> None:
    """Axis labels at the rim, and left on the left."""
    panels[0].invert_xaxis()
    for number in range(rows):
        if number % across == 0:
            panels[number].set_ylabel("ahead (m)", fontsize=9)
        if number + across >= rows:
            panels[number].set_xlabel("left (m)", fontsize=9)
            panels[number].tick_params(labelbottom=True)


def _draw_legend(target: Figure | SubFigure, quantity: Quantity, with_points: bool) -> None:
    handles: list[Patch | Line2D] = []
    if np.any(quantity.without):
        handles.append(
            Patch(
                facecolor=WITHOUT_FACE,
                edgecolor=WITHOUT_EDGE,
                hatch=WITHOUT_HATCH,
                label=quantity.without_label,
            )
        )
    if with_points:
        handles.append(
            Line2D([], [], marker=".", linestyle="", color=POINT_COLOR, label="hit point")
        )
    if handles:
        target.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
