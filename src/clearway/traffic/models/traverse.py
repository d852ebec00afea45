"""Exact traversal of half-lines through the cells of a grid: spheres, vertical planes, cones.

Seen from the grid's origin a line runs along half a great circle, which gives every crossing in
closed form and in order. The lines of the line model, the rays of a spread, the chords of a
body's tube and the segments of a reach set are all cut by `cut_lines` and followed by `step`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.compiled import compiled
from clearway.traffic.models.borders import (
    CELL,
    COLUMN,
    COLUMN_CUT,
    CUT_LAYER,
    ENTRY,
    LAYER_CUT,
    LEAVE,
    ROW,
    ROW_CUT,
    Borders,
    TraversalPieces,
)
from clearway.traffic.models.column_cuts import column_cuts, cut_by_planes
from clearway.traffic.models.half_lines import (
    END,
    LINE_SPEED,
    PASSED,
    START,
    HalfLines,
    measure_half_lines,
)
from clearway.traffic.models.layer_cuts import cut_by_spheres, layer_cuts
from clearway.traffic.models.row_cuts import cut_by_cones, row_cuts

ONE = np.uint64(1)
"""Unsigned, as all indices are here: compiled code asks of signed ones whether they count from the
end."""


class Walk(NamedTuple):
    """How far a line has been followed."""

    layer_cut: np.uint64
    """Behind which cut of each list it is."""
    column_cut: np.uint64
    row_cut: np.uint64
    inner_cell: int
    """Cell of its column and row in the innermost layer; far below 0 outside."""
    wall: float
    """Length at which it leaves that column or row."""
    here: float
    """Length at which it is."""
    here_s: float
    """When it is there."""


@compiled
def cut_lines(lines: HalfLines, many: int, borders: Borders) -> None:
    """Work out all crossings of the first so many of a bunch that have been reported."""
    measure_half_lines(lines, many, borders)
    cut_by_planes(lines, many, borders)
    cut_by_cones(lines, many, borders)
    cut_by_spheres(lines, many, borders)


@compiled
def pieces_of(lines: HalfLines, n: int, borders: Borders, out: TraversalPieces) -> int:
    """Cells that one of a bunch passes, in order: (5.7), (5.8), (5.9).

    Fills rows CELL, ENTRY and LEAVE of `out` and returns how many pieces there are; a cell comes
    twice if it is re-entered. A touch of measure zero (shorter or shallower than the grid's
    border tolerance) does not count; on a border the grid's own rule decides. Without a speed
    nothing is passed.
    """
    passed, speed = lines.told[PASSED, n], lines.told[LINE_SPEED, n]
    walk, end = begin_walk(lines, n, borders, out)
    count = 0
    while walk.here < end:
        out.times[ENTRY, count] = walk.here_s
        cell, walk = step(walk, passed, speed, borders, out)
        out.times[LEAVE, count], out.places[CELL, count] = walk.here_s, cell
        count += cell >= 0
    return count


@compiled
def begin_walk(
    lines: HalfLines, n: int, borders: Borders, out: TraversalPieces
) -> tuple[Walk, float]:
    """List the cuts of one line that has been cut; where it is followed from, and to (m)."""
    told = lines.told
    start, end = told[START, n], told[END, n]
    first = np.uint64(0)
    nowhere = Walk(first, first, first, 0, end, np.inf, 0.0)
    if not end - start > borders.tolerance_m:
        return nowhere, end
    columns, rows = column_cuts(lines, n, borders, out), row_cuts(lines, n, borders, out)
    start, end = _between_walls(start, end, columns, rows, out)
    if not start < end:
        return nowhere, end
    layers = layer_cuts(lines.spheres, n, start, end, borders, out)
    times = out.times
    times[LAYER_CUT, layers] = times[COLUMN_CUT, columns] = times[ROW_CUT, rows] = end
    j = k = first
    while times[COLUMN_CUT, j + ONE] <= start:
        j += ONE
    while times[ROW_CUT, k + ONE] <= start:
        k += ONE
    start_s = max(0.0, (start + told[PASSED, n]) / told[LINE_SPEED, n])
    cell, wall = _column_and_row(j, k, borders, out)
    return Walk(first, j, k, cell, wall, start, start_s), end


@compiled
def _between_walls(
    start: float, end: float, columns: int, rows: int, out: TraversalPieces
) -> tuple[float, float]:
    """Where the grid's columns and rows are entered first and left last; empty if they never are.

    Most lines pass the grid's walls, and what is beyond them need not be walked.
    """
    j = 0
    while j < columns and out.places[COLUMN, j] < 0:
        j += 1
    k = 0
    while k < rows and out.places[ROW, k] < 0:
        k += 1
    if j == columns or k == rows:
        return end, start
    first = max(out.times[COLUMN_CUT, j], out.times[ROW_CUT, k])
    if out.places[COLUMN, columns - 1] < 0:
        end = min(end, out.times[COLUMN_CUT, columns - 1])
    if out.places[ROW, rows - 1] < 0:
        end = min(end, out.times[ROW_CUT, rows - 1])
    return first, end


@compiled
def _column_and_row(
    j: np.uint64, k: np.uint64, borders: Borders, out: TraversalPieces
) -> tuple[int, float]:
    """Cell in the innermost layer behind such cuts, and the length of the next of either."""
    column, row = out.places[COLUMN, j], out.places[ROW, k]
    cell = column * borders.rows + row
    if column < 0 or row < 0:
        cell = -borders.layers * borders.columns * borders.rows
    return cell, min(out.times[COLUMN_CUT, j + ONE], out.times[ROW_CUT, k + ONE])


@compiled
def step(
    walk: Walk, passed: float, speed: float, borders: Borders, out: TraversalPieces
) -> tuple[int, Walk]:
    """Follow a line to its next cut: the cell that it was in until then, -1 where that does not
    count.

    Lines mostly go on in their column and row to the next layer, which can be foretold.
    """
    i, j, k, inner_cell, wall, here, _ = walk
    cell = out.places[CUT_LAYER, i] * (borders.columns * borders.rows) + inner_cell
    following = out.times[LAYER_CUT, i + ONE]
    if following < wall:
        i += ONE
    else:
        i += np.uint64(following <= wall)
        following = wall
        j += np.uint64(out.times[COLUMN_CUT, j + ONE] <= wall)
        k += np.uint64(out.times[ROW_CUT, k + ONE] <= wall)
        inner_cell, wall = _column_and_row(j, k, borders, out)
    counts = (cell >= 0) & (following - here > borders.tolerance_m)
    following_s = (following + passed) / speed
    return cell if counts else -1, Walk(i, j, k, inner_cell, wall, following, following_s)
