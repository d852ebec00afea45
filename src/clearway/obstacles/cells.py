"""What obstacles do to cells: base probability (5.52), (5.53), and inflation (def. 5, def. 6)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from clearway.base.arrays import Bools, Floats, Ints
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.obstacles.cell_filling import estimate_share, parts_of
from clearway.obstacles.cell_nodes import NODES_PER_CELL, CellNodes, cell_nodes
from clearway.obstacles.cell_volume import union_shares
from clearway.obstacles.near_cells import distances, look_around, near_cells
from clearway.obstacles.obstacle import Shapes

VolumeMode = Literal["fast", "fine", "reference"]
"""Fast: within 0.03 in each cell and 0.004 on average, with up to forty shapes in a cell. Fine:
within 0.005 and 0.001, with few and large cells too, in some milliseconds. Reference: within 1e-5,
in a second."""

FINE_NODES = 2_000
FINE_NODES_IN_ALL = 350_000
"""Parts of a cell in fine mode, and of the grid; as many as in fast mode at least."""
FAST_LOOKS = 4_000
EVERY_LOOK = 2**62
"""Shapes times parts of a cell that are looked at in fast and in fine mode. Where more than forty
shapes meet in a cell, fewer parts tell nearly as much, and a decision stays one of milliseconds."""
COAT_LOOKS = 10_000
"""Shapes times parts of a cell that are looked at before it is taken for inflated: where more than
a hundred shapes come as near as that, one will not matter."""


def base_probability(shapes: Shapes, grid: AvoidanceGrid, mode: VolumeMode = "fast") -> FloatArray:
    """[cells] share of each cell's volume that the union of obstacles fills (5.53).

    shapes: in the grid frame, from `ObstacleMap.in_grid`.
    """
    if mode == "fast":
        return _blur_shares(shapes, cell_nodes(grid), FAST_LOOKS)
    if mode == "fine":
        per_cell = max(NODES_PER_CELL, min(FINE_NODES, FINE_NODES_IN_ALL // grid.cells))
        return _blur_shares(shapes, cell_nodes(grid, per_cell), EVERY_LOOK)
    if mode == "reference":
        return union_shares(shapes, grid.edges)
    raise ClearwayError(f"volume mode {mode!r} is none of {', '.join(get_args(VolumeMode))}")


def inflate_shapes(shapes: Shapes, grid: AvoidanceGrid, margin_m: float) -> BoolArray:
    """[cells] that come within a margin of an obstacle (def. 5, def. 6).

    No such cell is left out; one that stays clear by less than a sixteenth of its volume's
    width or so may be counted, and any that more than a hundred shapes come near.
    shapes: in the grid frame, reaching the margin beyond its range.
    """
    return _find_inflated(shapes, cell_nodes(grid), float(margin_m))


@compiled
def _blur_shares(shapes: Shapes, nodes: CellNodes, looks: int) -> Floats:
    shares = np.zeros(len(nodes.radius_m))
    near, parts = near_cells(shapes, nodes), parts_of(nodes)
    for group in range(len(nodes.group_radius_m)):
        if look_around(shapes, nodes, group, 0.0, True, near) == 0:
            continue
        for c in range(nodes.group_first[group + 1] - nodes.group_first[group]):
            cell = nodes.by_group[nodes.group_first[group] + c]
            if near.covered[c]:
                shares[cell] = 1.0
            elif near.many[c] > 0:
                found = near.found[c, : near.many[c]]
                shares[cell] = estimate_share(shapes, nodes, cell, found, looks, parts)
    return shares


@compiled
def _find_inflated(shapes: Shapes, nodes: CellNodes, margin: float) -> Bools:
    coated = np.zeros(len(nodes.radius_m), dtype=np.bool_)
    near, distance = near_cells(shapes, nodes), np.empty(np.max(np.diff(nodes.first)))
    for group in range(len(nodes.group_radius_m)):
        if look_around(shapes, nodes, group, margin, False, near) == 0:
            continue
        for c in range(nodes.group_first[group + 1] - nodes.group_first[group]):
            cell = nodes.by_group[nodes.group_first[group] + c]
            coated[cell] = near.covered[c]
            if not near.covered[c]:
                found = near.found[c, : near.many[c]]
                coated[cell] = _near_node(shapes, nodes, cell, margin, found, distance)
    return coated


@compiled
def _near_node(
    shapes: Shapes,
    nodes: CellNodes,
    cell: int,
    margin: float,
    near: Ints,
    distance: Floats,
) -> bool:
    """Whether a shape may come within a margin of a part of a cell; so it is, where all the looks
    are taken and more shapes are left. distance: room for as many as a cell has parts."""
    first, last = nodes.first[cell], nodes.first[cell + 1]
    x, y = nodes.position_m[0, first:last], nodes.position_m[1, first:last]
    z, radius = nodes.position_m[2, first:last], nodes.node_radius_m[first:last]
    for looked in range(len(near)):
        if looked * len(x) >= COAT_LOOKS:
            return True
        distances(x, y, z, shapes, near[looked], distance)
        within = False
        for n in range(len(x)):
            within |= distance[n] <= margin + radius[n]
        if within:
            return True
    return False
