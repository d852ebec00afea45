"""Exact traversal of a half-line through the cells of a grid: spheres, vertical planes, cones.

Seen from the grid's origin a line runs along half a great circle, which gives every crossing in
closed form and in order. The lines of the line model, the rays of a spread, the chords of a
body's tube and the segments of a reach set all pass through `traverse`.
"""

from __future__ import annotations

import numpy as np

from clearway.base.compiled import borrowing, inlined
from clearway.traffic.models.borders import (
    CELL,
    COLUMN,
    COLUMN_CUT,
    ENTRY,
    LAYER,
    LAYER_CUT,
    LEAVE,
    RANGE,
    ROW,
    ROW_CUT,
    Borders,
    TraversalPieces,
)
from clearway.traffic.models.column_cuts import column_cuts
from clearway.traffic.models.row_cuts import row_cuts


@borrowing
def traverse(
    position: tuple[float, float, float],
    velocity: tuple[float, float, float],
    end_s: float,
    borders: Borders,
    out: TraversalPieces,
) -> int:
    """Cells that position + velocity t passes for 0 <= t <= end_s, in order: (5.7), (5.8), (5.9).

    Fills rows CELL, ENTRY and LEAVE of `out` and returns how many pieces there are; a cell comes
    twice if it is re-entered. A touch of measure zero (shorter or shallower than the grid's
    border tolerance) does not count; on a border the grid's own rule decides. Without a speed
    nothing is passed.
    """
    vx, vy, vz = velocity
    speed = np.sqrt(vx * vx + vy * vy + vz * vz)
    if not speed > 0.0:
        return 0
    ux, uy, uz = vx / speed, vy / speed, vz / speed
    px, py, pz = position
    # Lengths run from the point closest to the origin, which keeps every crossing well scaled.
    passed = -(px * ux + py * uy + pz * uz)
    closest = (px + passed * ux, py + passed * uy, pz + passed * uz)
    direction = (ux, uy, uz)
    distance2 = closest[0] ** 2 + closest[1] ** 2 + closest[2] ** 2
    outer = borders.table[RANGE, borders.layers]
    inside2 = outer * outer - distance2
    if inside2 <= 2.0 * outer * borders.tolerance_m:
        return 0
    half_chord = np.sqrt(inside2)
    start = max(-passed, -half_chord)
    end = min(end_s * speed - passed, half_chord)
    if end - start <= borders.tolerance_m:
        return 0
    columns = column_cuts(closest, direction, start, end, borders, out)
    rows = row_cuts(closest, direction, distance2, start, end, borders, out)
    first, last = _between_walls(start, end, columns, rows, out)
    if not first < last:
        return 0
    layers = _layer_cuts(distance2, first, last, borders, out)
    return _merge(first, last, passed, speed, layers, columns, rows, borders, out)


@inlined
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


@inlined
def _layer_cuts(
    distance2: float, start: float, end: float, borders: Borders, out: TraversalPieces
) -> int:
    """Spheres: inwards to the innermost one that is truly entered, then outwards."""
    table = borders.table
    last = borders.layers
    times, places = out.times, out.places
    count = 1
    times[LAYER_CUT, 0] = start
    places[LAYER, 0] = last - 1
    i = last - 1
    while i >= 0:
        depth2 = table[RANGE, i] * table[RANGE, i] - distance2
        if depth2 <= 2.0 * table[RANGE, i] * borders.tolerance_m:
            break
        cut = -np.sqrt(depth2)
        if cut <= start:
            places[LAYER, 0] = i - 1
        elif cut < end:
            times[LAYER_CUT, count] = cut
            places[LAYER, count] = i - 1
            count += 1
        i -= 1
    for j in range(i + 1, last):
        cut = np.sqrt(table[RANGE, j] * table[RANGE, j] - distance2)
        if cut <= start:
            places[LAYER, 0] = j
        elif cut < end:
            times[LAYER_CUT, count] = cut
            places[LAYER, count] = j
            count += 1
    return count


@inlined
def _merge(
    start: float,
    end: float,
    passed: float,
    speed: float,
    layers: int,
    columns: int,
    rows: int,
    borders: Borders,
    out: TraversalPieces,
) -> int:
    """Walk the three lists of cuts together and write the cells between them.

    Which list has the next cut cannot be foretold, so no branch asks: what is not to be written is
    written over.
    """
    times, places, least = out.times, out.places, borders.tolerance_m
    times[LAYER_CUT, layers] = times[COLUMN_CUT, columns] = times[ROW_CUT, rows] = end
    i = j = k = count = 0
    while times[COLUMN_CUT, j + 1] <= start:
        j += 1
    while times[ROW_CUT, k + 1] <= start:
        k += 1
    here, here_s = start, max(0.0, (start + passed) / speed)
    while here < end:
        next_i = times[LAYER_CUT, i + 1]
        next_j = times[COLUMN_CUT, j + 1]
        next_k = times[ROW_CUT, k + 1]
        following = min(next_i, next_j, next_k)
        following_s = (following + passed) / speed
        layer, column, row = places[LAYER, i], places[COLUMN, j], places[ROW, k]
        places[CELL, count] = (layer * borders.columns + column) * borders.rows + row
        times[ENTRY, count] = here_s
        times[LEAVE, count] = following_s
        count += (following - here > least) & (layer >= 0) & (column >= 0) & (row >= 0)
        here, here_s = following, following_s
        i += next_i <= following
        j += next_j <= following
        k += next_k <= following
    return count
