"""Exact traversal of a half-line through the cells of a grid: spheres, vertical planes, cones.

Seen from the grid's origin a line runs along half a great circle, which gives every crossing in
closed form and in order. The lines of the line model, the rays of a spread, the chords of a
body's tube and the segments of a reach set all pass through `traverse`.
"""

from __future__ import annotations

import numpy as np

from clearway.compiled import compiled
from clearway.grid import BORDER_TOLERANCE, interval_of
from clearway.intruders.borders import (
    AZIMUTH,
    AZIMUTH_COS,
    AZIMUTH_SIN,
    CELL,
    COLUMN,
    COLUMN_CUT,
    ELEVATION,
    ELEVATION_COS,
    ELEVATION_SIN,
    ENTRY,
    LAYER,
    LAYER_CUT,
    LEAVE,
    RANGE,
    ROW,
    ROW_CUT,
    Borders,
    Pieces,
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
    table = borders.table
    last = borders.layers
    times, places = out.times, out.places
    count = 1
    times[LAYER_CUT, 0] = start
    places[LAYER, 0] = last - 1
    i = last - 1
    while i >= 0:
        depth2 = table[RANGE, i] * table[RANGE, i] - distance2
        if depth2 <= 2.0 * table[RANGE, i] * BORDER_TOLERANCE:
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
    moment = cx * uy - cy * ux
    if moment * moment <= BORDER_TOLERANCE**2 * (ux * ux + uy * uy):
        return _column_cuts_through_axis(closest, direction, start, end, borders, out)
    columns = borders.columns
    left = moment > 0.0
    count = _half_planes(
        left,
        (cx + start * ux, cy + start * uy, start),
        (cx + end * ux, cy + end * uy, end),
        borders,
        out,
    )
    out.times[COLUMN_CUT, 0] = start
    if count == 1:
        middle = 0.5 * (start + end)
        azimuth = np.arctan2(cy + middle * uy, cx + middle * ux)
        out.places[COLUMN, 0] = interval_of(azimuth, borders.table[AZIMUTH, : columns + 1])
        return 1
    out.places[COLUMN, 0] = out.places[COLUMN, 1] - 1 if left else out.places[COLUMN, 1] + 1
    for n in range(count):
        if borders.full_circle:
            out.places[COLUMN, n] = out.places[COLUMN, n] % columns
        elif out.places[COLUMN, n] == columns:
            out.places[COLUMN, n] = -1
    return count


@compiled
def _half_planes(
    left: bool,
    first: tuple[float, float, float],
    last: tuple[float, float, float],
    borders: Borders,
    out: Pieces,
) -> int:
    """Cuts from the second on, in order; first and last are x, y and length of the line's ends."""
    from_x, from_y, start = first
    to_x, to_y, end = last
    times, places = out.times, out.places
    columns = borders.columns
    # What gets no farther beyond an edge than its tolerance has not crossed it.
    slack_before = BORDER_TOLERANCE * np.sqrt(from_x * from_x + from_y * from_y)
    slack_after = BORDER_TOLERANCE * np.sqrt(to_x * to_x + to_y * to_y)
    count = 1
    for n in range(columns if borders.full_circle else columns + 1):
        j = n if left else (columns - 1 - n if borders.full_circle else columns - n)
        cosine, sine = borders.table[AZIMUTH_COS, j], borders.table[AZIMUTH_SIN, j]
        before = from_y * cosine - from_x * sine
        after = to_y * cosine - to_x * sine
        # Crossed leftwards by a line that turns left, or rightwards by one that turns right:
        # the other half of the same plane is crossed the other way.
        turned = 1.0 if left else -1.0
        if not (turned * before < -slack_before and turned * after > slack_after):
            continue
        cut = start + (end - start) * before / (before - after)
        # Edges come in order of azimuth, which is the line's unless that passes behind.
        place = count
        while place > 1 and times[COLUMN_CUT, place - 1] > cut:
            times[COLUMN_CUT, place] = times[COLUMN_CUT, place - 1]
            places[COLUMN, place] = places[COLUMN, place - 1]
            place -= 1
        times[COLUMN_CUT, place] = cut
        places[COLUMN, place] = j if left else j - 1
        count += 1
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
    out.times[COLUMN_CUT, 0] = start
    azimuth = borders.table[AZIMUTH, : borders.columns + 1]
    if level2 == 0.0:
        out.places[COLUMN, 0] = interval_of(np.arctan2(cy, cx), azimuth)
        return 1
    axis = -(cx * ux + cy * uy) / level2
    if axis <= start or axis >= end:
        sign = 1.0 if axis <= start else -1.0
        out.places[COLUMN, 0] = interval_of(np.arctan2(sign * uy, sign * ux), azimuth)
        return 1
    out.places[COLUMN, 0] = interval_of(np.arctan2(-uy, -ux), azimuth)
    out.times[COLUMN_CUT, 1] = axis
    out.places[COLUMN, 1] = interval_of(np.arctan2(uy, ux), azimuth)
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
    uz = direction[2]
    out.times[ROW_CUT, 0] = start
    distance = np.sqrt(distance2)
    if distance <= BORDER_TOLERANCE:
        return _row_cuts_through_origin(uz, start, end, borders, out)
    cz = closest[2] / distance
    top = np.sqrt(cz * cz + uz * uz)
    sine_from = (closest[2] + start * uz) / np.sqrt(distance2 + start * start)
    sine_to = (closest[2] + end * uz) / np.sqrt(distance2 + end * end)
    # Where the elevation turns.
    turn = distance * uz / cz if cz != 0.0 else -np.inf
    peak = top if cz > 0.0 else -top
    arc = (distance, cz, uz, start, end)
    count = 1
    if turn > start:
        count = _cones(arc, sine_from, peak if turn < end else sine_to, count, borders, out)
    if turn < end:
        count = _cones(arc, peak if turn > start else sine_from, sine_to, count, borders, out)
    if count == 1:
        middle = 0.5 * (start + end)
        height = closest[2] + middle * uz
        level = np.sqrt(max(0.0, distance2 + middle * middle - height * height))
        elevations = borders.table[ELEVATION, : borders.rows + 1]
        out.places[ROW, 0] = interval_of(np.arctan2(height, level), elevations)
    for n in range(count):
        if out.places[ROW, n] == borders.rows:
            out.places[ROW, n] = -1
    return count


@compiled
def _cones(
    arc: tuple[float, float, float, float, float],
    low: float,
    high: float,
    count: int,
    borders: Borders,
    out: Pieces,
) -> int:
    """Cuts, after `count` of them, of an arc whose elevation's sine goes from low to high."""
    distance, cz, uz, start, end = arc
    rising = high > low
    incline2 = cz * cz + uz * uz
    for n in range(borders.rows + 1):
        k = n if rising else borders.rows - n
        sine = borders.table[ELEVATION_SIN, k]
        # What gets no farther beyond an edge than its tolerance has not crossed it.
        slack = BORDER_TOLERANCE * borders.table[ELEVATION_COS, k]
        if not (min(low, high) < sine - slack and sine + slack < max(low, high)):
            continue
        beyond = incline2 - sine * sine
        # Touched but not crossed: the top of the great circle is within the tolerance.
        if beyond <= 2.0 * abs(sine) * BORDER_TOLERANCE:
            continue
        root = -np.sqrt(beyond) if rising else np.sqrt(beyond)
        cut = distance * (uz * sine + cz * root) / (cz * sine - uz * root)
        out.times[ROW_CUT, count] = min(max(cut, start), end)
        out.places[ROW, count] = k if rising else k - 1
        if count == 1:
            out.places[ROW, 0] = k - 1 if rising else k
        count += 1
    return count


@compiled
def _row_cuts_through_origin(
    uz: float, start: float, end: float, borders: Borders, out: Pieces
) -> int:
    """A line through the origin: one elevation before it, the opposite one after it."""
    elevation = np.arcsin(min(1.0, max(-1.0, uz)))
    if start >= 0.0 or end <= 0.0:
        sign = 1.0 if start >= 0.0 else -1.0
        out.places[ROW, 0] = interval_of(
            sign * elevation, borders.table[ELEVATION, : borders.rows + 1]
        )
        return 1
    out.places[ROW, 0] = interval_of(-elevation, borders.table[ELEVATION, : borders.rows + 1])
    out.times[ROW_CUT, 1] = 0.0
    out.places[ROW, 1] = interval_of(elevation, borders.table[ELEVATION, : borders.rows + 1])
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
    column_count = borders.columns
    row_count = borders.rows
    i = j = k = 0
    here = start
    count = 0
    while here < end:
        next_i = out.times[LAYER_CUT, i + 1] if i + 1 < layers else end
        next_j = out.times[COLUMN_CUT, j + 1] if j + 1 < columns else end
        next_k = out.times[ROW_CUT, k + 1] if k + 1 < rows else end
        following = min(next_i, next_j, next_k)
        layer, column, row = out.places[LAYER, i], out.places[COLUMN, j], out.places[ROW, k]
        if following - here > BORDER_TOLERANCE and layer >= 0 and column >= 0 and row >= 0:
            out.places[CELL, count] = (layer * column_count + column) * row_count + row
            out.times[ENTRY, count] = max(0.0, (here + passed) / speed)
            out.times[LEAVE, count] = (following + passed) / speed
            count += 1
        here = following
        if i + 1 < layers and next_i <= following:
            i += 1
        if j + 1 < columns and next_j <= following:
            j += 1
        if k + 1 < rows and next_k <= following:
            k += 1
    return count
