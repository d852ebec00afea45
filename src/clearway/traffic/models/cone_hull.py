"""First and last time of an elliptic cone in each cell, where rays of its surface miss them.

The time of arrival is linear in space, so its extremes over the part of a cell inside the cone
lie on corners, on edges (where it turns, or where the cone's surface cuts them), on the spheres'
points that face the way of flight, or on the surface itself. Rays find the last kind; this file
finds the others.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled
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
from clearway.traffic.models.cone_corners import INSIDE, Corners, arrival_at, arrive, is_inside


@compiled
def _arrival_on_edge(
    place: tuple[int, int, int], along: int, part: float, cone: Floats2, borders: Borders
) -> tuple[float, float, float]:
    """As `arrival_at`, at a part of the edge that runs along an axis of the grid from a corner."""
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
    return arrival_at(level * azimuth_cos, level * azimuth_sin, r * elevation_sin, cone)


@compiled
def _widen(
    time: float,
    place: tuple[int, int, int],
    borderline: tuple[bool, bool, bool],
    borders: Borders,
    times: Floats2,
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


@compiled
def widen_by_edges(
    cone: Floats2, borders: Borders, corners: Corners, tolerance: float, times: Floats2
) -> None:
    """Widen times [cells, ENTRY and LEAVE] by corners in the cone and edges that it cuts.

    A cut is first taken on the edge's chord, and right within `tolerance` as a share of the cone's
    width. What lies on one side of the cone at both ends is not cut.
    """
    arrive(cone, corners)
    low, high = _find_met_box(borders, times)
    side, rows = corners.side, borders.rows + 1
    in_layer = (borders.columns + 1) * rows
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                at, place = (i * in_layer + j * rows) + k, (i, j, k)
                here = side[at]
                if here == INSIDE:
                    _widen(corners.arrival_s[0, at], place, (True, True, True), borders, times)
                for along in range(3):
                    far = at + (in_layer if along == 0 else rows if along == 1 else 1)
                    if place[along] < high[along] and not here & side[far]:
                        _widen_edge(
                            place, (at, far), along, cone, borders, corners, tolerance, times
                        )


@compiled
def _find_met_box(
    borders: Borders, times: Floats2
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


@compiled
def _widen_edge(
    place: tuple[int, int, int],
    ends: tuple[int, int],
    along: int,
    cone: Floats2,
    borders: Borders,
    corners: Corners,
    tolerance: float,
    times: Floats2,
) -> None:
    """Widen by where the cone's surface cuts one edge: once, or twice if both ends are outside.

    On the chord a b^2 + 2 b part + c = deviation^2 - time^2 is 0 there.
    """
    at, far = ends
    arrival = corners.arrival_s
    time, u, w = arrival[0, at], arrival[1, at], arrival[2, at]
    far_time, far_u, far_w = arrival[0, far], arrival[1, far], arrival[2, far]
    first, second = corners.side[at] == INSIDE, corners.side[far] == INSIDE
    dt, du, dw = far_time - time, far_u - u, far_w - w
    a = du * du + dw * dw - dt * dt
    b = u * du + w * dw - time * dt
    c = u * u + w * w - time * time
    if second:
        a, b, c = a, -(a + b), a + 2.0 * b + c
    if first or second:
        guess = -c / (b + np.sqrt(max(0.0, b * b - a * c)))
        inner, outer = (0.0, 1.0) if first else (1.0, 0.0)
        part = guess if first else 1.0 - guess
    else:
        beyond = b * b - a * c
        if not (a > 0.0 and b < 0.0 and a + b > 0.0 and beyond > 0.0 and time * a > b * dt):
            return
        inner, half = -b / a, np.sqrt(beyond) / a
        if not is_inside(*_arrival_on_edge(place, along, inner, cone, borders)):
            return
        outer, part = 0.0, inner - half
        _widen_by_cut(place, along, inner, 1.0, inner + half, cone, borders, tolerance, times)
    _widen_by_cut(place, along, inner, outer, part, cone, borders, tolerance, times)


@compiled
def _widen_by_cut(
    place: tuple[int, int, int],
    along: int,
    inner: float,
    outer: float,
    guess: float,
    cone: Floats2,
    borders: Borders,
    tolerance: float,
    times: Floats2,
) -> None:
    """Widen by when the cone arrives where an edge leaves it between an inner and an outer part.

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
    _widen(time, place, (along != 0, along != 1, along != 2), borders, times)


@compiled
def widen_by_turns(cone: Floats2, borders: Borders, times: Floats2) -> None:
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


@compiled
def _widen_turn(
    direction: tuple[float, float],
    place: tuple[int, int],
    borderline: tuple[bool, bool],
    cone: Floats2,
    borders: Borders,
    times: Floats2,
) -> None:
    """Widen by the points at an azimuth and elevation on every sphere."""
    azimuth, elevation = direction
    level = np.cos(elevation)
    x, y, z = level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)
    for i in range(borders.layers + 1):
        r = borders.table[RANGE, i]
        time, u, w = arrival_at(r * x, r * y, r * z, cone)
        if is_inside(time, u, w):
            where = (i, place[0], place[1])
            _widen(time, where, (True, borderline[0], borderline[1]), borders, times)
