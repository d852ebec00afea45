"""First and last time of an elliptic cone in each cell, where rays of its surface miss them.

The time of arrival is linear in space, so its extremes over the part of a cell inside the cone
lie on corners, on edges (where it turns, or where the cone's surface cuts them), on the spheres'
points that face the way of flight, or on the surface itself. Rays find the last kind; this file
finds the others.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import interval_of
from clearway.traffic.models.borders import (
    AZIMUTH,
    AZIMUTH_COS,
    AZIMUTH_SIN,
    ELEVATION,
    ELEVATION_COS,
    ELEVATION_SIN,
    ENTRY,
    LEAVE,
    RANGE,
    Borders,
)

SideArray = npt.NDArray[np.uint8]
INSIDE = 16
"""Beside four bits for the planes about the cone."""


@compiled
def cone_of(
    apex: FloatArray, along: FloatArray, level: FloatArray, across: FloatArray
) -> FloatArray:
    """A cone [3, 4]: rows that give time of arrival, level and across deviation of (x, y, z, 1).

    along: unit vector over the speed; level, across: unit vectors over the growth of the semi-axes
    per second. All three results are in seconds: inside, the deviations are less than the time.
    """
    cone = np.empty((3, 4))
    cone[0, :3], cone[1, :3], cone[2, :3] = along, level, across
    for row in range(3):
        cone[row, 3] = -np.sum(cone[row, :3] * apex)
    return cone


@borrowing
def _arrival(x: float, y: float, z: float, cone: FloatArray) -> tuple[float, float, float]:
    """Time of arrival at a point and its deviations, level and across, all in seconds."""
    return (
        x * cone[0, 0] + y * cone[0, 1] + z * cone[0, 2] + cone[0, 3],
        x * cone[1, 0] + y * cone[1, 1] + z * cone[1, 2] + cone[1, 3],
        x * cone[2, 0] + y * cone[2, 1] + z * cone[2, 2] + cone[2, 3],
    )


@borrowing
def _inside(time: float, level: float, across: float) -> bool:
    return time >= 0.0 and level * level + across * across <= time * time


@borrowing
def _arrival_on_edge(
    place: tuple[int, int, int], along: int, part: float, cone: FloatArray, borders: Borders
) -> tuple[float, float, float]:
    """The same at a part of the edge that runs along an axis of the grid from a corner."""
    i, j, k = place
    table = borders.table
    r = table[RANGE, i]
    azimuth_cos, azimuth_sin = table[AZIMUTH_COS, j], table[AZIMUTH_SIN, j]
    elevation_cos, elevation_sin = table[ELEVATION_COS, k], table[ELEVATION_SIN, k]
    if along == 0:
        r += part * (table[RANGE, i + 1] - r)
    elif along == 1:
        azimuth = table[AZIMUTH, j] + part * (table[AZIMUTH, j + 1] - table[AZIMUTH, j])
        azimuth_cos, azimuth_sin = np.cos(azimuth), np.sin(azimuth)
    else:
        elevation = table[ELEVATION, k] + part * (table[ELEVATION, k + 1] - table[ELEVATION, k])
        elevation_cos, elevation_sin = np.cos(elevation), np.sin(elevation)
    level = r * elevation_cos
    return _arrival(level * azimuth_cos, level * azimuth_sin, r * elevation_sin, cone)


@borrowing
def _widen(
    time: float,
    place: tuple[int, int, int],
    borderline: tuple[bool, bool, bool],
    borders: Borders,
    times: FloatArray,
) -> None:
    """Widen the met cells around a point inside the cone.

    place: layer, column, row of a cell, or of an edge where the point is on that edge
    (`borderline`), which concerns the cells on both its sides.
    """
    i, j, k = place
    on_sphere, on_plane, on_cone = borderline
    columns, rows = borders.columns, borders.rows
    for a in range(max(0, i - on_sphere), min(i + 1, borders.layers)):
        for b in range(max(0, j - on_plane), min(j + 1, columns)):
            for c in range(max(0, k - on_cone), min(k + 1, rows)):
                cell = (a * columns + b) * rows + c
                if times[cell, ENTRY] <= times[cell, LEAVE]:
                    times[cell, ENTRY] = min(times[cell, ENTRY], time)
                    times[cell, LEAVE] = max(times[cell, LEAVE], time)


@borrowing
def _side_of(time: float, level: float, across: float) -> int:
    """Where a point is, in bits: inside the cone, or beyond which of four planes about it."""
    if _inside(time, level, across):
        return INSIDE
    return (level > time) + 2 * (level < -time) + 4 * (across > time) + 8 * (across < -time)


@borrowing
def widen_by_edges(
    cone: FloatArray,
    borders: Borders,
    corners: FloatArray,
    sides: SideArray,
    tolerance: float,
    times: FloatArray,
) -> None:
    """Widen times [cells, ENTRY and LEAVE] by corners in the cone and edges that it cuts.

    corners, sides: scratch [layers + 1, columns + 1, rows + 1, 3] and the same without the 3. A cut
    is first taken on the edge's chord, and right within `tolerance` as a share of the cone's width.
    What lies on one side of the cone at both ends is not cut.
    """
    table = borders.table
    low, high = _met_box(borders, times)
    for j in range(low[1], high[1] + 1):
        for k in range(low[2], high[2] + 1):
            level, sine = table[ELEVATION_COS, k], table[ELEVATION_SIN, k]
            x, y = level * table[AZIMUTH_COS, j], level * table[AZIMUTH_SIN, j]
            for i in range(low[0], high[0] + 1):
                r = table[RANGE, i]
                time, u, w = _arrival(r * x, r * y, r * sine, cone)
                corners[i, j, k, 0], corners[i, j, k, 1], corners[i, j, k, 2] = time, u, w
                side = sides[i, j, k] = _side_of(time, u, w)
                if side == INSIDE:
                    _widen(time, (i, j, k), (True, True, True), borders, times)
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                side = sides[i, j, k]
                if i < high[0] and not side & sides[i + 1, j, k]:
                    _widen_edge(
                        (i, j, k), (i + 1, j, k), 0, cone, borders, corners, tolerance, times
                    )
                if j < high[1] and not side & sides[i, j + 1, k]:
                    _widen_edge(
                        (i, j, k), (i, j + 1, k), 1, cone, borders, corners, tolerance, times
                    )
                if k < high[2] and not side & sides[i, j, k + 1]:
                    _widen_edge(
                        (i, j, k), (i, j, k + 1), 2, cone, borders, corners, tolerance, times
                    )


@borrowing
def _met_box(
    borders: Borders, times: FloatArray
) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """Lowest and highest edge of layer, column and row around all met cells."""
    low_i, low_j, low_k = borders.layers, borders.columns, borders.rows
    high_i = high_j = high_k = -1
    cell = 0
    for i in range(borders.layers):
        for j in range(borders.columns):
            for k in range(borders.rows):
                if times[cell, ENTRY] <= times[cell, LEAVE]:
                    low_i, high_i = min(low_i, i), max(high_i, i + 1)
                    low_j, high_j = min(low_j, j), max(high_j, j + 1)
                    low_k, high_k = min(low_k, k), max(high_k, k + 1)
                cell += 1
    return (low_i, low_j, low_k), (high_i, high_j, high_k)


@borrowing
def _widen_edge(
    place: tuple[int, int, int],
    other: tuple[int, int, int],
    along: int,
    cone: FloatArray,
    borders: Borders,
    corners: FloatArray,
    tolerance: float,
    times: FloatArray,
) -> None:
    """Widen by where the cone's surface cuts one edge: once, or twice if both ends are outside.

    On the chord a b^2 + 2 b part + c = deviation^2 - time^2 is 0 there.
    """
    i, j, k = place
    time, u, w = corners[i, j, k, 0], corners[i, j, k, 1], corners[i, j, k, 2]
    i, j, k = other
    far_time, far_u, far_w = corners[i, j, k, 0], corners[i, j, k, 1], corners[i, j, k, 2]
    first, second = _inside(time, u, w), _inside(far_time, far_u, far_w)
    borderline = (along != 0, along != 1, along != 2)
    dt, du, dw = far_time - time, far_u - u, far_w - w
    a = du * du + dw * dw - dt * dt
    b = u * du + w * dw - time * dt
    c = u * u + w * w - time * time
    if second:
        a, b, c = a, -(a + b), a + 2.0 * b + c
    if first or second:
        guess = -c / (b + np.sqrt(max(0.0, b * b - a * c)))
        if first:
            cut_s = _cut(place, along, 0.0, 1.0, guess, cone, borders, tolerance)
        else:
            cut_s = _cut(place, along, 1.0, 0.0, 1.0 - guess, cone, borders, tolerance)
        _widen(cut_s, place, borderline, borders, times)
        return
    beyond = b * b - a * c
    if not (a > 0.0 and b < 0.0 and a + b > 0.0 and beyond > 0.0 and time * a > b * dt):
        return
    middle, half = -b / a, np.sqrt(beyond) / a
    if not _inside(*_arrival_on_edge(place, along, middle, cone, borders)):
        return
    cut_s = _cut(place, along, middle, 0.0, middle - half, cone, borders, tolerance)
    _widen(cut_s, place, borderline, borders, times)
    cut_s = _cut(place, along, middle, 1.0, middle + half, cone, borders, tolerance)
    _widen(cut_s, place, borderline, borders, times)


@borrowing
def _cut(
    place: tuple[int, int, int],
    along: int,
    inner: float,
    outer: float,
    guess: float,
    cone: FloatArray,
    borders: Borders,
    tolerance: float,
) -> float:
    """Time of arrival where an edge leaves the cone between an inner and an outer part of it.

    Bisection from a guess, which the chord mostly gives well enough.
    """
    part = min(max(guess, 0.0), 1.0)
    time = 0.0
    for _ in range(60):
        time, u, w = _arrival_on_edge(place, along, part, cone, borders)
        beyond = np.sqrt(u * u + w * w) - time
        if abs(beyond) <= tolerance * time:
            break
        if beyond <= 0.0:
            inner = part
        else:
            outer = part
        part = 0.5 * (inner + outer)
    return time


@borrowing
def widen_by_turns(cone: FloatArray, borders: Borders, times: FloatArray) -> None:
    """Widen times by where the time of arrival turns on an edge or on a sphere."""
    table = borders.table
    azimuths = table[AZIMUTH, : borders.columns + 1]
    elevations = table[ELEVATION, : borders.rows + 1]
    for sign in (-1.0, 1.0):
        x, y, z = sign * cone[0, 0], sign * cone[0, 1], sign * cone[0, 2]
        azimuth, elevation = np.arctan2(y, x), np.arctan2(z, np.sqrt(x * x + y * y))
        column = interval_of(azimuth, azimuths)
        row = interval_of(elevation, elevations)
        if column >= 0:
            for k in range(borders.rows + 1):
                _widen_turn(
                    (azimuth, elevations[k]), (column, k), (False, True), cone, borders, times
                )
            if row >= 0:
                _widen_turn(
                    (azimuth, elevation), (column, row), (False, False), cone, borders, times
                )
        for j in range(borders.columns + 1):
            level = x * table[AZIMUTH_COS, j] + y * table[AZIMUTH_SIN, j]
            if level < 0.0:
                continue
            turn = np.arctan2(z, level)
            row = interval_of(turn, elevations)
            if row >= 0:
                _widen_turn((azimuths[j], turn), (j, row), (True, False), cone, borders, times)


@borrowing
def _widen_turn(
    direction: tuple[float, float],
    place: tuple[int, int],
    borderline: tuple[bool, bool],
    cone: FloatArray,
    borders: Borders,
    times: FloatArray,
) -> None:
    """Widen by the points at an azimuth and elevation on every sphere."""
    azimuth, elevation = direction
    level = np.cos(elevation)
    x, y, z = level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)
    for i in range(borders.layers + 1):
        r = borders.table[RANGE, i]
        time, u, w = _arrival(r * x, r * y, r * z, cone)
        if _inside(time, u, w):
            where = (i, place[0], place[1])
            _widen(time, where, (True, borderline[0], borderline[1]), borders, times)
