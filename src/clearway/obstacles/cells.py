"""What map obstacles do to cells: base probability (5.52), (5.53), and coating (def. 5, def. 6)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from clearway.base.compiled import borrowing, compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.obstacles.cell_filling import parts_of, share_of
from clearway.obstacles.cell_nodes import NODES_PER_CELL, CellNodes, cell_nodes
from clearway.obstacles.cell_volume import union_shares
from clearway.obstacles.near_cells import look_around, near_cells
from clearway.obstacles.obstacle import Shapes, shape_distance

VolumeMode = Literal["fast", "fine", "reference"]
"""Fast: within 0.03 in each cell and 0.004 on average, with up to forty shapes in a cell. Fine:
within 0.005 and 0.001, with few and large cells too, in some milliseconds. Reference: within 1e-5,
in a second."""

FINE_NODES, FINE_NODES_IN_ALL = 2_000, 350_000
"""Parts of a cell in fine mode, and of the grid; as many as in fast mode at least."""
FAST_LOOKS, EVERY_LOOK = 4_000, 2**62
"""Shapes times parts of a cell that are looked at in fast and in fine mode. Where more than forty
shapes meet in a cell, fewer parts tell nearly as much, and a decision stays one of milliseconds."""


def base_probability(shapes: Shapes, grid: AvoidanceGrid, mode: VolumeMode = "fast") -> FloatArray:
    """[cells] share of each cell's volume that the union of obstacles fills (5.53).

    shapes: in the grid frame, from `ObstacleMap.in_grid`.
    """
    if mode == "fast":
        return _blurred_shares(shapes, cell_nodes(grid), FAST_LOOKS)
    if mode == "fine":
        per_cell = max(NODES_PER_CELL, min(FINE_NODES, FINE_NODES_IN_ALL // grid.cells))
        return _blurred_shares(shapes, cell_nodes(grid, per_cell), EVERY_LOOK)
    if mode == "reference":
        return union_shares(shapes, grid.edges)
    raise ClearwayError(f"volume mode {mode!r} is none of {', '.join(get_args(VolumeMode))}")


def coated_cells(shapes: Shapes, grid: AvoidanceGrid, margin_m: float) -> BoolArray:
    """[cells] that come within a margin of an obstacle (def. 5, def. 6).

    No such cell is left out; one that stays clear by less than a sixteenth of its volume's
    width or so may be counted. shapes: in the grid frame, reaching the margin beyond its range.
    """
    return _coated(shapes, cell_nodes(grid), float(margin_m))


@compiled
def _blurred_shares(shapes: Shapes, nodes: CellNodes, looks: int) -> FloatArray:
    shares = np.zeros(len(nodes.radius_m))
    near, parts = near_cells(shapes, nodes), parts_of(nodes)
    for group in range(len(nodes.group_radius_m)):
        if look_around(shapes, nodes, group, 0.0, near) == 0:
            continue
        for c in range(nodes.group_first[group + 1] - nodes.group_first[group]):
            cell = nodes.by_group[nodes.group_first[group] + c]
            if near.covered[c]:
                shares[cell] = 1.0
            elif near.many[c] > 0:
                found = near.found[c, : near.many[c]]
                shares[cell] = share_of(shapes, nodes, cell, found, looks, parts)
    return shares


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
            found, n = near.found[c, : near.many[c]], nodes.first[cell]
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
