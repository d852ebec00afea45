"""The simple line model (5.9): the intruder is a point that flies straight on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid, GridEdges, cell_of_point
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.borders import (
    CELL,
    ENTRY,
    LEAVE,
    Borders,
    TraversalPieces,
    borders_of,
    scratch,
)
from clearway.traffic.models.cells import ModelArrays, ModelCells, empty_arrays
from clearway.traffic.models.many import Intruders
from clearway.traffic.models.traverse import traverse


def line_cells(grid: AvoidanceGrid, intruders: Sequence[Intruder]) -> ModelCells:
    """Line model of each intruder: probability 1 in the cells that its half-line passes (5.9).

    Intruders are in the grid's frame at the decision time, t = 0. Entry and leave are the hull of
    a re-entered cell, the dwell the time truly in it. One that stands still is in the cell of its
    position from 0 to infinity.
    """
    arrays = empty_arrays(len(intruders), grid.cells)
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    _lines(position, velocity, borders_of(grid), grid.edges, arrays)
    return ModelCells(*arrays)


@compiled
def _lines(
    position: FloatArray,
    velocity: FloatArray,
    borders: Borders,
    edges: GridEdges,
    arrays: ModelArrays,
) -> None:
    pieces = scratch(borders)
    for n in range(len(position)):
        follow_line(n, position[n], velocity[n], borders, edges, pieces, arrays)


@compiled
def follow_line(
    n: int,
    position: FloatArray,
    velocity: FloatArray,
    borders: Borders,
    edges: GridEdges,
    pieces: TraversalPieces,
    arrays: ModelArrays,
) -> None:
    """Fill row n with the cells of one half-line."""
    start = (position[0], position[1], position[2])
    motion = (velocity[0], velocity[1], velocity[2])
    if not np.any(velocity):
        stay(n, cell_of_point(start[0], start[1], start[2], edges), arrays)
        return
    for m in range(traverse(start, motion, np.inf, borders, pieces)):
        cell = pieces.places[CELL, m]
        entry, leave = pieces.times[ENTRY, m], pieces.times[LEAVE, m]
        if arrays.dwell_s[n, cell] == 0.0:
            arrays.probability[n, cell] = 1.0
            arrays.entry_s[n, cell] = entry
        arrays.leave_s[n, cell] = leave
        arrays.dwell_s[n, cell] += leave - entry


@borrowing
def stay(n: int, cell: int, arrays: ModelArrays) -> None:
    """An intruder that stands still is in its cell, if that is in the grid, for ever."""
    if cell >= 0:
        arrays.probability[n, cell] = 1.0
        arrays.entry_s[n, cell] = 0.0
        arrays.leave_s[n, cell] = np.inf
        arrays.dwell_s[n, cell] = np.inf
