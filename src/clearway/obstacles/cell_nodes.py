"""Each cell of a grid cut into near-cubes, computed once per grid."""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints, Ints2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray
from clearway.obstacles.cell_volume import part_of

NODES_PER_CELL = 100
ACROSS = 2
"""Cells of a group along each axis: what is far from the group is far from all of them."""


class CellNodes(NamedTuple):
    """Cells and the parts that they are cut into, as compiled loops take them."""

    center_m: Floats2
    """[cells, 3] grid frame."""
    radius_m: Floats
    """[cells] no point of the cell is farther from its centre."""
    first: Ints
    """[cells + 1] where a cell's nodes begin."""
    position_m: Floats2
    """[3, nodes] grid frame, by axis."""
    width_m: Floats
    """[nodes] edge of the cube of a node's volume."""
    node_radius_m: Floats
    """[nodes] no point of a node's part is farther from it."""
    share: Floats
    """[nodes] of the cell's volume; a cell's nodes sum to 1."""
    by_group: Ints
    """[cells] neighbours one after the other."""
    group_first: Ints
    """[groups + 1] where the cells of a group begin in `by_group`."""
    group_center_m: Floats2
    """[groups, 3] grid frame."""
    group_radius_m: Floats
    """[groups] no point of any of its cells is farther from its centre."""


@lru_cache(maxsize=16)
def cell_nodes(grid: AvoidanceGrid, per_cell: int = NODES_PER_CELL) -> CellNodes:
    """The nodes of each cell, about so many of them, as nearly cubes as the cell allows."""
    ranges, azimuths, elevations = grid.edges
    center, radius, counts = [], [], []
    for low, high in itertools.pairwise(ranges):
        for right, left in itertools.pairwise(azimuths):
            for bottom, top in itertools.pairwise(elevations):
                cell = part_of(low, high, right, left, bottom, top)
                center.append((cell.x, cell.y, cell.z))
                radius.append(cell.radius)
                middle = 0.5 * (low + high) / high
                counts.append(
                    _parts_along(per_cell, cell.out, cell.across * middle, cell.up * middle)
                )
    parts = np.array(counts, dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(parts.prod(axis=1))]).astype(np.int64)
    nodes = _cut_cells(ranges, azimuths, elevations, parts, first)
    groups = _groups(grid, np.array(center), np.array(radius))
    return CellNodes(np.array(center), np.array(radius), first, *nodes, *groups)


def _groups(
    grid: AvoidanceGrid, center_m: FloatArray, radius_m: FloatArray
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Cells in groups of `ACROSS` along every axis: their order, where each group begins, and a
    ball that holds it."""
    cells = np.arange(grid.cells).reshape(grid.shape)
    blocks = [
        cells[i : i + ACROSS, j : j + ACROSS, k : k + ACROSS].ravel()
        for i in range(0, grid.layers, ACROSS)
        for j in range(0, grid.columns, ACROSS)
        for k in range(0, grid.rows, ACROSS)
    ]
    centers = [center_m[block].mean(axis=0) for block in blocks]
    radii = [
        float((np.linalg.norm(center_m[block] - center, axis=1) + radius_m[block]).max())
        for block, center in zip(blocks, centers, strict=True)
    ]
    first = np.cumsum([0, *(len(block) for block in blocks)]).astype(np.int64)
    return np.concatenate(blocks), first, np.array(centers), np.array(radii)


def _parts_along(per_cell: int, *extents_m: float) -> list[int]:
    """In how many near-cubes to cut a cell along distance, azimuth and elevation."""
    width = (np.prod(extents_m) / per_cell) ** (1.0 / 3.0)
    return [max(2 if extent > 0.5 * width else 1, round(extent / width)) for extent in extents_m]


@compiled
def _cut_cells(
    ranges: Floats,
    azimuths: Floats,
    elevations: Floats,
    parts: Ints2,
    first: Ints,
) -> tuple[Floats2, Floats, Floats, Floats]:
    """Positions, widths, radii and volume shares of all nodes."""
    nodes = first[-1]
    position, width = np.empty((3, nodes)), np.empty(nodes)
    radius, share = np.empty(nodes), np.empty(nodes)
    columns, rows = len(azimuths) - 1, len(elevations) - 1
    for cell in range(len(parts)):
        i, j, k = cell // (columns * rows), cell // rows % columns, cell % rows
        d = np.linspace(ranges[i], ranges[i + 1], parts[cell, 0] + 1)
        a = np.linspace(azimuths[j], azimuths[j + 1], parts[cell, 1] + 1)
        e = np.linspace(elevations[k], elevations[k + 1], parts[cell, 2] + 1)
        whole = part_of(d[0], d[-1], a[0], a[-1], e[0], e[-1]).volume
        for n in range(first[cell], first[cell + 1]):
            rest, z = divmod(n - first[cell], parts[cell, 2])
            x, y = divmod(rest, parts[cell, 1])
            part = part_of(d[x], d[x + 1], a[y], a[y + 1], e[z], e[z + 1])
            # The outer half of a part holds more volume: its centroid lies beyond its middle.
            middle, thickness = 0.5 * (d[x] + d[x + 1]), part.out * part.out
            shift = thickness * middle / (6.0 * middle * middle + 0.5 * thickness)
            stretch = 1.0 + shift / middle
            position[0, n], position[1, n] = part.x * stretch, part.y * stretch
            position[2, n] = part.z * stretch
            width[n] = part.volume ** (1.0 / 3.0)
            radius[n] = part.radius + shift
            share[n] = part.volume / whole
    return position, width, radius, share
