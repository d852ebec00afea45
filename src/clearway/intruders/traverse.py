"""Exact traversal of a half-line through the cells of a grid: spheres, vertical planes, cones.

Seen from the grid's origin a line runs along half a great circle, which gives every crossing in
closed form and in order. The lines of the line model, the rays of a spread, the chords of a
body's tube and the segments of a reach set all pass through `traverse`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.compiled import compiled
from clearway.frames import FloatArray
from clearway.grid import BORDER_TOLERANCE, AvoidanceGrid, interval_of
from clearway.state import IntArray


class Borders(NamedTuple):
    """A grid's borders as the traversal takes them."""

    range_m: FloatArray
    azimuth_rad: FloatArray
    elevation_rad: FloatArray
    azimuth_cos: FloatArray
    azimuth_sin: FloatArray
    elevation_sin: FloatArray
    full_circle: bool
    """The first and the last azimuth edge are the same half-plane."""


class Pieces(NamedTuple):
    """Scratch for one traversal: where cells begin and end on the half-line."""

    cell: IntArray
    entry_s: FloatArray
    leave_s: FloatArray
    cuts_m: FloatArray
    """[3, n] where layer, column and row change, ascending, as lengths from the closest point."""
    index: IntArray
    """[3, n] layer, column, row from that length on; -1 outside the grid."""


@lru_cache(maxsize=16)
def borders_of(grid: AvoidanceGrid) -> Borders:
    """The borders of a grid, computed once."""
    azimuth = grid.azimuth_edges_rad
    return Borders(
        grid.range_edges_m,
        azimuth,
        grid.elevation_edges_rad,
        np.cos(azimuth),
        np.sin(azimuth),
        np.sin(grid.elevation_edges_rad),
        bool(azimuth[-1] - azimuth[0] > 2.0 * np.pi - BORDER_TOLERANCE),
    )


@compiled
def scratch(borders: Borders) -> Pieces:
    """Room for the longest traversal of a grid."""
    count = 2 * len(borders.range_m) + len(borders.azimuth_rad) + 2 * len(borders.elevation_rad) + 8
    return Pieces(
        np.empty(count, dtype=np.int64),
        np.empty(count),
        np.empty(count),
        np.empty((3, count)),
        np.empty((3, count), dtype=np.int64),
    )


@compiled
def traverse(
    position: tuple[float, float, float],
    velocity: tuple[float, float, float],
    end_s: float,
    borders: Borders,
    out: Pieces,
) -> int:
    """Cells that position + velocity t passes for 0 <= t <= end_s, in order (5.7)-(5.9).

    Fills `out.cell`, `out.entry_s`, `out.leave_s` and returns how many pieces there are; a cell
    comes twice if it is re-entered. A touch of measure zero (shorter or shallower than the grid's
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
    outer = borders.range_m[-1]
    inside2 = outer * outer - distance2
    if inside2 <= 2.0 * outer * BORDER_TOLERANCE:
        return 0
    half_chord = np.sqrt(inside2)
    start = max(-passed, -half_chord)
    end = min(end_s * speed - passed, half_chord)
    if end - start <= BORDER_TOLERANCE:
        return 0
    layers = _layer_cuts(distance2, start, end, borders, out)
    columns = _column_cuts(closest, direction, start, end, borders, out)
    rows = _row_cuts(closest, direction, distance2, start, end, borders, out)
    return _merge(start, end, passed, speed, layers, columns, rows, borders, out)


@compiled
def _layer_cuts(distance2: float, start: float, end: float, borders: Borders, out: Pieces) -> int:
    """Spheres: inwards to the innermost one that is truly entered, then outwards."""
    edges = borders.range_m
    last = len(edges) - 1
    cuts = out.cuts_m[0]
    index = out.index[0]
    count = 1
    cuts[0] = start
    index[0] = last - 1
    i = last - 1
    while i >= 0:
        depth2 = edges[i] * edges[i] - distance2
        if depth2 <= 2.0 * edges[i] * BORDER_TOLERANCE:
            break
        cut = -np.sqrt(depth2)
        if cut <= start:
            index[0] = i - 1
        elif cut < end:
            cuts[count] = cut
            index[count] = i - 1
            count += 1
        i -= 1
    for j in range(i + 1, last):
        cut = np.sqrt(edges[j] * edges[j] - distance2)
        if cut <= start:
            index[0] = j
        elif cut < end:
            cuts[count] = cut
            index[count] = j
            count += 1
    return count


@compiled
def _column_cuts(
    closest: tuple[float, float, float],
    direction: tuple[float, float, float],
    start: float,
    end: float,
    borders: Borders,
    out: Pieces,
) -> int:
    """Vertical half-planes: the azimuth only rises, or only falls, by less than pi in all."""
    cx, cy, _ = closest
    ux, uy, _ = direction
    cuts = out.cuts_m[1]
    index = out.index[1]
    cuts[0] = start
    moment = cx * uy - cy * ux
    level2 = ux * ux + uy * uy
    if moment * moment <= BORDER_TOLERANCE**2 * level2:
        return _column_cuts_through_axis(closest, direction, start, end, borders, out)
    columns = len(borders.azimuth_rad) - 1
    left = moment > 0.0
    count = 1
    for n in range(columns if borders.full_circle else columns + 1):
        j = n if left else (columns - 1 - n if borders.full_circle else columns - n)
        cosine, sine = borders.azimuth_cos[j], borders.azimuth_sin[j]
        rate = uy * cosine - ux * sine
        # On the half-plane itself, not on its other half: the distance moment / rate is positive.
        if rate * moment <= 0.0:
            continue
        cut = (cx * sine - cy * cosine) / rate
        if cut <= start or cut >= end:
            continue
        place = count
        while place > 1 and cuts[place - 1] > cut:
            cuts[place] = cuts[place - 1]
            index[place] = index[place - 1]
            place -= 1
        cuts[place] = cut
        index[place] = j if left else j - 1
        count += 1
    if count == 1:
        middle = 0.5 * (start + end)
        index[0] = interval_of(np.arctan2(cy + middle * uy, cx + middle * ux), borders.azimuth_rad)
        return 1
    index[0] = index[1] - 1 if left else index[1] + 1
    for n in range(count):
        if borders.full_circle:
            index[n] = index[n] % columns
        elif index[n] == columns:
            index[n] = -1
    return count


@compiled
def _column_cuts_through_axis(
    closest: tuple[float, float, float],
    direction: tuple[float, float, float],
    start: float,
    end: float,
    borders: Borders,
    out: Pieces,
) -> int:
    """A line in one vertical plane with the z axis: the azimuth turns round where it meets it."""
    cx, cy, _ = closest
    ux, uy, _ = direction
    level2 = ux * ux + uy * uy
    azimuth = borders.azimuth_rad
    if level2 == 0.0:
        out.index[1, 0] = interval_of(np.arctan2(cy, cx), azimuth)
        return 1
    axis = -(cx * ux + cy * uy) / level2
    if axis <= start or axis >= end:
        sign = 1.0 if axis <= start else -1.0
        out.index[1, 0] = interval_of(np.arctan2(sign * uy, sign * ux), azimuth)
        return 1
    out.index[1, 0] = interval_of(np.arctan2(-uy, -ux), azimuth)
    out.cuts_m[1, 1] = axis
    out.index[1, 1] = interval_of(np.arctan2(uy, ux), azimuth)
    return 2


@compiled
def _row_cuts(
    closest: tuple[float, float, float],
    direction: tuple[float, float, float],
    distance2: float,
    start: float,
    end: float,
    borders: Borders,
    out: Pieces,
) -> int:
    """Cones: along its great circle the line's elevation rises to a top and falls, or the reverse.

    With c and u the unit vectors to the closest point and along the line, sin(elevation) =
    c_z cos(psi) + u_z sin(psi) at the length |closest| tan(psi).
    """
    _, _, uz = direction
    rows = len(borders.elevation_rad) - 1
    index = out.index[2]
    out.cuts_m[2, 0] = start
    distance = np.sqrt(distance2)
    if distance <= BORDER_TOLERANCE:
        return _row_cuts_through_origin(uz, start, end, borders, out)
    cz = closest[2] / distance
    incline2 = cz * cz + uz * uz
    count = 1
    for half in range(2):
        rising = (half == 0) == (cz >= 0.0)
        for n in range(rows + 1):
            k = n if rising else rows - n
            sine = borders.elevation_sin[k]
            beyond = incline2 - sine * sine
            # Touched but not crossed: the top of the great circle is within the tolerance.
            if beyond <= 2.0 * abs(sine) * BORDER_TOLERANCE:
                continue
            root = -np.sqrt(beyond) if rising else np.sqrt(beyond)
            cos_psi = cz * sine - uz * root
            if cos_psi <= 0.0:
                continue
            cut = distance * (uz * sine + cz * root) / cos_psi
            if cut <= start or cut >= end:
                continue
            out.cuts_m[2, count] = cut
            index[count] = k if rising else k - 1
            if count == 1:
                index[0] = k - 1 if rising else k
            count += 1
    if count == 1:
        middle = 0.5 * (start + end)
        height = closest[2] + middle * uz
        level = np.sqrt(max(0.0, distance2 + middle * middle - height * height))
        index[0] = interval_of(np.arctan2(height, level), borders.elevation_rad)
    for n in range(count):
        if index[n] == rows:
            index[n] = -1
    return count


@compiled
def _row_cuts_through_origin(
    uz: float, start: float, end: float, borders: Borders, out: Pieces
) -> int:
    """A line through the origin: one elevation before it, the opposite one after it."""
    elevation = np.arcsin(min(1.0, max(-1.0, uz)))
    if start >= 0.0 or end <= 0.0:
        sign = 1.0 if start >= 0.0 else -1.0
        out.index[2, 0] = interval_of(sign * elevation, borders.elevation_rad)
        return 1
    out.index[2, 0] = interval_of(-elevation, borders.elevation_rad)
    out.cuts_m[2, 1] = 0.0
    out.index[2, 1] = interval_of(elevation, borders.elevation_rad)
    return 2


@compiled
def _merge(
    start: float,
    end: float,
    passed: float,
    speed: float,
    layers: int,
    columns: int,
    rows: int,
    borders: Borders,
    out: Pieces,
) -> int:
    """Walk the three lists of cuts together and write the cells between them."""
    cuts = out.cuts_m
    index = out.index
    column_count = len(borders.azimuth_rad) - 1
    row_count = len(borders.elevation_rad) - 1
    i = j = k = 0
    here = start
    count = 0
    while here < end:
        next_i = cuts[0, i + 1] if i + 1 < layers else end
        next_j = cuts[1, j + 1] if j + 1 < columns else end
        next_k = cuts[2, k + 1] if k + 1 < rows else end
        following = min(next_i, next_j, next_k)
        layer, column, row = index[0, i], index[1, j], index[2, k]
        if following - here > BORDER_TOLERANCE and layer >= 0 and column >= 0 and row >= 0:
            out.cell[count] = (layer * column_count + column) * row_count + row
            out.entry_s[count] = max(0.0, (here + passed) / speed)
            out.leave_s[count] = (following + passed) / speed
            count += 1
        here = following
        if i + 1 < layers and next_i <= following:
            i += 1
        if j + 1 < columns and next_j <= following:
            j += 1
        if k + 1 < rows and next_k <= following:
            k += 1
    return count
