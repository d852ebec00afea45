"""Where a half-line crosses the borders between rows: cones around the z axis.

Lengths run from the point closest to the origin. Cuts are written into the scratch of `traverse`.
"""

from __future__ import annotations

import numpy as np

from clearway.base.compiled import borrowing, inlined
from clearway.base.grid import BORDER_TOLERANCE, interval_of
from clearway.traffic.models.borders import (
    ELEVATION,
    ELEVATION_COS,
    ELEVATION_SIN,
    ROW,
    ROW_CUT,
    Borders,
    TraversalPieces,
)


@inlined
def row_cuts(
    closest: tuple[float, float, float],
    direction: tuple[float, float, float],
    distance2: float,
    start: float,
    end: float,
    borders: Borders,
    out: TraversalPieces,
) -> int:
    """Cones: along its great circle the line's elevation rises to a top and falls, or the reverse.

    With c and u the unit vectors to the closest point and along the line, sin(elevation) =
    c_z cos(psi) + u_z sin(psi) at the length |closest| tan(psi).
    """
    uz = direction[2]
    out.times[ROW_CUT, 0] = start
    distance = np.sqrt(distance2)
    if distance <= borders.tolerance_m:
        return _cuts_through_origin(uz, start, end, borders, out)
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


@inlined
def _cones(
    arc: tuple[float, float, float, float, float],
    low: float,
    high: float,
    count: int,
    borders: Borders,
    out: TraversalPieces,
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


@borrowing
def _cuts_through_origin(
    uz: float, start: float, end: float, borders: Borders, out: TraversalPieces
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
