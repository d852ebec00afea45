"""What map obstacles do to cells: base probability (5.52), (5.53), and coating (def. 5, def. 6)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from clearway.base.compiled import borrowing, compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.rounding import SURELY
from clearway.base.state import BoolArray, IntArray
from clearway.obstacles.cell_nodes import NODES_PER_CELL, CellNodes, cell_nodes
from clearway.obstacles.cell_share import blurred_share
from clearway.obstacles.cell_volume import union_shares
from clearway.obstacles.obstacle import Shapes, shape_distance
from clearway.obstacles.rounded_box import box_distance, local_vector, outward_normal

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


@borrowing
def _near_group(shapes: Shapes, nodes: CellNodes, group: int, margin: float, near: IntArray) -> int:
    """How many shapes may come within a margin of a group of cells; their numbers go into `near`, a
    buffer that lives as long as the caller's loop."""
    center, reach = nodes.group_center_m[group], nodes.group_radius_m[group]
    x, y, z = center[0], center[1], center[2]
    count = 0
    for s in range(len(shapes.radius_m)):
        dx = x - shapes.center_m[s, 0]
        dy = y - shapes.center_m[s, 1]
        dz = z - shapes.center_m[s, 2]
        limit = SURELY * (reach + margin + shapes.bound_m[s])
        if dx * dx + dy * dy + dz * dz < limit * limit:
            near[count] = s
            count += 1
    return count


@borrowing
def _candidates(
    shapes: Shapes, nodes: CellNodes, cell: int, margin: float, near: IntArray, found: IntArray
) -> tuple[int, bool]:
    """How many shapes may come within a margin of a cell (5.51), and whether one covers it whole.

    near: those that may come near its group. Their numbers go into `found`, a buffer that lives as
    long as the caller's loop.
    """
    x, y, z = nodes.center_m[cell, 0], nodes.center_m[cell, 1], nodes.center_m[cell, 2]
    reach = nodes.radius_m[cell]
    count = 0
    for s in near:
        dx = x - shapes.center_m[s, 0]
        dy = y - shapes.center_m[s, 1]
        dz = z - shapes.center_m[s, 2]
        limit = reach + margin + shapes.bound_m[s]
        if dx * dx + dy * dy + dz * dz >= limit * limit:
            continue
        distance = shape_distance(x, y, z, shapes, s)
        if distance <= margin - reach:
            return count, True
        if distance < margin + reach:
            found[count] = s
            count += 1
    return count, False


@compiled
def _blurred_shares(shapes: Shapes, nodes: CellNodes) -> FloatArray:
    shares = np.zeros(len(nodes.radius_m))
    near, found = np.empty((2, len(shapes.radius_m)), dtype=np.int64)
    most = np.max(np.diff(nodes.first))
    filled, main = np.empty(most), np.empty((most, 6))
    for group in range(len(nodes.group_radius_m)):
        nearby = near[: _near_group(shapes, nodes, group, 0.0, near)]
        if len(nearby) == 0:
            continue
        for cell in nodes.by_group[nodes.group_first[group] : nodes.group_first[group + 1]]:
            count, covered = _candidates(shapes, nodes, cell, 0.0, nearby, found)
            if covered:
                shares[cell] = 1.0
            elif count > 0:
                shares[cell] = _share_of(shapes, nodes, cell, found[:count], filled, main)
    return shares


@borrowing
def _share_of(
    shapes: Shapes,
    nodes: CellNodes,
    cell: int,
    found: IntArray,
    filled: FloatArray,
    main: FloatArray,
) -> float:
    """The share of a cell that some shapes fill together."""
    filled[:] = 0.0
    main[:] = 0.0
    for s in found:
        _fill_nodes(shapes, nodes, cell, s, len(found) > 1, filled, main)
    first, share = nodes.first[cell], 0.0
    for n in range(first, nodes.first[cell + 1]):
        share += nodes.share[n] * filled[n - first]
    return min(share, 1.0)


@borrowing
def _fill_nodes(
    shapes: Shapes,
    nodes: CellNodes,
    cell: int,
    s: int,
    several: bool,
    filled: FloatArray,
    main: FloatArray,
) -> None:
    """Add shape s to what each of a cell's parts is filled by, in the caller's buffers.

    filled: [parts] share so far; main: [parts, 6] of the shape that fills most, share, normal,
    and between which offsets along the normal it lies.
    """
    center, turn, half = shapes.center_m[s], shapes.rotation[s], shapes.half_m[s]
    radius, hx, hy, hz = shapes.radius_m[s], half[0], half[1], half[2]
    for n in range(nodes.first[cell], nodes.first[cell + 1]):
        width = nodes.width_m[n]
        dx = nodes.position_m[n, 0] - center[0]
        dy = nodes.position_m[n, 1] - center[1]
        dz = nodes.position_m[n, 2] - center[2]
        lx, ly, lz = local_vector(dx, dy, dz, turn)
        if max(abs(lx) - hx, max(abs(ly) - hy, abs(lz) - hz)) >= radius + 0.5 * width:
            continue
        share = blurred_share(lx, ly, lz, hx, hy, hz, radius, width)
        p = n - nodes.first[cell]
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
    near, found = np.empty((2, len(shapes.radius_m)), dtype=np.int64)
    for group in range(len(nodes.group_radius_m)):
        nearby = near[: _near_group(shapes, nodes, group, margin, near)]
        if len(nearby) == 0:
            continue
        for cell in nodes.by_group[nodes.group_first[group] : nodes.group_first[group + 1]]:
            count, covered = _candidates(shapes, nodes, cell, margin, nearby, found)
            coated[cell] = covered
            n = nodes.first[cell]
            while n < nodes.first[cell + 1] and count > 0 and not coated[cell]:
                coated[cell] = _near_node(shapes, nodes, n, margin, found[:count])
                n += 1
    return coated


@borrowing
def _near_node(shapes: Shapes, nodes: CellNodes, node: int, margin: float, near: IntArray) -> bool:
    """Whether a shape may come within a margin of a node's part."""
    x, y, z = nodes.position_m[node, 0], nodes.position_m[node, 1], nodes.position_m[node, 2]
    for s in near:
        if shape_distance(x, y, z, shapes, s) <= margin + nodes.node_radius_m[node]:
            return True
    return False
