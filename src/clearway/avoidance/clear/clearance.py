"""Distances from movements, and from circles, to hazards: the inner loops of verification.

Each result is (distance, cause, index). It is exact where it is below `enough`; beyond, only that
it is not below counts, which lets most hazards be passed over. Below `stop`, only that it is below
counts: who asks whether a distance is kept stops at the first thing that is nearer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.chord_distance import (
    chord_distance,
    chord_distance2,
    shape_chord_distance,
)
from clearway.avoidance.clear.hazards import MovingHazards, PointBins, bin_range
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.rounding import SURELY
from clearway.obstacles.obstacle import Shapes, shape_distance

CIRCLE_SAMPLES = 96
"""Points on a circle that shapes are checked against; half their spacing is taken off."""
NEARLY_M = 1e-6
"""More than what rounding does to a distance."""
ROUNDING = 1e-12
"""More than sums of a few lengths lose, as a share of them."""

Found = tuple[float, int, int]


class Span(NamedTuple):
    """A movement as chords between samples, with the ball around it."""

    corners_m: Floats2
    """[n + 1, 3]"""
    middle_m: Floats
    """[3]"""
    reach_m: float
    """Radius of the ball around the middle."""
    start_s: float
    end_s: float


@compiled
def make_span(corners: Floats2, start_s: float, end_s: float) -> Span:
    """The movement through given corners."""
    middle = np.empty(3)
    return Span(corners, middle, reach_about(corners, middle), start_s, end_s)


@compiled
def reach_about(corners: Floats2, middle: Floats) -> float:
    """Radius of the ball around corners; fills in its middle [3]."""
    last, reach2 = len(corners) - 1, 0.0
    for axis in range(3):
        middle[axis] = 0.5 * (corners[0, axis] + corners[last, axis])
    for q in range(len(corners)):
        dx, dy, dz = corners[q, 0] - middle[0], corners[q, 1] - middle[1], corners[q, 2] - middle[2]
        reach2 = max(reach2, dx * dx + dy * dy + dz * dz)
    return float(np.sqrt(reach2))


@compiled
def points_clearance(span: Span, bins: PointBins, enough: float, stop: float) -> Found:
    """Clearance of a movement from points."""
    best, index, corners = enough, -1, span.corners_m
    cx, cy, cz = span.middle_m[0], span.middle_m[1], span.middle_m[2]
    # Where there are many, those about one corner tell how few of the others matter.
    halfway = len(corners) // 2
    no_more = _most_clear(
        corners[halfway, 0], corners[halfway, 1], corners[halfway, 2], bins, enough
    )
    window = no_more + span.reach_m + bins.largest_m
    a0, a1 = bin_range(bins, 0, cx, window)
    b0, b1 = bin_range(bins, 1, cy, window)
    c0, c1 = bin_range(bins, 2, cz, window)
    for a in range(a0, a1):
        for b in range(b0, b1):
            row = (a * bins.counts[1] + b) * bins.counts[2]
            for at in range(bins.start[row + c0], bins.start[row + max(c0, c1)]):
                m = np.uint64(at)
                px, py, pz = bins.position_m[m, 0], bins.position_m[m, 1], bins.position_m[m, 2]
                dx, dy, dz = px - cx, py - cy, pz - cz
                far = min(best, no_more) + span.reach_m + bins.radius_m[m]
                if dx * dx + dy * dy + dz * dz >= far * far:
                    continue
                for q in range(len(corners) - 1):
                    gap = chord_distance(
                        px,
                        py,
                        pz,
                        corners[q, 0],
                        corners[q, 1],
                        corners[q, 2],
                        corners[q + 1, 0],
                        corners[q + 1, 1],
                        corners[q + 1, 2],
                    )
                    if gap - bins.radius_m[m] < best:
                        best, index = gap - bins.radius_m[m], bins.source[m]
                        if best < stop:
                            return best, 1, index
    return best, 1 if index >= 0 else 0, index


@compiled
def _most_clear(x: float, y: float, z: float, bins: PointBins, enough: float) -> float:
    """What the clearance of a place is at most, by points of its bin; `enough` where that is less.

    A little more than they tell, so that what is as near as that is looked at.
    """
    a = (x - bins.origin_m[0]) / bins.width_m
    b = (y - bins.origin_m[1]) / bins.width_m
    c = (z - bins.origin_m[2]) / bins.width_m
    counts = bins.counts
    if not (0.0 <= a < counts[0] and 0.0 <= b < counts[1] and 0.0 <= c < counts[2]):
        return enough
    most, row = enough, (int(a) * counts[1] + int(b)) * counts[2] + int(c)
    for at in range(bins.start[row], bins.start[row + 1]):
        m = np.uint64(at)
        dx, dy, dz = (
            bins.position_m[m, 0] - x,
            bins.position_m[m, 1] - y,
            bins.position_m[m, 2] - z,
        )
        gap = np.sqrt(dx * dx + dy * dy + dz * dz)
        most = min(most, gap - bins.radius_m[m] + NEARLY_M)
    return most


@compiled
def _is_beyond(place: Floats, reach: float, shapes: Shapes, s: int, best: float) -> bool:
    """Whether the ball around shape `s` alone shows that it is no nearer than `best` to anything
    within reach of a place: quick, and never so where the shape itself is nearer."""
    far = SURELY * (best + reach + shapes.bound_m[s])
    dx = place[0] - shapes.center_m[s, 0]
    dy = place[1] - shapes.center_m[s, 1]
    dz = place[2] - shapes.center_m[s, 2]
    return bool(far > 0.0 and dx * dx + dy * dy + dz * dz >= far * far)


@compiled
def shapes_clearance(span: Span, shapes: Shapes, enough: float, stop: float) -> Found:
    """Clearance of a movement from map shapes."""
    best, index = enough, -1
    corners, middle = span.corners_m, span.middle_m
    for s in range(len(shapes.radius_m)):
        if _is_beyond(middle, span.reach_m, shapes, s, best):
            continue
        if shape_distance(middle[0], middle[1], middle[2], shapes, s) - span.reach_m >= best:
            continue
        for q in range(len(corners) - 1):
            distance = shape_chord_distance(corners[q], corners[q + 1], shapes, s, best)
            if distance < best:
                best, index = distance, s
                if best < stop:
                    return best, 2, index
    return best, 2 if index >= 0 else 0, index


@compiled
def moving_clearance(span: Span, moving: MovingHazards, enough: float) -> Found:
    """Clearance of a movement from moving at equal times: from relative chords to the origin."""
    best, index = enough, -1
    corners = span.corners_m
    step = (span.end_s - span.start_s) / (len(corners) - 1)
    for k in range(len(moving.radius_m)):
        if _is_far(span, moving, k, best):
            continue
        px, py, pz = moving.position_m[k, 0], moving.position_m[k, 1], moving.position_m[k, 2]
        vx, vy, vz = moving.velocity_mps[k, 0], moving.velocity_mps[k, 1], moving.velocity_mps[k, 2]
        turns = moving.manoeuvre_mps2[k] > 0.0 and moving.share[k] > 0.0
        for q in range(len(corners) - 1):
            before, after = span.start_s + q * step, span.start_s + (q + 1) * step
            gap2 = chord_distance2(
                0.0,
                0.0,
                0.0,
                corners[q, 0] - px - vx * before,
                corners[q, 1] - py - vy * before,
                corners[q, 2] - pz - vz * before,
                corners[q + 1, 0] - px - vx * after,
                corners[q + 1, 1] - py - vy * after,
                corners[q + 1, 2] - pz - vz * after,
            )
            if not turns and _is_no_nearer(
                gap2, moving.radius_m[k] + moving.growth_mps[k] * after, best
            ):
                continue
            gap = np.sqrt(gap2)
            if turns:
                here = chord_distance(
                    px,
                    py,
                    pz,
                    corners[q, 0],
                    corners[q, 1],
                    corners[q, 2],
                    corners[q + 1, 0],
                    corners[q + 1, 1],
                    corners[q + 1, 2],
                )
                speed = np.sqrt(vx * vx + vy * vy + vz * vz)
                turned = gap - 0.5 * moving.manoeuvre_mps2[k] * after * after
                gap += moving.share[k] * (max(turned, here - speed * after) - gap)
            distance = gap - moving.radius_m[k] - moving.growth_mps[k] * after
            if distance < best:
                best, index = distance, k
    return best, 3 if index >= 0 else 0, index


@compiled
def _is_no_nearer(gap2: float, radius: float, best: float) -> bool:
    """Whether a ball is no nearer than `best`, by the square of how far off its middle is: told
    without a root, and never where rounding could tell otherwise."""
    near = best + radius + ROUNDING * (abs(best) + radius)
    return near <= 0.0 or gap2 >= SURELY * near * near


@compiled
def _is_far(span: Span, moving: MovingHazards, k: int, best: float) -> bool:
    """Whether it cannot come nearer than `best`: both stay in balls about their middles."""
    half_s = 0.5 * (span.end_s - span.start_s)
    middle_s = span.start_s + half_s
    vx, vy, vz = moving.velocity_mps[k, 0], moving.velocity_mps[k, 1], moving.velocity_mps[k, 2]
    dx = span.middle_m[0] - moving.position_m[k, 0] - vx * middle_s
    dy = span.middle_m[1] - moving.position_m[k, 1] - vy * middle_s
    dz = span.middle_m[2] - moving.position_m[k, 2] - vz * middle_s
    moved = half_s * np.sqrt(vx * vx + vy * vy + vz * vz)
    grown = moving.radius_m[k] + moving.growth_mps[k] * span.end_s
    grown += 0.5 * moving.manoeuvre_mps2[k] * span.end_s * span.end_s
    near = max(0.0, span.reach_m + moved + grown + best)
    return bool(dx * dx + dy * dy + dz * dz >= near * near)


@compiled
def circle_clearance(
    center: Floats,
    up: Floats,
    radius: float,
    bins: PointBins,
    shapes: Shapes,
    enough: float,
) -> Found:
    """Clearance of a level circle around a centre [3]; `up` [3] is the vertical."""
    found = _circle_from_points(center, up, radius, bins, enough)
    by_shape = _circle_from_shapes(
        center, up, radius, shapes, found[0], np.empty((CIRCLE_SAMPLES, 3))
    )
    return by_shape if by_shape[2] >= 0 else found


@compiled
def _circle_from_points(
    center: Floats, up: Floats, radius: float, bins: PointBins, enough: float
) -> Found:
    best, index = enough, -1
    window = radius + enough + bins.largest_m
    a0, a1 = bin_range(bins, 0, center[0], window)
    b0, b1 = bin_range(bins, 1, center[1], window)
    c0, c1 = bin_range(bins, 2, center[2], window)
    for a in range(a0, a1):
        for b in range(b0, b1):
            row = (a * bins.counts[1] + b) * bins.counts[2]
            for m in range(bins.start[row + c0], bins.start[row + max(c0, c1)]):
                wx = bins.position_m[m, 0] - center[0]
                wy = bins.position_m[m, 1] - center[1]
                wz = bins.position_m[m, 2] - center[2]
                height = wx * up[0] + wy * up[1] + wz * up[2]
                level2 = max(0.0, wx * wx + wy * wy + wz * wz - height * height)
                # Most are above or below the circle, within it or without, by more than matters.
                within = SURELY * (best + bins.radius_m[m])
                if within < 0.0 or height * height > within * within:
                    continue
                inner, outer = max(0.0, radius - within), radius + within
                if level2 < inner * inner or level2 > outer * outer:
                    continue
                level = np.sqrt(level2)
                distance = np.hypot(level - radius, height) - bins.radius_m[m]
                if distance < best:
                    best, index = distance, bins.source[m]
    return best, 1 if index >= 0 else 0, index


@compiled
def _circle_from_shapes(
    center: Floats,
    up: Floats,
    radius: float,
    shapes: Shapes,
    enough: float,
    places: Floats2,
) -> Found:
    """places: [CIRCLE_SAMPLES, 3] room for those on the circle, filled in once it takes them."""
    best, index = enough, -1
    spare, filled = radius * np.pi / CIRCLE_SAMPLES, False
    for s in range(len(shapes.radius_m)):
        if _is_beyond(center, radius, shapes, s, best):
            continue
        near = best + spare + ROUNDING * (abs(best) + radius)
        if _off_circle(center, up, radius, shapes, s) >= near:
            continue
        if shape_distance(center[0], center[1], center[2], shapes, s) - radius >= best:
            continue
        if not filled:
            _note_circle(center, up, radius, places)
            filled = True
        corner = 0
        while corner < CIRCLE_SAMPLES:
            place = places[corner]
            distance = shape_distance(place[0], place[1], place[2], shapes, s) - spare
            if distance < best:
                best, index = distance, s
            # Farther off than the circle is long up to there: no nearer in between.
            corner += max(1, int((distance - best) / (2.0 * SURELY * spare)))
    return best, 2 if index >= 0 else 0, index


@compiled
def _off_circle(center: Floats, up: Floats, radius: float, shapes: Shapes, s: int) -> float:
    """How far the ball around shape `s` is from a level circle: no farther than the shape is."""
    wx = shapes.center_m[s, 0] - center[0]
    wy = shapes.center_m[s, 1] - center[1]
    wz = shapes.center_m[s, 2] - center[2]
    height = wx * up[0] + wy * up[1] + wz * up[2]
    level = np.sqrt(max(0.0, wx * wx + wy * wy + wz * wz - height * height))
    return float(np.hypot(level - radius, height) - SURELY * shapes.bound_m[s])


@compiled
def _note_circle(center: Floats, up: Floats, radius: float, places: Floats2) -> None:
    """Fill in places [n, 3] on a level circle."""
    # With `up`, these complete a level frame: the grid is pitched, never rolled.
    forward_x, forward_z = up[2], -up[0]
    for corner in range(len(places)):
        angle = 2.0 * np.pi * corner / len(places)
        ahead = radius * np.cos(angle)
        places[corner, 0] = center[0] + ahead * forward_x
        places[corner, 1] = center[1] + radius * np.sin(angle)
        places[corner, 2] = center[2] + ahead * forward_z
