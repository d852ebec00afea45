"""Where a half-line crosses the borders between columns: vertical half-planes at the z axis.

Lengths run from the point closest to the origin. Cuts are written into the scratch of `traverse`.
"""

from __future__ import annotations

import numpy as np

from clearway.base.compiled import borrowing, inlined
from clearway.base.grid import BORDER_TOLERANCE, interval_of
from clearway.traffic.models.borders import (
    AZIMUTH,
    AZIMUTH_COS,
    AZIMUTH_SIN,
    COLUMN,
    COLUMN_CUT,
    Borders,
    TraversalPieces,
)


@inlined
def column_cuts(
    closest: tuple[float, float, float],
    direction: tuple[float, float, float],
    start: float,
    end: float,
    borders: Borders,
    out: TraversalPieces,
) -> int:
    """Vertical half-planes: the azimuth only rises, or only falls, by less than pi in all."""
    cx, cy, _ = closest
    ux, uy, _ = direction
    moment = cx * uy - cy * ux
    if moment * moment <= borders.tolerance_m**2 * (ux * ux + uy * uy):
        return _cuts_through_axis(closest, direction, start, end, borders, out)
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


@inlined
def _half_planes(
    left: bool,
    first: tuple[float, float, float],
    last: tuple[float, float, float],
    borders: Borders,
    out: TraversalPieces,
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


@borrowing
def _cuts_through_axis(
    closest: tuple[float, float, float],
    direction: tuple[float, float, float],
    start: float,
    end: float,
    borders: Borders,
    out: TraversalPieces,
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
