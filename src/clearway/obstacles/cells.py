"""What map obstacles do to cells: base probability (5.52), (5.53), and coating (def. 5, def. 6)."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np

from clearway.base.compiled import borrowing, compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.obstacles.cell_nodes import NODES_PER_CELL, CellNodes, cell_nodes
from clearway.obstacles.cell_share import blurred_share
from clearway.obstacles.cell_volume import union_shares
from clearway.obstacles.near_cells import look_around, near_cells
from clearway.obstacles.obstacle import Shapes, shape_distance
from clearway.obstacles.rounded_box import (
    box_distance,
    local_point,
    local_vector,
    outward_normal,
)

VolumeMode = Literal["fast", "fine", "reference"]
"""Fast: within 0.03 in each cell and 0.004 on average. Fine: within 0.005 and 0.001, with few and
large cells too, in some milliseconds. Reference: within 1e-5, in a second."""

FINE_NODES, FINE_NODES_IN_ALL = 2_000, 350_000
"""Parts of a cell in fine mode, and of the grid; as many as in fast mode at least."""


def base_probability(shapes: Shapes, grid: AvoidanceGrid, mode: VolumeMode = "fast") -> FloatArray:
    """[cells] share of each cell's volume that the union of obstacles fills (5.53).

    shapes: in the grid frame, from `ObstacleMap.in_grid`.
    """
    if mode == "fast":
        return _blurred_shares(shapes, cell_nodes(grid))
    if mode == "fine":
        per_cell = max(NODES_PER_CELL, min(FINE_NODES, FINE_NODES_IN_ALL // grid.cells))
        return _blurred_shares(shapes, cell_nodes(grid, per_cell))
    if mode == "reference":
        return union_shares(shapes, grid.edges)
    raise ClearwayError(f"volume mode {mode!r} is none of {', '.join(get_args(VolumeMode))}")


def coated_cells(shapes: Shapes, grid: AvoidanceGrid, margin_m: float) -> BoolArray:
    """[cells] that come within a margin of an obstacle (def. 5, def. 6).

    No such cell is left out; one that stays clear by less than a sixteenth of its volume's
    width or so may be counted. shapes: in the grid frame, reaching the margin beyond its range.
    """
    return _coated(shapes, cell_nodes(grid), float(margin_m))


class Parts(NamedTuple):
    """What shapes do to the parts of one cell at a time, in buffers that the caller lends."""

    filled: FloatArray
    """[parts] share so far."""
    main: FloatArray
    """[parts, 6] of the shape that fills most: share, normal, and between which offsets along the
    normal it lies."""
    beyond_m: FloatArray
    """[parts] how far beyond the faces of the shape that is looked at, before it is inflated."""
    touched: IntArray
    """[parts] those that it may add to."""


@compiled
def _blurred_shares(shapes: Shapes, nodes: CellNodes) -> FloatArray:
    shares = np.zeros(len(nodes.radius_m))
    near, most = near_cells(shapes, nodes), np.max(np.diff(nodes.first))
    touched = np.empty(most, dtype=np.int64)
    parts = Parts(np.empty(most), np.empty((most, 6)), np.empty(most), touched)
    for group in range(len(nodes.group_radius_m)):
        if look_around(shapes, nodes, group, 0.0, near) == 0:
            continue
        for c in range(nodes.group_first[group + 1] - nodes.group_first[group]):
            cell = nodes.by_group[nodes.group_first[group] + c]
            if near.covered[c]:
                shares[cell] = 1.0
            elif near.count[c] > 0:
                found = near.found[c, : near.count[c]]
                shares[cell] = _share_of(shapes, nodes, cell, found, parts)
    return shares


@borrowing
def _share_of(shapes: Shapes, nodes: CellNodes, cell: int, found: IntArray, parts: Parts) -> float:
    """The share of a cell that some shapes fill together."""
    first, count = nodes.first[cell], nodes.first[cell + 1] - nodes.first[cell]
    parts.filled[:] = 0.0
    parts.main[:] = 0.0
    for s in found:
        if _fill_parts(shapes, nodes, first, count, s, len(found) > 1, parts) == count:
            break
    share = 0.0
    for p in range(count):
        share += nodes.share[first + p] * parts.filled[p]
    return min(share, 1.0)


@borrowing
def _fill_parts(
    shapes: Shapes, nodes: CellNodes, first: int, count: int, s: int, several: bool, parts: Parts
) -> int:
    """Add shape s to what each of a cell's parts is filled by; how many are full then."""
    center, turn, half = shapes.center_m[s], shapes.rotation[s], shapes.half_m[s]
    radius, hx, hy, hz = shapes.radius_m[s], half[0], half[1], half[2]
    filled, main = parts.filled, parts.main
    xs, ys, zs = nodes.position_m[0], nodes.position_m[1], nodes.position_m[2]
    last = first + count
    _beyond(xs[first:last], ys[first:last], zs[first:last], center, turn, half, parts.beyond_m)
    touched, full = _touched(nodes.width_m[first:last], radius, parts)
    for p in parts.touched[:touched]:
        width = nodes.width_m[first + p]
        x, y, z = xs[first + p], ys[first + p], zs[first + p]
        lx, ly, lz = local_point(x, y, z, center, turn)
        share = blurred_share(lx, ly, lz, hx, hy, hz, radius, width)
        if not several:
            filled[p] = share
            continue
        nx, ny, nz = outward_normal(lx, ly, lz, half, turn)
        high = radius - box_distance(lx, ly, lz, hx, hy, hz)
        low = high - 2.0 * (radius + min(hx, min(hy, hz)))
        added = share
        if filled[p] > 0.0:
            # Surfaces meet as if by chance, but for parallel ones, whose overlap is a length.
            aligned = main[p, 1] * nx + main[p, 2] * ny + main[p, 3] * nz
            common = _common_length(main[p, 4], main[p, 5], low, high, aligned, 0.5 * width)
            overlap = filled[p] * share
            parallel = min(common / width, min(filled[p], share))
            added -= overlap + abs(aligned) * (parallel - overlap)
        filled[p] = min(filled[p] + added, 1.0)
        if share > main[p, 0]:
            main[p, 0], main[p, 1], main[p, 2], main[p, 3] = share, nx, ny, nz
            main[p, 4], main[p, 5] = low, high
    return full


@borrowing
def _beyond(
    x: FloatArray,
    y: FloatArray,
    z: FloatArray,
    center: FloatArray,
    turn: FloatArray,
    half: FloatArray,
    beyond: FloatArray,
) -> None:
    """Fill in how far beyond a shape's faces points [n] are: no branch in the loop."""
    cx, cy, cz, hx, hy, hz = center[0], center[1], center[2], half[0], half[1], half[2]
    for p in range(len(x)):
        lx, ly, lz = local_vector(x[p] - cx, y[p] - cy, z[p] - cz, turn)
        beyond[p] = max(abs(lx) - hx, max(abs(ly) - hy, abs(lz) - hz))


@borrowing
def _touched(width: FloatArray, radius: float, parts: Parts) -> tuple[int, int]:
    """How many parts an inflated shape may add to, and how many are full: nothing adds to those.

    Which they are cannot be foretold, so no branch asks: the others are written over.
    """
    count = full = 0
    for p in range(len(width)):
        is_full = parts.filled[p] == 1.0
        parts.touched[count] = p
        count += (not is_full) & (parts.beyond_m[p] < radius + 0.5 * width[p])
        full += is_full
    return count, full


@borrowing
def _common_length(
    low: float, high: float, other_low: float, other_high: float, aligned: float, reach: float
) -> float:
    """How much of [-reach, reach] two slabs share, the other one's normal turned if opposed."""
    if aligned < 0.0:
        other_low, other_high = -other_high, -other_low
    return max(min(min(high, other_high), reach) - max(max(low, other_low), -reach), 0.0)


@compiled
def _coated(shapes: Shapes, nodes: CellNodes, margin: float) -> BoolArray:
    coated = np.zeros(len(nodes.radius_m), dtype=np.bool_)
    near = near_cells(shapes, nodes)
    for group in range(len(nodes.group_radius_m)):
        if look_around(shapes, nodes, group, margin, near) == 0:
            continue
        for c in range(nodes.group_first[group + 1] - nodes.group_first[group]):
            cell = nodes.by_group[nodes.group_first[group] + c]
            coated[cell] = near.covered[c]
            found, n = near.found[c, : near.count[c]], nodes.first[cell]
            while n < nodes.first[cell + 1] and len(found) > 0 and not coated[cell]:
                coated[cell] = _near_node(shapes, nodes, n, margin, found)
                n += 1
    return coated


@borrowing
def _near_node(shapes: Shapes, nodes: CellNodes, node: int, margin: float, near: IntArray) -> bool:
    """Whether a shape may come within a margin of a node's part."""
    x, y, z = nodes.position_m[0, node], nodes.position_m[1, node], nodes.position_m[2, node]
    for s in near:
        if shape_distance(x, y, z, shapes, s) <= margin + nodes.node_radius_m[node]:
            return True
    return False
