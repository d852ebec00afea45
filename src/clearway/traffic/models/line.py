"""The simple line model (5.9): the intruder is a point that flies straight on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.grid import AvoidanceGrid, GridEdges, cell_of_point
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.borders import (
    CELL,
    ENTRY,
    LEAVE,
    Borders,
    TraversalPieces,
    compute_borders,
    scratch,
)
from clearway.traffic.models.cells import ModelArrays, ModelCells, empty_arrays
from clearway.traffic.models.half_lines import (
    BUNCH,
    END_S,
    SPEED_X,
    SPEED_Z,
    HalfLines,
    X,
    Z,
    room_for_lines,
    tell,
)
from clearway.traffic.models.many import Intruders
from clearway.traffic.models.traverse import cut_lines, pieces_of


def line_cells(grid: AvoidanceGrid, intruders: Sequence[Intruder]) -> ModelCells:
    """Line model of each intruder: probability 1 in the cells that its half-line passes (5.9).

    Intruders are in the grid's frame at the decision time, t = 0. Entry and leave are the hull of
    a re-entered cell, the dwell the time truly in it. One that stands still is in the cell of its
    position from 0 to infinity.
    """
    arrays = empty_arrays(len(intruders), grid.cells)
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    _lines(position, velocity, compute_borders(grid), grid.edges, arrays)
    return ModelCells(*arrays)


@compiled
def _lines(
    position: Floats2,
    velocity: Floats2,
    borders: Borders,
    edges: GridEdges,
    arrays: ModelArrays,
) -> None:
    lines, pieces = room_for_lines(borders), scratch(borders)
    for first in range(0, len(position), BUNCH):
        many = min(BUNCH, len(position) - first)
        lines.told[X : Z + 1, :many] = position[first : first + many].T
        lines.told[SPEED_X : SPEED_Z + 1, :many] = velocity[first : first + many].T
        lines.told[END_S, :many] = np.inf
        cut_lines(lines, many, borders)
        for m in range(many):
            n = first + m
            _follow(n, m, position[n], velocity[n], borders, edges, lines, pieces, arrays)


@compiled
def follow_line(
    n: int,
    position: Floats,
    velocity: Floats,
    borders: Borders,
    edges: GridEdges,
    lines: HalfLines,
    pieces: TraversalPieces,
    arrays: ModelArrays,
) -> None:
    """Fill row n with the cells of one half-line."""
    tell(
        lines,
        0,
        (position[0], position[1], position[2]),
        (velocity[0], velocity[1], velocity[2]),
        np.inf,
    )
    cut_lines(lines, 1, borders)
    _follow(n, 0, position, velocity, borders, edges, lines, pieces, arrays)


@compiled
def _follow(
    n: int,
    m: int,
    position: Floats,
    velocity: Floats,
    borders: Borders,
    edges: GridEdges,
    lines: HalfLines,
    pieces: TraversalPieces,
    arrays: ModelArrays,
) -> None:
    """Of line m of a bunch that has been cut."""
    if velocity[0] == 0.0 and velocity[1] == 0.0 and velocity[2] == 0.0:
        stay(n, cell_of_point(position[0], position[1], position[2], edges), arrays)
        return
    for piece in range(pieces_of(lines, m, borders, pieces)):
        cell = pieces.places[CELL, piece]
        entry, leave = pieces.times[ENTRY, piece], pieces.times[LEAVE, piece]
        if arrays.dwell_s[n, cell] == 0.0:
            arrays.probability[n, cell] = 1.0
            arrays.entry_s[n, cell] = entry
        arrays.leave_s[n, cell] = leave
        arrays.dwell_s[n, cell] += leave - entry


@compiled
def stay(n: int, cell: int, arrays: ModelArrays) -> None:
    """An intruder that stands still is in its cell, if that is in the grid, for ever."""
    if cell >= 0:
        arrays.probability[n, cell] = 1.0
        arrays.entry_s[n, cell] = 0.0
        arrays.leave_s[n, cell] = np.inf
        arrays.dwell_s[n, cell] = np.inf
