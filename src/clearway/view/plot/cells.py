"""Cells of the grid row by row from above, with what is to be seen over them.

"Row 1 (top)" first: the paper calls rows layers, which elsewhere are ranges. Ahead is up and left
is left, as the pilot sees it, or ahead is to the right and left is up, as in the paper's figures of
chapter 6.3. A point is drawn at its range and azimuth, as cells are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import AbstractPathEffect, withStroke

from clearway.base.frames import FloatArray, cartesian_from_spherical, spherical_from_cartesian
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray

UNIT = Normalize(0.0, 1.0)
POINT_COLOR = "#111111"
WITHOUT_FACE = "#e3e3e3"
WITHOUT_EDGE = "#8c8c8c"
WITHOUT_HATCH = "////"
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
    important: Literal["low", "high"] = "low"
    """Which trajectories are drawn on top of the others."""
    scale: Normalize = UNIT
    """From values to colours."""


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line in space to draw over cells and trajectories."""

    points_m: FloatArray
    """[n, 3] grid frame, close enough together to tell in which row each piece is."""
    label: str
    """For the legend; empty for none."""
    color: str
    style: Literal["-", "--"] = "-"
    width: float = 1.8
    start: str = ""
    """Marker of the first point; empty for none."""


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """A body in space whose outline is drawn in every row that it reaches into."""

    outside: Callable[[FloatArray], FloatArray]
    """[n] for points [n, 3] in the grid frame: negative inside the body, positive outside."""
    label: str
    color: str
    edges_m: tuple[FloatArray, ...] = ()
    """[n, 3] each; lines that show the body in space."""


@dataclass(frozen=True, slots=True, eq=False)
class CellView:
    """Which rows to draw, which way round, and what over them."""

    rows: tuple[int, ...] | None = None
    """From the top down; None for all."""
    ahead: Literal["up", "right"] = "up"
    lines: tuple[Line, ...] = ()
    border: Border | None = None

    def rows_of(self, grid: AvoidanceGrid) -> tuple[int, ...]:
        return tuple(range(grid.rows - 1, -1, -1)) if self.rows is None else self.rows

    def across(self, panels: int) -> int:
        """Panels side by side: more of the slim ones that show ahead to the right."""
        if panels == 1:
            return 1
        return (2 if panels <= 6 else 3 if panels <= 12 else 4) + (self.ahead == "right")

    def turn(self, left_ahead: FloatArray) -> FloatArray:
        """[..., 2] horizontal and vertical of the picture for (left, ahead)."""
        return left_ahead if self.ahead == "up" else left_ahead[..., ::-1]

    def project(self, points_m: FloatArray) -> FloatArray:
        """[n, 2] where points [n, 3] are drawn."""
        distance, azimuth, _ = spherical_from_cartesian(points_m).T
        return self.turn(
            np.stack([distance * np.sin(azimuth), distance * np.cos(azimuth)], axis=-1)
        )


ALL_ROWS = CellView()


def draw_cells(
    target: Figure | SubFigure,
    grid: AvoidanceGrid,
    quantity: Quantity,
    points_m: FloatArray,
    view: CellView = ALL_ROWS,
) -> None:
    """Rows of cells from above, top row first, with a colour bar and a legend.

    points_m: [n, 3] hit points in the grid, drawn in the row that they are in.
    """
    rows = view.rows_of(grid)
    across = view.across(len(rows))
    down = -(-len(rows) // across)
    panels = list(target.subplots(down, across, squeeze=False, sharex=True, sharey=True).flat)
    point_rows = grid.cell_of(points_m) % grid.rows
    wedges = cell_wedges(grid)
    for axes, row in zip(panels, rows, strict=False):
        _draw_row(axes, grid, row, wedges, quantity, view)
        _draw_over(axes, grid, row, view)
        if np.any(point_rows == row):
            here = view.project(points_m[point_rows == row])
            axes.plot(*here.T, ".", color=POINT_COLOR, markersize=2)
        axes.set_title(_row_title(grid, row), fontsize=10, pad=4.0)
    for axes in panels[len(rows) :]:
        axes.set_visible(False)
    _label(panels, len(rows), across, view)
    bar = target.colorbar(
        ScalarMappable(quantity.scale, quantity.colors), ax=panels, shrink=0.8, pad=0.02
    )
    bar.set_label(quantity.label)
    spare = panels[len(rows)] if len(panels) > len(rows) else None
    _draw_legend(target, spare, quantity, len(points_m) > 0, view)


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
    view: CellView,
) -> None:
    """Coloured cells of one row; those without a value grey and hatched."""
    outlines = [view.turn(outline) for layer in wedges for outline in layer]
    values = grid.reshape(quantity.values)[:, :, row].ravel()
    axes.add_collection(
        PolyCollection(
            outlines,
            array=values,
            cmap=quantity.colors,
            norm=quantity.scale,
            edgecolors="#9a9a9a",
            linewidths=0.4,
        )
    )
    without = grid.reshape(quantity.without)[:, :, row].ravel()
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


def _draw_over(axes: Axes, grid: AvoidanceGrid, row: int, view: CellView) -> None:
    """The pieces of lines that are in a row, and the border's outline there."""
    bottom, top = grid.elevation_edges_rad[row : row + 2]
    for line in view.lines:
        distance, _, elevation = spherical_from_cartesian(line.points_m).T
        here = (elevation >= bottom) & (elevation <= top) & (distance <= grid.range_m + 1e-9)
        seen = np.where(here[:, None], view.project(line.points_m), np.nan)
        axes.plot(
            *seen.T,
            line.style,
            color=line.color,
            linewidth=line.width,
            path_effects=make_casing(line.width),
        )
        if line.start:
            axes.plot(*seen[0], line.start, color=line.color, clip_on=False)
    if view.border is not None:
        _draw_border(axes, grid, (float(bottom), float(top)), view.border, view)


def _draw_border(
    axes: Axes, grid: AvoidanceGrid, row_rad: tuple[float, float], border: Border, view: CellView
) -> None:
    """Outline of the ranges and azimuths at which the body is somewhere between two elevations."""
    distance, azimuth, elevation = np.meshgrid(
        np.linspace(grid.range_edges_m[0], grid.range_m, 120),
        np.linspace(grid.azimuth_edges_rad[0], grid.azimuth_edges_rad[-1], 120),
        np.linspace(*row_rad, 13),
        indexing="ij",
    )
    points = cartesian_from_spherical(np.stack([distance, azimuth, elevation], axis=-1))
    outside = border.outside(points.reshape(-1, 3)).reshape(distance.shape).min(axis=2)
    if outside.min() < 0.0 < outside.max():
        at = view.turn(np.stack([distance * np.sin(azimuth), distance * np.cos(azimuth)], -1))
        at = at[:, :, 0]
        outline = axes.contour(
            at[..., 0], at[..., 1], outside, levels=[0.0], colors=[border.color], linewidths=1.4
        )
        outline.set_path_effects(make_casing(1.4))


def make_casing(width: float) -> list[AbstractPathEffect]:
    """A line of this width with a white rim, to be seen on any colour."""
    return [withStroke(linewidth=width + 1.6, foreground="white")]


def _row_title(grid: AvoidanceGrid, row: int) -> str:
    low, high = np.degrees(grid.elevation_edges_rad[row : row + 2])
    places = {grid.rows // 2: " (middle)"} if grid.rows % 2 else {}
    places |= {0: " (bottom)", grid.rows - 1: " (top)"}
    if grid.rows == 1:
        places = {}
    return f"Row {grid.rows - row}{places.get(row, '')}: {low:z.0f}° to {high:z.0f}°"


def _label(panels: Sequence[Axes], rows: int, across: int, view: CellView) -> None:
    """Axis labels at the rim, and left on the left or up."""
    horizontal, vertical = "left (m)", "ahead (m)"
    if view.ahead == "up":
        panels[0].invert_xaxis()
    else:
        horizontal, vertical = vertical, horizontal
    for number in range(rows):
        if number % across == 0:
            panels[number].set_ylabel(vertical, fontsize=9)
        if number + across >= rows:
            panels[number].set_xlabel(horizontal, fontsize=9)
            panels[number].tick_params(labelbottom=True)


def _draw_legend(
    target: Figure | SubFigure,
    spare: Axes | None,
    quantity: Quantity,
    with_points: bool,
    view: CellView,
) -> None:
    handles: list[Patch | Line2D] = [
        Line2D([], [], color=line.color, linestyle=line.style, marker=line.start, label=line.label)
        for line in view.lines
        if line.label
    ]
    if view.border is not None:
        handles.append(Line2D([], [], color=view.border.color, lw=1.4, label=view.border.label))
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
    if handles and spare is not None:
        # The panel that no row needs.
        spare.set_visible(True)
        spare.axis("off")
        spare.legend(handles=handles, loc="center", frameon=False)
    elif handles:
        target.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
