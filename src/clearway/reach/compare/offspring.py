"""The hot loop of counting footprints: all movement ends that follow those of one footprint."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Int32s2, Ints
from clearway.base.compiled import compiled
from clearway.base.grid import GridEdges
from clearway.reach.expand.lattice import LatticePieces
from clearway.reach.expand.trace import NEAR, OUT_BEYOND, end_place

START_CELL = -1
"""Where the vehicle starts, and the space short of the first layer."""


@compiled
def offspring_of(
    state: Floats2,
    place: Int32s2,
    cell: int,
    deep: int,
    pieces: LatticePieces,
    rotation: Floats2,
    edges: GridEdges,
    most: int,
) -> tuple[int, Ints, Ints, Ints, Floats2, Int32s2]:
    """Nodes, ended, cells, start, state and place of what hangs below a footprint.

    Nodes is -1 when there are more states than `most`.
    """
    per_layer = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    last_layer = len(edges.range_m) - 2
    ended = np.zeros(per_layer + 1, dtype=np.int64)
    nodes, here, below = 0, len(state), 0
    waiting, waiting_place = state.copy(), place.copy()
    child, child_place = np.empty((1024, 4)), np.empty((1024, 2), dtype=np.int32)
    child_cell = np.empty(1024, dtype=np.int64)
    n = 0
    while n < here:
        at, depth = waiting_place[n, 0], waiting_place[n, 1] + 1
        origin = _origin(waiting[n])
        n += 1
        for m in range(pieces.following.shape[1]):
            if depth > deep or pieces.following[at, m] < 0:
                continue
            end = pieces.path[at, m, pieces.path.shape[2] - 1 :]
            to = end_place(origin, end, rotation, edges)
            if to == OUT_BEYOND:
                ended[per_layer] += 1
                continue
            to = START_CELL if to == NEAR else to
            if to < START_CELL or to // per_layer < cell // per_layer:
                continue
            nodes += 1
            if to // per_layer == last_layer:
                ended[to - last_layer * per_layer] += 1
            elif to == cell:
                if here == len(waiting):
                    waiting, waiting_place = _longer(waiting), _longer(waiting_place)
                _put(waiting[here], origin, end[0])
                waiting[here, 3] = waiting[n - 1, 3] + pieces.turn_rad[at, m]
                waiting_place[here, 0], waiting_place[here, 1] = pieces.following[at, m], depth
                here += 1
            else:
                if below == len(child):
                    child, child_place = _longer(child), _longer(child_place)
                    child_cell = np.append(child_cell, child_cell)
                _put(child[below], origin, end[0])
                child[below, 3] = waiting[n - 1, 3] + pieces.turn_rad[at, m]
                child_place[below, 0], child_place[below, 1] = pieces.following[at, m], depth
                child_cell[below] = to
                below += 1
        if here > most or below > most:
            nodes = -1
            break
    cells, start, order = _by_cell(child_cell[:below], last_layer * per_layer)
    return nodes, ended, cells, start, child[order], child_place[order]


@compiled
def _origin(state: Floats) -> tuple[float, float, float, float, float]:
    """x, y, z, and cosine and sine of yaw."""
    return state[0], state[1], state[2], np.cos(state[3]), np.sin(state[3])


@compiled
def _put(row: Floats, origin: tuple[float, float, float, float, float], end: Floats) -> None:
    """Enter the position at a movement's end into a row of states."""
    x, y, z, cosine, sine = origin
    row[0] = x + cosine * end[0] - sine * end[1]
    row[1] = y + sine * end[0] + cosine * end[1]
    row[2] = z + end[2]


@compiled
def _by_cell(cell_of: Ints, cells: int) -> tuple[Ints, Ints, Ints]:
    """Cells that occur, where each begins, and the order that sorts rows by cell."""
    counts = np.zeros(cells, dtype=np.int64)
    for cell in cell_of:
        counts[cell] += 1
    found = np.flatnonzero(counts)
    start = np.zeros(len(found) + 1, dtype=np.int64)
    start[1:] = np.cumsum(counts[found])
    slot = np.zeros(cells, dtype=np.int64)
    slot[found] = start[:-1]
    order = np.empty(len(cell_of), dtype=np.int64)
    for n, cell in enumerate(cell_of):
        order[slot[cell]] = n
        slot[cell] += 1
    return found, start, order


@compiled
def _longer(rows: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Room for twice as many rows."""
    longer = np.empty((2 * len(rows), rows.shape[1]), dtype=rows.dtype)
    longer[: len(rows)] = rows
    return longer
