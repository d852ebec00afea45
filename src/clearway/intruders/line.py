"""The simple line model (5.7)-(5.9): the intruder is a point that flies straight on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.compiled import compiled
from clearway.frames import FloatArray
from clearway.grid import AvoidanceGrid, GridEdges, cell_of_point
from clearway.intruders.cells import ModelArrays, ModelCells, empty_arrays, motions
from clearway.intruders.intruder import Intruder
from clearway.intruders.traverse import CELL, ENTRY, LEAVE, Borders, borders_of, scratch, traverse


def line_cells(grid: AvoidanceGrid, intruders: Sequence[Intruder]) -> ModelCells:
    """Line model of each intruder: probability 1 in the cells that its half-line passes (5.9).

    Intruders are in the grid's frame at the decision time, t = 0. Entry and leave are the hull of
    a re-entered cell, the dwell the time truly in it. One that stands still is in the cell of its
    position from 0 to infinity.
    """
    arrays = empty_arrays(len(intruders), grid.cells)
    position, velocity = motions(intruders)
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
        x, y, z = position[n]
        vx, vy, vz = velocity[n]
        if vx == 0.0 and vy == 0.0 and vz == 0.0:
            stay(n, cell_of_point(x, y, z, edges), arrays)
            continue
        for m in range(traverse((x, y, z), (vx, vy, vz), np.inf, borders, pieces)):
            cell = pieces.places[CELL, m]
            if arrays.dwell_s[n, cell] == 0.0:
                arrays.probability[n, cell] = 1.0
                arrays.entry_s[n, cell] = pieces.times[ENTRY, m]
            arrays.leave_s[n, cell] = pieces.times[LEAVE, m]
            arrays.dwell_s[n, cell] += pieces.times[LEAVE, m] - pieces.times[ENTRY, m]


@compiled
def stay(n: int, cell: int, arrays: ModelArrays) -> None:
    """An intruder that stands still is in its cell, if that is in the grid, for ever."""
    if cell >= 0:
        arrays.probability[n, cell] = 1.0
        arrays.entry_s[n, cell] = 0.0
        arrays.leave_s[n, cell] = np.inf
        arrays.dwell_s[n, cell] = np.inf
