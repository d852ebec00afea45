"""Chords that cross large flat shapes: all of a movement's are searched at once.

Where a chord stays over one pair of a box's faces, its distance from the box is that from these
faces: down to the middle between them and up again. Which way the search of `chord_distance` goes
then depends on one number, where on the chord that middle is. So many chords are searched at a
time, in a loop without branches; the results are those of `shape_chord_distance` to the bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.chord_distance import (
    DOUBT,
    TERNARY_STEPS,
    distance_at,
    shape_chord_distance,
    shape_size,
)
from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.rounded_box import distance_beyond, local_point

STEEP = 1e6
"""Chords whose ends are not farther apart across the faces than so many times what rounding may
take are searched one by one: which way a search goes would be decided by rounding."""


class Crossings(NamedTuple):
    """Chords over one pair of faces each, and room for as many as there may be."""

    shape: Ints
    """[chords]"""
    chord: Ints
    """[chords] which chord of the movement."""
    middle: Floats
    """[chords] where along the chord the middle between the faces is, as a share of it."""
    step_m: Floats
    """[chords] how far apart the chord's ends are across the faces."""
    least_m: Floats
    """[chords] how far the nearer end is from the shape, but for rounding."""
    doubt_m: Floats
    """[chords] how much rounding may take, and more."""
    low: Floats
    """[chords] where the search is; shares of the chord."""
    high: Floats
    """[chords]"""
    close: Floats
    """[chords] how near it came to going the other way, as a share of the chord."""
    local_m: Floats2
    """[corners, 3] of the movement, in the axes of one shape."""


@compiled
def crossings_for(shapes: int, corners: int) -> Crossings:
    """Room for every chord of a movement through so many corners."""
    most = shapes * (corners - 1)
    return Crossings(
        np.empty(most, dtype=np.int64),
        np.empty(most, dtype=np.int64),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty((corners, 3)),
    )


@compiled
def own_axes_bound(corners: Floats2, shapes: Shapes, s: int, local: Floats2) -> float:
    """No point of the way through corners [n, 3] is nearer to shape `s`: how far the box around the
    corners, along the shape's own axes, is from the shape. Tight for what is large or flat.

    local: [n, 3] the corners in these axes, filled in.
    """
    center, turn = shapes.center_m[s], shapes.rotation[s]
    for q in range(len(corners)):
        local[q, 0], local[q, 1], local[q, 2] = local_point(
            corners[q, 0], corners[q, 1], corners[q, 2], center, turn
        )
    return _box_bound(local, 0, len(corners), shapes.half_m[s], shapes.radius_m[s])


@compiled
def _box_bound(local: Floats2, first: int, last: int, half: Floats, radius: float) -> float:
    """How far the box around some corners is from a rounded one."""
    lx, ly, lz = local[first, 0], local[first, 1], local[first, 2]
    hx, hy, hz = lx, ly, lz
    for q in range(first + 1, last):
        x, y, z = local[q, 0], local[q, 1], local[q, 2]
        lx, ly, lz = min(lx, x), min(ly, y), min(lz, z)
        hx, hy, hz = max(hx, x), max(hy, y), max(hz, z)
    return float(
        distance_beyond(
            max(lx, max(-hx, 0.0)) - half[0],
            max(ly, max(-hy, 0.0)) - half[1],
            max(lz, max(-hz, 0.0)) - half[2],
        )
        - radius
    )


@compiled
def _is_crossing(q: int, half: Floats, local: Floats2, doubt: float) -> bool:
    """Whether chord `q` crosses the middle between the nearest two faces of a box and stays over
    them, beyond doubt. local: [corners, 3] in the box's axes."""
    axis, one, other = _axes(half)
    if not local[q, axis] * local[q + 1, axis] < 0.0:
        return False
    beside = max(
        max(abs(local[q, one]), abs(local[q + 1, one])) - half[one],
        max(abs(local[q, other]), abs(local[q + 1, other])) - half[other],
    )
    # Balls and capsules have a closed form already.
    flat = min(half[one], half[other]) > 0.0
    steep = abs(local[q + 1, axis] - local[q, axis]) > STEEP * doubt
    return bool(flat and steep and beside < -half[axis] - doubt)


@compiled
def _axes(half: Floats) -> tuple[int, int, int]:
    """The axis across the faces that are nearest to each other, and the other two."""
    axis = 0 if half[0] <= min(half[1], half[2]) else 1 if half[1] <= half[2] else 2
    return axis, (axis + 1) % 3, (axis + 2) % 3


@compiled
def way_size(corners: Floats2) -> float:
    """Of a way through corners [n, 3], for `DOUBT`: no less than that of any of its chords."""
    size = 0.0
    for axis in range(3):
        farthest = 0.0
        for q in range(len(corners)):
            farthest = max(farthest, abs(corners[q, axis]))
        size += 2.0 * farthest
    return size


@compiled
def collect(
    size: float, shapes: Shapes, s: int, enough: float, crossings: Crossings, many: int
) -> tuple[int, bool]:
    """Put chords that cross shape `s` after the first `many` crossings; how many these are then,
    and whether other chords may be nearer to it than `enough`.

    Corners are as `own_axes_bound` has left them for this shape. size: by `way_size`.
    """
    local, half, radius = crossings.local_m, shapes.half_m[s], shapes.radius_m[s]
    others = False
    axis, _, _ = _axes(half)
    doubt = DOUBT * (size + shape_size(shapes, s))
    for q in range(len(local) - 1):
        if _box_bound(local, q, q + 2, half, radius) >= enough + doubt:
            continue
        if not _is_crossing(q, half, local, doubt):
            others = True
            continue
        x, end = local[q, axis], local[q + 1, axis]
        crossings.shape[many], crossings.chord[many] = s, q
        crossings.middle[many], crossings.step_m[many] = x / (x - end), abs(end - x)
        nearer = min(abs(x), abs(end))
        crossings.least_m[many] = nearer - half[axis] - radius
        crossings.doubt_m[many] = doubt
        many += 1
    return many, others


@compiled
def others_distance(
    corners: Floats2, size: float, shapes: Shapes, s: int, enough: float, local: Floats2
) -> float:
    """Distance of shape `s` from the chords that do not cross it so; exact below `enough`.

    size: by `way_size`. local: room for the corners [n, 3] in the shape's axes.
    """
    best = enough
    if own_axes_bound(corners, shapes, s, local) >= best:
        return best
    half, radius = shapes.half_m[s], shapes.radius_m[s]
    doubt = DOUBT * (size + shape_size(shapes, s))
    for q in range(len(corners) - 1):
        is_other = not _is_crossing(q, half, local, doubt)
        if is_other and _box_bound(local, q, q + 2, half, radius) < best + doubt:
            best = min(best, shape_chord_distance(corners[q], corners[q + 1], shapes, s, best))
    return best


@compiled
def search_chords(crossings: Crossings, many: int) -> None:
    """Fill in where the searches of so many chords end, all step by step."""
    middle, low, high = crossings.middle[:many], crossings.low[:many], crossings.high[:many]
    close = crossings.close[:many]
    for m in range(many):
        low[m], high[m], close[m] = 0.0, 1.0, np.inf
    for _ in range(TERNARY_STEPS):
        for m in range(many):
            first = low[m] + (high[m] - low[m]) / 3.0
            second = high[m] - (high[m] - low[m]) / 3.0
            # Nearer to the first of these: the middle lies before the middle between them.
            off = middle[m] - 0.5 * (first + second)
            close[m] = min(close[m], abs(off))
            low[m], high[m] = (low[m], second) if off < 0.0 else (first, high[m])


@compiled
def crossing_distance(
    corners: Floats2, shapes: Shapes, crossings: Crossings, m: int, enough: float
) -> float:
    """As `shape_chord_distance` of one chord that was searched; exact below `enough`."""
    s, q, doubt = crossings.shape[m], crossings.chord[m], crossings.doubt_m[m]
    a, b = corners[q], corners[q + 1]
    if crossings.close[m] * crossings.step_m[m] <= doubt:
        return float(shape_chord_distance(a, b, shapes, s, enough))
    found = distance_at(a, b, 0.5 * (crossings.low[m] + crossings.high[m]), shapes, s)
    if crossings.least_m[m] <= found + doubt:
        ends = min(distance_at(a, b, 0.0, shapes, s), distance_at(a, b, 1.0, shapes, s))
        found = min(found, ends)
    return float(found)
