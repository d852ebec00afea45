"""Where half-lines cross the borders between columns: vertical half-planes at the z axis.

Lengths run from the point closest to the origin.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
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
from clearway.traffic.models.half_lines import (
    ALONG_X,
    ALONG_Y,
    END,
    FROM_SLACK,
    FROM_X,
    FROM_Y,
    MOMENT,
    NEAR_X,
    NEAR_Y,
    START,
    TO_SLACK,
    TO_X,
    TO_Y,
    HalfLines,
)


@compiled
def cut_by_planes(lines: HalfLines, many: int, borders: Borders) -> None:
    """Fill in where the first so many cross each azimuth: it only rises, or only falls, by less
    than pi in all."""
    told = lines.told
    for n in range(many):
        cx, cy, ux, uy = told[NEAR_X, n], told[NEAR_Y, n], told[ALONG_X, n], told[ALONG_Y, n]
        start, end = told[START, n], told[END, n]
        moment = cx * uy - cy * ux
        from_x, from_y = cx + start * ux, cy + start * uy
        to_x, to_y = cx + end * ux, cy + end * uy
        turned = 1.0 if moment > 0.0 else -1.0
        told[MOMENT, n] = moment
        told[FROM_X, n], told[FROM_Y, n] = turned * from_x, turned * from_y
        told[TO_X, n], told[TO_Y, n] = turned * to_x, turned * to_y
        # What gets no farther beyond an edge than its tolerance has not crossed it.
        told[FROM_SLACK, n] = BORDER_TOLERANCE * np.sqrt(from_x * from_x + from_y * from_y)
        told[TO_SLACK, n] = BORDER_TOLERANCE * np.sqrt(to_x * to_x + to_y * to_y)
    for j in range(_half_planes(borders)):
        cosine, sine = borders.table[AZIMUTH_COS, j], borders.table[AZIMUTH_SIN, j]
        _cut_by_plane(told, cosine, sine, many, lines.planes[j])


@compiled
def _half_planes(borders: Borders) -> int:
    return borders.columns if borders.full_circle else borders.columns + 1


@compiled
def _cut_by_plane(told: Floats2, cosine: float, sine: float, many: int, cuts: Floats) -> None:
    """Crossed leftwards by lines that turn left, or rightwards by those that turn right: the other
    half of the same plane is crossed the other way."""
    for n in range(many):
        before = told[FROM_Y, n] * cosine - told[FROM_X, n] * sine
        after = told[TO_Y, n] * cosine - told[TO_X, n] * sine
        start, end = told[START, n], told[END, n]
        cut = start + (end - start) * before / (before - after)
        crossed = (before < -told[FROM_SLACK, n]) & (after > told[TO_SLACK, n])
        cuts[n] = cut if crossed else np.inf


@compiled
def column_cuts(lines: HalfLines, n: int, borders: Borders, out: TraversalPieces) -> int:
    """List the cuts of one line in order, from the second on, and the columns from each on."""
    told = lines.told
    moment, ux, uy = told[MOMENT, n], told[ALONG_X, n], told[ALONG_Y, n]
    if moment * moment <= borders.tolerance_m**2 * (ux * ux + uy * uy):
        return _cuts_through_axis(told, n, borders, out)
    left, columns = moment > 0.0, borders.columns
    out.times[COLUMN_CUT, 0] = told[START, n]
    count = _in_order(lines.planes, n, left, borders, out)
    if count == 1:
        middle = 0.5 * (told[START, n] + told[END, n])
        azimuth = np.arctan2(told[NEAR_Y, n] + middle * uy, told[NEAR_X, n] + middle * ux)
        out.places[COLUMN, 0] = interval_of(azimuth, borders.table[AZIMUTH, : columns + 1])
        return 1
    first = out.places[COLUMN, 1]
    if left:
        before = (columns if first < 0 else first) - 1
    else:
        before = first + 1 if first + 1 < columns else (0 if borders.full_circle else -1)
    out.places[COLUMN, 0] = columns - 1 if before < 0 and borders.full_circle else before
    return count


@compiled
def _in_order(planes: Floats2, n: int, left: bool, borders: Borders, out: TraversalPieces) -> int:
    """No branch asks which planes are crossed: what is not to be listed is written over."""
    times, places, columns = out.times, out.places, borders.columns
    edges = _half_planes(borders)
    beyond = columns if left else -1
    behind = columns - 1 if borders.full_circle else -1
    at, before, in_order = np.uint64(1), times[COLUMN_CUT, 0], True
    for m in range(edges):
        j = m if left else edges - 1 - m
        place = j if left else j - 1
        cut = planes[np.uint64(j), n]
        in_order &= cut >= before
        times[COLUMN_CUT, at] = cut
        places[COLUMN, at] = behind if place == beyond else place
        at += np.uint64(cut < np.inf)
        before = cut if cut < np.inf else before
    count = int(np.int64(at))
    if not in_order:
        _sort(count, out)
    return count


@compiled
def _sort(count: int, out: TraversalPieces) -> None:
    """Edges come in order of azimuth, which is the line's unless that passes behind."""
    times, places = out.times, out.places
    for m in range(2, count):
        cut, place, at = times[COLUMN_CUT, m], places[COLUMN, m], m
        while at > 1 and times[COLUMN_CUT, at - 1] > cut:
            times[COLUMN_CUT, at] = times[COLUMN_CUT, at - 1]
            places[COLUMN, at] = places[COLUMN, at - 1]
            at -= 1
        times[COLUMN_CUT, at], places[COLUMN, at] = cut, place


@compiled
def _cuts_through_axis(told: Floats2, n: int, borders: Borders, out: TraversalPieces) -> int:
    """A line in one vertical plane with the z axis: the azimuth turns round where it meets it."""
    cx, cy, ux, uy = told[NEAR_X, n], told[NEAR_Y, n], told[ALONG_X, n], told[ALONG_Y, n]
    start, end = told[START, n], told[END, n]
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
