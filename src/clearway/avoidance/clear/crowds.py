"""Clearance of movements among very many map shapes: most are passed over, several at a time.

Shapes are laid out by coordinate, so that a loop without branches finds how far all of them are
from the middle of a movement. The nearest is looked at first, and with what it leaves most others
cannot matter. The result is that of `shapes_clearance` to the bit, unless more than `FEW` could
still be nearer by the ball around the movement. Then one that could be nearer by `ALIKE_M` at most
is not looked at, but counted as though it were: a clearance is never told too large, and whether it
is enough stays exact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.chord_distance import shape_chord_distance
from clearway.avoidance.clear.clearance import (
    Found,
    Span,
    moving_clearance,
    points_clearance,
    shapes_clearance,
)
from clearway.avoidance.clear.faces_crossed import (
    Crossings,
    collect,
    crossing_distance,
    crossings_for,
    others_distance,
    own_axes_bound,
    search_chords,
    way_size,
)
from clearway.avoidance.clear.hazards import MovingHazards, PointBins
from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.some_shapes import distances_off, lay_out_shapes

FEW = 40
"""Shapes up to which each that could be nearest is looked at."""
ALIKE_M = 1e-3
"""Metres by which a clearance among more of them may be reported too small."""
ROUNDING_M = 1e-9
"""More metres than rounding takes from a distance."""

DEEP = 16
"""The row of depths."""


class Crowd(NamedTuple):
    """Many shapes by coordinate, and room for a movement at a time; nothing where they are few."""

    rows: Floats2
    """[17, shapes] centre 3, rotation 9, half lengths 3, radius, greatest depth inside."""
    off_m: Floats
    """[shapes] from the middle of the movement."""
    near: Ints
    """[shapes] those that could be nearest."""
    bound_m: Floats
    """[shapes] of each of these, no distance from the movement is less."""
    crossings: Crossings


@compiled
def crowd_of(shapes: Shapes, corners: int) -> Crowd:
    """The shapes laid out, if there are many, for movements through so many corners."""
    many = len(shapes.radius_m)
    many = many if many > FEW else 0
    rows = np.empty((DEEP + 1, many))
    lay_out_shapes(shapes, np.arange(many), rows)
    for s in range(many):
        rows[DEEP, s] = rows[15, s] + min(rows[12, s], min(rows[13, s], rows[14, s]))
    crossings = crossings_for(many, corners)
    return Crowd(rows, np.empty(many), np.empty(many, dtype=np.int64), np.empty(many), crossings)


@compiled
def span_clearance(
    span: Span,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    crowd: Crowd,
    enough: float,
    stop: float,
) -> Found:
    """Clearance of a movement from everything. crowd: the shapes again, by `crowd_of`."""
    found = points_clearance(span, bins, enough, stop)
    if found[0] < stop:
        return found
    by_shape = clearance_among(span, shapes, crowd, found[0], stop)
    if by_shape[2] >= 0:
        found = by_shape
    if found[0] < stop:
        return found
    by_moving = moving_clearance(span, moving, found[0])
    if by_moving[2] >= 0:
        found = by_moving
    return found


@compiled
def clearance_among(span: Span, shapes: Shapes, crowd: Crowd, enough: float, stop: float) -> Found:
    """Clearance of a movement from map shapes, however many, as `shapes_clearance`."""
    if crowd.rows.shape[1] == 0:
        return shapes_clearance(span, shapes, enough, stop)
    corners, middle, off = span.corners_m, span.middle_m, crowd.off_m
    distances_off(middle[0], middle[1], middle[2], crowd.rows, off)
    nearest = _nearest(off)
    if off[nearest] - span.reach_m >= enough:
        return enough, 0, -1
    best, index = _shape_clearance(corners, shapes, nearest, enough)
    if best < stop:
        return best, 2, index
    # Among very many, what may be nearer by so much at most does not matter.
    alike, least, many = ALIKE_M if _count_near(span, off, best) > FEW else -ROUNDING_M, best, 0
    crossings, crossing, size = crowd.crossings, 0, way_size(corners)
    for m in range(_note_nearer(span, off, best + ROUNDING_M, crowd.near)):
        s = crowd.near[m]
        if s == nearest:
            continue
        deepest = -crowd.rows[DEEP, s]
        if best < enough - alike and deepest >= best - alike:
            least = min(least, deepest)
            continue
        bound = own_axes_bound(corners, shapes, s, crossings.local_m)
        if bound < best + ROUNDING_M:
            crossing, others = collect(size, shapes, s, best + ROUNDING_M, crossings, crossing)
            # Over one that has been looked at.
            crowd.near[many], crowd.bound_m[many] = s, bound
            many += others
    best, index = _among_crossings(corners, shapes, crossings, crossing, best, index)
    if best < stop:
        return best, 2, index
    for m in range(many):
        bound = crowd.bound_m[m]
        if bound >= best + ROUNDING_M:
            continue
        if best < enough - alike and bound >= best - alike:
            least = min(least, bound)
            continue
        s = crowd.near[m]
        # A little more than the best, so that of equals the first is reported.
        distance = others_distance(corners, size, shapes, s, best + ROUNDING_M, crossings.local_m)
        if distance < best or (distance == best and s < index):
            best, index = distance, s
            if best < stop:
                return best, 2, index
    return min(best, least), 2 if index >= 0 else 0, index


@compiled
def _among_crossings(
    corners: Floats2, shapes: Shapes, crossings: Crossings, many: int, best: float, index: int
) -> tuple[float, int]:
    """The nearest by the chords that cross a shape, if below the best."""
    search_chords(crossings, many)
    for m in range(many):
        distance = crossing_distance(corners, shapes, crossings, m, best + ROUNDING_M)
        s = crossings.shape[m]
        if distance < best or (distance == best and s < index):
            best, index = distance, s
    return best, index


@compiled
def _count_near(span: Span, off: Floats, best: float) -> int:
    """How many shapes could be nearer than that to a movement, by the ball around it."""
    many = 0
    for s in range(len(off)):
        many += off[s] - span.reach_m < best
    return many


@compiled
def _note_nearer(span: Span, off: Floats, best: float, near: Ints) -> int:
    """Fill in which shapes could be nearer than that to a movement, by the ball around it; how
    many. Which they are cannot be foretold, so no branch asks: the others are written over."""
    many = 0
    for s in range(len(off)):
        near[many] = s
        many += not off[s] - span.reach_m >= best
    return many


@compiled
def _shape_clearance(corners: Floats2, shapes: Shapes, s: int, enough: float) -> tuple[float, int]:
    """Of one shape: its distance from chords and its number; -1 where that is not below enough."""
    best, index = enough, -1
    for q in range(len(corners) - 1):
        distance = shape_chord_distance(corners[q], corners[q + 1], shapes, s, best)
        if distance < best:
            best, index = distance, s
    return best, index


@compiled
def _nearest(off: Floats) -> int:
    """The first of those that are least far off."""
    nearest = 0
    for s in range(len(off)):
        if off[s] < off[nearest]:
            nearest = s
    return nearest
