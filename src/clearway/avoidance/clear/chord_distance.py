"""Distances from chords, straight pieces of a movement, to points and to map shapes."""

from __future__ import annotations

import math

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.base.rounding import SURELY
from clearway.obstacles.obstacle import Shapes, shape_distance
from clearway.obstacles.rounded_box import local_point, local_vector

TERNARY_STEPS = 24
"""Cuts of a chord by a third each: enough for 1e-4 of its length."""
DOUBT = 1e-12
"""More than rounding takes from a distance, as a share of all the lengths that it comes from."""


@compiled
def chord_distance(
    px: float,
    py: float,
    pz: float,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
) -> float:
    """Distance from point p to the segment a-b."""
    return float(np.sqrt(chord_distance2(px, py, pz, ax, ay, az, bx, by, bz)))


@compiled
def chord_distance2(
    px: float,
    py: float,
    pz: float,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
) -> float:
    """The same squared."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    wx, wy, wz = px - ax, py - ay, pz - az
    length2 = ux * ux + uy * uy + uz * uz
    share = 0.0
    if length2 > 0.0:
        share = min(1.0, max(0.0, (wx * ux + wy * uy + wz * uz) / length2))
    dx, dy, dz = wx - share * ux, wy - share * uy, wz - share * uz
    return dx * dx + dy * dy + dz * dz


@compiled
def distance_at(a: Floats, b: Floats, share: float, shapes: Shapes, s: int) -> float:
    """Distance of shape `s` from the point at a share of the segment a-b."""
    return shape_distance(
        a[0] + share * (b[0] - a[0]),
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
        shapes,
        s,
    )


@compiled
def shape_chord_distance(a: Floats, b: Floats, shapes: Shapes, s: int, enough: float) -> float:
    """Distance from the segment a-b to shape `s`; exact where it is below `enough`.

    Balls and capsules have a closed form. A rounded box is convex, so its distance along a straight
    line is too: a ternary search finds the smallest, and ends where what is left of the segment is
    too short to come below `enough`. It goes along the segment in the shape's own axes, and looks
    more closely where rounding could lead it another way.
    """
    half = shapes.half_m[s]
    if (half[0] > 0.0) + (half[1] > 0.0) + (half[2] > 0.0) <= 1:
        return _capsule_chord_distance(a, b, shapes, s)
    at_a, at_b = distance_at(a, b, 0.0, shapes, s), distance_at(a, b, 1.0, shapes, s)
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if 0.5 * (at_a + at_b - length) >= enough:
        return min(at_a, at_b)
    center, turn, radius = shapes.center_m[s], shapes.rotation[s], shapes.radius_m[s]
    x, y, z = local_point(a[0], a[1], a[2], center, turn)
    ux, uy, uz = local_vector(dx, dy, dz, turn)
    ends_size = abs(a[0]) + abs(a[1]) + abs(a[2]) + abs(b[0]) + abs(b[1]) + abs(b[2])
    doubt = DOUBT * (ends_size + shape_size(shapes, s))
    low, high, ends = 0.0, 1.0, min(at_a, at_b)
    for _ in range(TERNARY_STEPS):
        first, second = low + (high - low) / 3.0, high - (high - low) / 3.0
        at_first = _beside(x + first * ux, y + first * uy, z + first * uz, half) - radius
        at_second = _beside(x + second * ux, y + second * uy, z + second * uz, half) - radius
        farthest = SURELY * (high - second) * length
        beyond = min(at_first, at_second) - farthest - enough
        if abs(at_first - at_second) <= doubt or abs(beyond) <= doubt:
            at_first = distance_at(a, b, first, shapes, s)
            at_second = distance_at(a, b, second, shapes, s)
            beyond = min(at_first, at_second) - farthest - enough
        if beyond >= 0.0 and ends >= enough:
            return ends
        if at_first < at_second:
            high = second
        else:
            low = first
    return min(ends, distance_at(a, b, 0.5 * (low + high), shapes, s))


@compiled
def _beside(x: float, y: float, z: float, half: Floats) -> float:
    """Distance of a local point from a box before it is inflated: beside one face without a root,
    and so but for rounding that of `box_distance`."""
    qx, qy, qz = abs(x) - half[0], abs(y) - half[1], abs(z) - half[2]
    nearest_face: float = max(qx, max(qy, qz))
    if max(min(qx, qy), min(max(qx, qy), qz)) <= 0.0:
        return nearest_face
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    return math.sqrt(ox * ox + oy * oy + oz * oz)


@compiled
def shape_size(shapes: Shapes, s: int) -> float:
    """The lengths of a shape that its distances come from, for `DOUBT`."""
    center, half = shapes.center_m[s], shapes.half_m[s]
    size = abs(center[0]) + abs(center[1]) + abs(center[2]) + half[0] + half[1] + half[2]
    return float(size + shapes.radius_m[s])


@compiled
def _capsule_chord_distance(a: Floats, b: Floats, shapes: Shapes, s: int) -> float:
    """Distance from the segment a-b to a ball or a capsule, in closed form."""
    center, turn, half = shapes.center_m[s], shapes.rotation[s], shapes.half_m[s]
    ax, ay, az = local_point(a[0], a[1], a[2], center, turn)
    bx, by, bz = local_point(b[0], b[1], b[2], center, turn)
    if half[1] > 0.0:  # The axis of the capsule as the first one.
        ax, ay, bx, by = ay, ax, by, bx
    elif half[2] > 0.0:
        ax, az, bx, bz = az, ax, bz, bx
    length = half[0] + half[1] + half[2]
    ux, uy, uz = bx - ax, by - ay, bz - az
    # Nearest to the axis without its ends; where that is beyond an end, nearest to the end.
    beside2, share = uy * uy + uz * uz, 0.0
    if beside2 > 0.0:
        share = min(1.0, max(0.0, -(ay * uy + az * uz) / beside2))
    along = ax + share * ux
    if abs(along) > length:
        end = math.copysign(length, along)
        beside = chord_distance(end, 0.0, 0.0, ax, ay, az, bx, by, bz)
    else:
        y, z = ay + share * uy, az + share * uz
        beside = np.sqrt(y * y + z * z)
    return float(beside - shapes.radius_m[s])
