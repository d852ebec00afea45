"""Reachability, obstacles and visibility of one moment (figs. 6.18-6.20).

Left the trajectories in space, coloured by what they meet; right rows of cells from above.
Colours are safe for the colour-blind: blue passable, red blocked.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.avoidance.decision import Decision
from clearway.avoidance.rate.fusion import CellAssessment
from clearway.avoidance.rate.reach_rating import ReachAssessment
from clearway.avoidance.scene import SceneAssessment
from clearway.base.checks import kind_of
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.live import FlightDecision
from clearway.reach.tree import ReachSet
from clearway.view.plot.cells import (
    ALL_ROWS,
    POINT_COLOR,
    CellView,
    Quantity,
    draw_cells,
    make_casing,
)
from clearway.view.plot.notebook import for_notebooks
from clearway.view.plot.space import Limits, frame_space, name_height, within

PASSABLE = LinearSegmentedColormap.from_list(
    "passable", ["#a50026", "#f46d43", "#f5c25b", "#a6cde3", "#4a98c9", "#2155a0"]
)
OBSTACLES = LinearSegmentedColormap.from_list(
    "obstacles", ["#c3ccd1", "#f7c79c", "#ef8a62", "#b2182b", "#5d0018"]
)
VISIBLE = LinearSegmentedColormap.from_list("visible", ["#2d3463", "#7f86b5", "#ded5a4"])
FLAT = 0.5
"""Height of a box in space, as a share of its depth, below which it is flat."""
MOST_POINTS = 3000


QuantityName = Literal["reachability", "obstacle", "visibility"]
"""What is drawn of an assessment."""
TITLES = {
    "reachability": "how well cells can be reached",
    "obstacle": "obstacle probability",
    "visibility": "how well cells are seen",
}


def draw_assessment(
    assessed: SceneAssessment | Decision | FlightDecision,
    quantity: QuantityName = "reachability",
    *,
    title: str | None = None,
) -> Figure:
    """Draw one moment: trajectories in space at left, cells row by row at right.

    A notebook shows the figure, `savefig` of it writes a file.

    Parameters
    ----------
    assessed
        What `assess` or `decide` gave, or a decision of a flight.
    quantity
        "reachability" (4.23), "obstacle" probability (4.17) or "visibility" (5.47), each in [0, 1].
    title
        Above the picture; by default what was assessed, and the quantity.

    Returns
    -------
    Figure
        Of matplotlib; lengths are metres in the frame of the grid.

    Raises
    ------
    ClearwayError
        For another quantity.

    Examples
    --------
    >>> import clearway as cw
    >>> rated = cw.assess("two-balls.toml")
    >>> cw.draw_assessment(rated, "obstacle").savefig("two-balls.png")
    """
    if not (isinstance(quantity, str) and quantity in get_args(QuantityName)):
        choices = ", ".join(get_args(QuantityName))
        raise ClearwayError(f"quantity {quantity!r}: valid quantities are {choices}")
    if not (isinstance(assessed, FlightDecision) or hasattr(assessed, "cells")):
        kind_of("draw_assessment", assessed, SceneAssessment)
    if isinstance(assessed, SceneAssessment):
        reach_set, name = assessed.reach_set, assessed.scene.name
        points = np.concatenate([np.zeros((0, 3)), *(d.points_m for d in assessed.detections)])
    else:
        assessed = assessed.decision if isinstance(assessed, FlightDecision) else assessed
        reach_set, name = assessed.prepared.reach_set, f"{assessed.state.time_s:.1f} s"
        points = assessed.hazards.points.position_m
    return for_notebooks(
        _figure(
            assessed.cells,
            assessed.reach,
            reach_set,
            points,
            title or f"{name}: {TITLES[quantity]}",
            quantity,
        )
    )


def assessment_figures(
    cells: CellAssessment,
    reach: ReachAssessment,
    reach_set: ReachSet,
    points_m: FloatArray,
    title: str,
) -> dict[str, Figure]:
    """The three figures by name: "reachability", "obstacle" and "visibility".

    points_m: hit points [n, 3] in the grid's frame.
    """
    return {
        name: _figure(cells, reach, reach_set, points_m, f"{title}: {TITLES[name]}", name)
        for name in get_args(QuantityName)
    }


def _figure(
    cells: CellAssessment,
    reach: ReachAssessment,
    reach_set: ReachSet,
    points_m: FloatArray,
    title: str,
    name: QuantityName,
) -> Figure:
    """One quantity along the trajectories and in the cells."""
    match name:
        case "reachability":
            caption, values = "Trajectories by their rating", reach.node_rating
        case "obstacle":
            caption = "Trajectories by the largest obstacle probability on the way"
            values = worst_on_the_way(reach_set, cells.obstacle)
        case "visibility":
            caption = "Trajectories by the least visibility on the way"
            values = 1.0 - worst_on_the_way(reach_set, 1.0 - cells.evidence.visibility)
    quantity = _quantity(name, cells, reach)
    return draw_panels(reach_set, values, quantity, points_m, title, caption)


def reachability_quantity(reach: ReachAssessment) -> Quantity:
    """Reachability of cells (4.23), those without a trajectory apart."""
    return Quantity(
        "reachability: 0 blocked, 1 free",
        reach.reachability,
        PASSABLE,
        ~reach.passed,
        "no trajectory passes",
    )


def obstacle_quantity(
    cells: CellAssessment, without: BoolArray, without_label: str = ""
) -> Quantity:
    """Obstacle probability of cells (4.17), but those [cells] `without`."""
    return Quantity(
        "obstacle probability", cells.obstacle, OBSTACLES, without, without_label, "high"
    )


def _quantity(name: str, cells: CellAssessment, reach: ReachAssessment) -> Quantity:
    unseen = ~cells.evidence.seen
    match name:
        case "reachability":
            return reachability_quantity(reach)
        case "obstacle":
            empty = unseen & (cells.obstacle == 0.0)
            return obstacle_quantity(cells, empty, "no beam looks here")
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


def largest_in_movement(reach_set: ReachSet, values: FloatArray) -> FloatArray:
    """[nodes] largest value [cells] of the cells in which a node's own samples lie."""
    cells = reach_set.grid.cell_of(reach_set.samples_m)
    largest: FloatArray = np.where(cells >= 0, values[cells], 0.0).max(axis=1)
    return largest


def draw_panels(
    reach_set: ReachSet,
    node_values: FloatArray,
    quantity: Quantity,
    points_m: FloatArray,
    title: str,
    caption: str,
    view: CellView = ALL_ROWS,
) -> Figure:
    """One figure: trajectories by `node_values` [nodes] at left, cells by row at right."""
    grid = reach_set.grid
    figure = Figure(figsize=(14.0, 8.0), layout="constrained")
    figure.suptitle(title)
    halves = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.15])
    left, right = figure.add_subfigure(halves[0]), figure.add_subfigure(halves[1])
    space = left.add_subplot(projection="3d")
    assert isinstance(space, Axes3D)
    draw_reach_set(reach_set, node_values, space, quantity)
    inside = points_m[grid.cell_of(points_m) >= 0]
    near = inside[:: max(1, len(inside) // MOST_POINTS)]
    shown = near[within(near, _limits_of(space))]
    space.plot(*shown.T, ".", color=POINT_COLOR, markersize=2.0)
    _draw_lines(space, view, grid.range_m)
    space.set_title(caption, fontsize=11, y=0.93)
    draw_cells(right, grid, quantity, near, view)
    return figure


def draw_cells_alone(
    grid: AvoidanceGrid, quantity: Quantity, title: str, view: CellView = ALL_ROWS
) -> Figure:
    """One figure of cells by row, without trajectories in space."""
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    figure.suptitle(title)
    draw_cells(figure, grid, quantity, np.zeros((0, 3)), view)
    return figure


def _draw_lines(axes: Axes3D, view: CellView, range_m: float) -> None:
    """Lines and the edges of the border as far as the grid's range, with room for them."""
    edges = () if view.border is None else view.border.edges_m
    color = "" if view.border is None else view.border.color
    lines = [(line.points_m, line.style, line.color, line.width) for line in view.lines]
    lines += [(edge, "-", color, 1.0) for edge in edges]
    low, high = _limits_of(axes)
    for points, style, line_color, width in lines:
        near = points[np.linalg.norm(points, axis=1) <= range_m]
        rim = make_casing(width)
        axes.plot(*near.T, style, color=line_color, linewidth=width, path_effects=rim, zorder=5)
        low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
    _set_limits(axes, low, high)


def _limits_of(axes: Axes3D) -> Limits:
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    return low, high


def _set_limits(axes: Axes3D, low: FloatArray, high: FloatArray) -> None:
    """One scale on all axes."""
    # Labels of a wide box and of a flat one need more room.
    size = high - low
    slim = size[1] <= 1.2 * size[0] and size[2] > FLAT * size[0]
    frame_space(axes, (low, high), zoom=0.92 if slim else 0.82)


def draw_reach_set(
    reach_set: ReachSet, node_values: FloatArray, axes: Axes3D, quantity: Quantity
) -> None:
    """Trajectories in space, each movement coloured by its node's value [nodes] in [0, 1]."""
    starts = np.zeros((reach_set.nodes, 1, 3))
    below = reach_set.parent >= 0
    starts[below, 0] = reach_set.samples_m[reach_set.parent[below], -1]
    lines = np.concatenate([starts, reach_set.samples_m], axis=1)
    order = np.argsort(node_values if quantity.important == "high" else -node_values, kind="stable")
    axes.add_collection3d(
        Line3DCollection(
            list(lines[order]),
            array=node_values[order],
            cmap=quantity.colors,
            norm=quantity.scale,
            linewidths=1.0,
            alpha=0.9,
        )
    )
    axes.plot([0.0], [0.0], [0.0], ">", color="black", markersize=7)
    _set_limits(axes, lines.min(axis=(0, 1)), lines.max(axis=(0, 1)))
    axes.set_xlabel("x ahead (m)")
    axes.set_ylabel("y left (m)")
    name_height(axes, "z up (m)")
    axes.view_init(elev=28.0, azim=-160.0)
