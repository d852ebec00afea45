"""A grid's borders and the scratch space, as the traversal of half-lines takes them."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2, Ints2
from clearway.base.compiled import compiled
from clearway.base.grid import BORDER_TOLERANCE, RANGE_TOLERANCE, AvoidanceGrid

# Rows of `Borders.table` and of `times` and `places` of the pieces: compiled functions pass a few
# wide arrays faster than many narrow ones.
RANGE = 0
AZIMUTH = 1
ELEVATION = 2
AZIMUTH_COS = 3
AZIMUTH_SIN = 4
ELEVATION_COS = 5
ELEVATION_SIN = 6
ENTRY = 0
LEAVE = 1
LAYER_CUT = 2
COLUMN_CUT = 3
ROW_CUT = 4
CELL = 0
CUT_LAYER = 1
COLUMN = 2
ROW = 3


class Borders(NamedTuple):
    """A grid's borders as the traversal takes them."""

    table: Floats2
    """[7, n] edges of range (m), azimuth and elevation (rad), and their cosines and sines."""
    layers: int
    columns: int
    rows: int
    full_circle: bool
    """The first and the last azimuth edge are the same half-plane."""
    tolerance_m: float
    """Pieces shorter and touches shallower than this do not count."""


class TraversalPieces(NamedTuple):
    """Scratch for one traversal, and its result."""

    times: Floats2
    """[5, n] entry and leave of each piece (s); then where the layer, the column and the row
    change, ascending, as lengths from the point closest to the origin (m)."""
    places: Ints2
    """[4, n] cell of each piece; then the layer, the column and the row from such a change on,
    -1 outside the grid."""


@lru_cache(maxsize=16)
def compute_borders(grid: AvoidanceGrid) -> Borders:
    """The borders of a grid, computed once."""
    table = np.zeros((7, 1 + max(grid.shape)))
    for row, edges in enumerate(grid.edges):
        table[row, : len(edges)] = edges
    table[AZIMUTH_COS] = np.cos(table[AZIMUTH])
    table[AZIMUTH_SIN] = np.sin(table[AZIMUTH])
    table[ELEVATION_COS] = np.maximum(0.0, np.cos(table[ELEVATION]))
    table[ELEVATION_SIN] = np.sin(table[ELEVATION])
    span = grid.azimuth_edges_rad[-1] - grid.azimuth_edges_rad[0]
    full_circle = bool(span > 2.0 * np.pi - BORDER_TOLERANCE)
    return Borders(table, *grid.shape, full_circle, RANGE_TOLERANCE * grid.range_m)


@compiled
def scratch(borders: Borders) -> TraversalPieces:
    """Room for the longest traversal of a grid."""
    count = 2 * borders.layers + borders.columns + 2 * borders.rows + 8
    return TraversalPieces(np.empty((5, count)), np.empty((4, count), dtype=np.int64))
