"""Cells that hold a place with the margin although their middle has none: before it is stated that
no way leads to a goal, they are open too."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from clearway.base.arrays import FloatArray, IntArray
from clearway.live.routing.field.clearance_speed import BARRED_M
from clearway.live.routing.field.known_space import KnownSpace

LOOKED_AT = 2
"""The finest so many levels are looked at: in coarser ones nothing is closed then."""
ACROSS = 0.25
UPWARDS = 0.5
"""Margins from one place in a cell to the next, at most; no gap of 2.2 margins hides between."""
NO_CELLS: IntArray = np.zeros((0, 5), dtype=np.int64)


def cells_with_room(space: KnownSpace, margin_m: float) -> IntArray:
    """Return the cells [n, 5] with a place that keeps a margin, of those whose middles do not.

    Each by its level, its numbers in the world, and whether the place lies above its middle (1), or
    below (-1).

    Parameters
    ----------
    space
    margin_m
    """
    levels, layout = space.levels, space.layout
    shape = (layout.levels, layout.along, layout.along, layout.layers)
    highest_m = layout.lowest_m + (layout.layers - 1) * layout.layer_m
    tree, found = KDTree(space.known_points_m), []
    for level in range(min(LOOKED_AT, layout.levels)):
        width = layout.width_m * 2.0**level
        clear = space.clearance_m.reshape(shape)[level]
        steps = _steps_in_cell(width, layout.layer_m if layout.layers > 1 else 0.0, margin_m)
        widest = float(np.linalg.norm(steps, axis=1).max())
        at = np.argwhere((clear < margin_m) & (clear > max(margin_m - widest, 0.5 * BARRED_M)))
        middle = np.empty((len(at), 3))
        middle[:, :2] = (at[:, :2] + levels.low[level] + 0.5) * width
        middle[:, 2] = layout.lowest_m + at[:, 2] * layout.layer_m
        has_room, side = np.zeros(len(at), dtype=np.bool_), np.zeros(len(at), dtype=np.int64)
        for step in steps:
            left = np.flatnonzero(~has_room)
            places = middle[left] + step
            places[:, 2] = np.clip(places[:, 2], layout.lowest_m, highest_m)
            near_m = tree.query(places, distance_upper_bound=margin_m)[0]
            has_room[left] = np.minimum(near_m, space.base_clearance(places, margin_m)) >= margin_m
            side[left] = int(np.sign(step[2]))
        cells = np.column_stack([np.full(len(at), level), at, side])[has_room]
        cells[:, 1:3] += levels.low[level]
        found.append(cells)
    return np.concatenate(found)


def open_cells(
    space: KnownSpace, cells: IntArray, speed_mps: FloatArray, slow_mps: float
) -> FloatArray:
    """Let ways lead through cells [n, 5], and to the layer that their places lie nearer to.

    Returns the clearance [cells] by which ways go from layer to layer then; the speed [cells] is
    changed. Cells that were left behind count no more.
    """
    layout, low = space.layout, space.levels.low
    shape = (layout.levels, layout.along, layout.along, layout.layers)
    at, side = cells[:, :4].copy(), cells[:, 4]
    at[:, 1:3] -= low[at[:, 0]]
    kept = np.all((at >= 0) & (at < shape), axis=1)
    at, side = at[kept], side[kept]
    numbers = np.ravel_multi_index(tuple(at.T), shape)
    speed_mps[numbers] = slow_mps
    clearance = space.clearance_m.copy()
    beside = at[:, 3] + side
    leads = (side != 0) & (beside >= 0) & (beside < layout.layers)
    numbers = numbers[leads]
    needed = np.hypot(layout.layer_m, layout.width_m) - clearance[numbers + side[leads]]
    clearance[numbers] = np.maximum(clearance[numbers], needed)
    return clearance


def _steps_in_cell(width_m: float, layer_m: float, margin_m: float) -> FloatArray:
    """[n, 3] from a cell's middle to places all over it."""
    ticks = [
        (np.arange(count) + 0.5) / count * edge - 0.5 * edge
        for edge, apart in ((width_m, ACROSS), (width_m, ACROSS), (layer_m, UPWARDS))
        for count in [max(int(np.ceil(edge / (apart * margin_m))), 1)]
    ]
    return np.stack([each.ravel() for each in np.meshgrid(*ticks)], axis=1)
