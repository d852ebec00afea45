"""Where half-lines cross the borders between rows: cones around the z axis.

Lengths run from the point closest to the origin. Along its great circle a line's elevation rises
to a top and falls, or the reverse: with c and u the unit vectors to the closest point and along
the line, sin(elevation) = c_z cos(psi) + u_z sin(psi) at the length |closest| tan(psi).
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
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
from clearway.traffic.models.half_lines import (
    ALONG_Z,
    END,
    FIRST_FROM,
    FIRST_TO,
    MIDDLE_ROW_AT,
    MIDDLE_SINE,
    NEAR2,
    NEAR_AT,
    NEAR_SINE,
    NEAR_Z,
    START,
    THEN_FROM,
    THEN_TO,
    HalfLines,
)

SURE = 1e-8
"""Sines that differ by more are of elevations that differ by more than any tolerance."""
UNSURE = 1e6
"""More rows than any grid has."""


@compiled
def cut_by_cones(lines: HalfLines, many: int, borders: Borders) -> None:
    """Fill in where the first so many cross each elevation before theirs turns, and after."""
    told = lines.told
    for n in range(many):
        height, near2, uz = told[NEAR_Z, n], told[NEAR2, n], told[ALONG_Z, n]
        start, end = told[START, n], told[END, n]
        near = np.sqrt(near2)
        cz = height / near
        top = np.sqrt(cz * cz + uz * uz)
        sine_from = (height + start * uz) / np.sqrt(near2 + start * start)
        sine_to = (height + end * uz) / np.sqrt(near2 + end * end)
        # Where the elevation turns.
        turn = near * uz / cz if cz != 0.0 else -np.inf
        peak = top if cz > 0.0 else -top
        told[NEAR_AT, n], told[NEAR_SINE, n] = near, cz
        # Without a way before the turn, or after it, that goes nowhere.
        first_to = peak if turn < end else sine_to
        then_from = peak if turn > start else sine_from
        told[FIRST_FROM, n], told[FIRST_TO, n] = sine_from, first_to if turn > start else sine_from
        told[THEN_FROM, n], told[THEN_TO, n] = then_from if turn < end else sine_to, sine_to
        middle = 0.5 * (start + end)
        told[MIDDLE_SINE, n] = (height + middle * uz) / np.sqrt(near2 + middle * middle)
        told[MIDDLE_ROW_AT, n] = -1.0
    for k in range(borders.rows + 1):
        sine = borders.table[ELEVATION_SIN, k]
        # What gets no farther beyond an edge than its tolerance has not crossed it.
        slack = BORDER_TOLERANCE * borders.table[ELEVATION_COS, k]
        _cut_by_cone(told, sine, slack, many, lines.first[k], lines.then[k])
        for n in range(many):
            above, row = told[MIDDLE_SINE, n] - sine, told[MIDDLE_ROW_AT, n]
            row = row + 1.0 if above > 0.0 else row
            told[MIDDLE_ROW_AT, n] = row - UNSURE if abs(above) < SURE else row


@compiled
def _cut_by_cone(
    told: Floats2, sine: float, slack: float, many: int, first: Floats, then: Floats
) -> None:
    # Touched but not crossed: the top of the great circle is within the tolerance.
    touched = 2.0 * abs(sine) * BORDER_TOLERANCE
    for n in range(many):
        near, cz, uz = told[NEAR_AT, n], told[NEAR_SINE, n], told[ALONG_Z, n]
        start, end = told[START, n], told[END, n]
        beyond = cz * cz + uz * uz - sine * sine
        height = np.sqrt(beyond)
        low, high = told[FIRST_FROM, n], told[FIRST_TO, n]
        root = -height if high > low else height
        cut = near * (uz * sine + cz * root) / (cz * sine - uz * root)
        crossed = (min(low, high) < sine - slack) & (sine + slack < max(low, high))
        first[n] = min(max(cut, start), end) if crossed & (beyond > touched) else np.inf
        low, high = told[THEN_FROM, n], told[THEN_TO, n]
        root = -height if high > low else height
        cut = near * (uz * sine + cz * root) / (cz * sine - uz * root)
        crossed = (min(low, high) < sine - slack) & (sine + slack < max(low, high))
        then[n] = min(max(cut, start), end) if crossed & (beyond > touched) else np.inf


@compiled
def row_cuts(lines: HalfLines, n: int, borders: Borders, out: TraversalPieces) -> int:
    """List the cuts of one line in order, from the second on, and the rows from each on."""
    told = lines.told
    out.times[ROW_CUT, 0] = told[START, n]
    if told[NEAR_AT, n] <= borders.tolerance_m:
        return _cuts_through_origin(told[ALONG_Z, n], told[START, n], told[END, n], borders, out)
    rising = told[FIRST_TO, n] > told[FIRST_FROM, n]
    rising_then = told[THEN_TO, n] > told[THEN_FROM, n]
    count = _in_order(lines.first, n, rising, 1, borders, out)
    rising = rising if count > 1 else rising_then
    count = _in_order(lines.then, n, rising_then, count, borders, out)
    row, rows = int(told[MIDDLE_ROW_AT, n]), borders.rows
    if count == 1 and row < -1:
        row = _middle_row(told, n, borders)
    if count > 1:
        # What is behind the first cone that is crossed.
        row = out.places[ROW, 1]
        row = (row if row >= 0 else rows) - 1 if rising else row + 1
    out.places[ROW, 0] = row if row < rows else -1
    return count


@compiled
def _middle_row(told: Floats2, n: int, borders: Borders) -> int:
    """Row of the middle of a line that crosses no cone, by the grid's own rule."""
    middle = 0.5 * (told[START, n] + told[END, n])
    height = told[NEAR_Z, n] + middle * told[ALONG_Z, n]
    level = np.sqrt(max(0.0, told[NEAR2, n] + middle * middle - height * height))
    return interval_of(np.arctan2(height, level), borders.table[ELEVATION, : borders.rows + 1])


@compiled
def _in_order(
    cuts: Floats2, n: int, rising: bool, count: int, borders: Borders, out: TraversalPieces
) -> int:
    """After `count` of them. No branch asks which cones are crossed: what is not to be listed is
    written over."""
    times, places, rows, at = out.times, out.places, borders.rows, np.uint64(count)
    for m in range(rows + 1):
        k = m if rising else rows - m
        cut = cuts[np.uint64(k), n]
        times[ROW_CUT, at] = cut
        places[ROW, at] = (k if k < rows else -1) if rising else k - 1
        at += np.uint64(cut < np.inf)
    return int(np.int64(at))


@compiled
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
