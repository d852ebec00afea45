"""Which obstacles of the map concern which cells: (5.51) for a group of neighbours at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Ints, Ints2
from clearway.base.compiled import compiled
from clearway.base.rounding import SURELY
from clearway.obstacles.cell_nodes import CellNodes
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.rounded_box import local_vector
from clearway.obstacles.some_shapes import distances_off, lay_out_shapes

SURELY_M = 1e-9
"""Metres by which a shape must be nearer to a cell than asked, for all the rounding."""


class NearCells(NamedTuple):
    """What comes near the cells of one group at a time, in buffers that the caller lends."""

    rows: Floats2
    """[16, shapes] all shapes by coordinate, as `SomeShapes` has some."""
    off_m: Floats
    """[shapes] how far they are from the middle of the group."""
    nearby: Ints
    """[shapes] those that may come near the group."""
    center_m: Floats2
    """[3, cells of a group] by axis."""
    reach_m: Floats
    """[cells of a group] no point of the cell is farther from its centre."""
    enough_m: Floats
    """[cells of a group] how near its centre one shape alone decides of the cell."""
    distance_m: Floats
    """[cells of a group] of the shape that is looked at."""
    covered: Bools
    """[cells of a group] whether one shape, with the margin, is as near as that."""
    many: Ints
    """[cells of a group] how many shapes may come within the margin of others."""
    found: Ints2
    """[cells of a group, shapes] those, in order."""


@compiled
def near_cells(shapes: Shapes, nodes: CellNodes) -> NearCells:
    """Room for the largest group of a grid, and the shapes laid out."""
    most, many = np.max(np.diff(nodes.group_first)), len(shapes.radius_m)
    rows = np.empty((16, many))
    lay_out_shapes(shapes, np.arange(many), rows)
    return NearCells(
        rows,
        np.empty(many),
        np.empty(many, dtype=np.int64),
        np.empty((3, most)),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most, dtype=np.bool_),
        np.empty(most, dtype=np.int64),
        np.empty((most, many), dtype=np.int64),
    )


@compiled
def look_around(
    shapes: Shapes, nodes: CellNodes, group: int, margin: float, whole: bool, near: NearCells
) -> int:
    """Fill in what comes within a margin of a group's cells (5.51); how many shapes may.

    whole: cells count as covered where one shape, with the margin, holds them whole; else where one
    comes surely within the margin of their centre. Once all of them are, no more shapes are
    reported.
    """
    cells = nodes.by_group[nodes.group_first[group] : nodes.group_first[group + 1]]
    size = len(cells)
    for c in range(size):
        near.covered[c], near.many[c] = False, 0
    nearby = near.nearby[: _near_group(nodes, group, margin, near)]
    if len(nearby) == 0:
        return 0
    for c in range(size):
        near.reach_m[c] = nodes.radius_m[cells[c]]
        near.enough_m[c] = margin - (near.reach_m[c] if whole else SURELY_M)
        for axis in range(3):
            near.center_m[axis, c] = nodes.center_m[cells[c], axis]
    x, y, z = near.center_m[0, :size], near.center_m[1, :size], near.center_m[2, :size]
    for s in nearby:
        distances(x, y, z, shapes, s, near.distance_m)
        decided = 0
        for c in range(size):
            distance = near.distance_m[c]
            near.covered[c] |= distance <= near.enough_m[c]
            near.found[c, near.many[c]] = s
            near.many[c] += distance < margin + near.reach_m[c]
            decided += near.covered[c]
        if decided == size:
            break
    return len(nearby)


@compiled
def _near_group(nodes: CellNodes, group: int, margin: float, near: NearCells) -> int:
    """How many shapes may come within a margin of a group of cells; their numbers go first into
    `near.nearby`."""
    center, off, nearby = nodes.group_center_m[group], near.off_m, near.nearby
    distances_off(center[0], center[1], center[2], near.rows, off)
    within, count = SURELY * (nodes.group_radius_m[group] + margin), 0
    for s in range(len(off)):
        nearby[count] = s  # Written always and passed over if far: no branch.
        count += off[s] < within
    return count


@compiled
def distances(x: Floats, y: Floats, z: Floats, shapes: Shapes, s: int, distance: Floats) -> None:
    """Fill in `shape_distance` of points [n]: no branch in the loop, so that several go at once."""
    center, turn, half = shapes.center_m[s], shapes.rotation[s], shapes.half_m[s]
    cx, cy, cz, hx, hy, hz = center[0], center[1], center[2], half[0], half[1], half[2]
    radius = shapes.radius_m[s]
    for c in range(len(x)):
        lx, ly, lz = local_vector(x[c] - cx, y[c] - cy, z[c] - cz, turn)
        qx, qy, qz = abs(lx) - hx, abs(ly) - hy, abs(lz) - hz
        ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
        within = min(max(qx, max(qy, qz)), 0.0)
        distance[c] = within + np.sqrt(ox * ox + oy * oy + oz * oz) - radius
