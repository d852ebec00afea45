"""Boxes inflated by a radius: volume, distances, normals, and where a ray enters one.

Each is convex, so a distance along a ray is a convex function and Newton's method finds a hit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled

RAY_TOLERANCE = 1e-11
"""Of the entry of a ray, as a share of the distance to it and the obstacle's own size."""
MAX_RAY_STEPS = 100
"""Rays that graze a surface converge by halves only; this many bring them within the tolerance."""


@compiled
def offset_volume(hx: float, hy: float, hz: float, radius: float) -> float:
    """Volume of a box of half lengths hx, hy, hz inflated by a radius (Steiner's formula)."""
    faces = 8.0 * (hx * hy + hy * hz + hz * hx)
    edges = 2.0 * np.pi * (hx + hy + hz)
    ball = 4.0 / 3.0 * np.pi
    return 8.0 * hx * hy * hz + radius * (faces + radius * (edges + radius * ball))


@compiled
def local_vector(dx: float, dy: float, dz: float, rotation: Floats2) -> tuple[float, float, float]:
    """A direction in the local axes of an obstacle: the transpose of frame_from_local."""
    return (
        rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz,
        rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz,
        rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz,
    )


@compiled
def local_point(
    x: float, y: float, z: float, center: Floats, rotation: Floats2
) -> tuple[float, float, float]:
    """A point in the local axes of an obstacle."""
    return local_vector(x - center[0], y - center[1], z - center[2], rotation)


@compiled
def distance_beyond(qx: float, qy: float, qz: float) -> float:
    """Signed distance to a box of a point that lies so far beyond its faces along each axis."""
    nearest_face: float = max(qx, max(qy, qz))
    if nearest_face <= 0.0:
        return nearest_face
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    return math.sqrt(ox * ox + oy * oy + oz * oz)


@compiled
def box_distance(x: float, y: float, z: float, hx: float, hy: float, hz: float) -> float:
    """Signed distance of a local point to the box before inflation; negative inside."""
    return distance_beyond(abs(x) - hx, abs(y) - hy, abs(z) - hz)


@compiled
def measure_rounded_box_distance(
    x: float,
    y: float,
    z: float,
    center: Floats,
    rotation: Floats2,
    half: Floats,
    radius: float,
) -> float:
    """Signed distance in metres of a point to an obstacle's surface; negative inside, exact.

    center [3], rotation [3, 3] (frame_from_local), half [3], radius: one entry of `Shapes`.
    """
    lx, ly, lz = local_point(x, y, z, center, rotation)
    return box_distance(lx, ly, lz, half[0], half[1], half[2]) - radius


class Turn(NamedTuple):
    """frame_from_local [3, 3] by entry: as numbers, wherever they come from."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float


@compiled
def turn_of(rotation: Floats2) -> Turn:
    """The entries of a rotation [3, 3]."""
    x, y, z = rotation[0], rotation[1], rotation[2]
    return Turn(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2])


@compiled
def outward_normal(
    lx: float, ly: float, lz: float, hx: float, hy: float, hz: float, turn: Turn
) -> tuple[float, float, float]:
    """Direction, in the obstacle's frame, in which its distance grows at a local point."""
    qx, qy, qz = abs(lx) - hx, abs(ly) - hy, abs(lz) - hz
    if max(min(qx, qy), min(max(qx, qy), qz)) <= 0.0:
        # Beyond one face at most: the normal is its own, without a root.
        nearest_face = max(qx, max(qy, qz))
        if qx == nearest_face:
            side = math.copysign(1.0, lx)
            return side * turn.xx, side * turn.yx, side * turn.zx
        if qy == nearest_face:
            side = math.copysign(1.0, ly)
            return side * turn.xy, side * turn.yy, side * turn.zy
        side = math.copysign(1.0, lz)
        return side * turn.xz, side * turn.yz, side * turn.zz
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    length = math.sqrt(ox * ox + oy * oy + oz * oz)
    ox = math.copysign(ox / length, lx)
    oy = math.copysign(oy / length, ly)
    oz = math.copysign(oz / length, lz)
    return (
        turn.xx * ox + turn.xy * oy + turn.xz * oz,
        turn.yx * ox + turn.yy * oy + turn.yz * oz,
        turn.zx * ox + turn.zy * oy + turn.zz * oz,
    )


@compiled
def ray_rounded_box(
    x: float,
    y: float,
    z: float,
    ux: float,
    uy: float,
    uz: float,
    center: Floats,
    rotation: Floats2,
    half: Floats,
    radius: float,
) -> float:
    """Distance along a ray of unit direction u to its entry into an obstacle.

    0 if the ray starts inside, infinite if it misses. Distance to a convex body is convex along
    the ray, so Newton's steps never pass the entry; where it no longer falls the ray has missed.
    """
    px, py, pz = local_point(x, y, z, center, rotation)
    ex, ey, ez = local_vector(ux, uy, uz, rotation)
    t = _bounding_sphere_entry(px, py, pz, ex, ey, ez, half, radius)
    extent = half[0] + half[1] + half[2] + radius
    for _ in range(MAX_RAY_STEPS):
        if t == np.inf:
            break
        x, y, z = px + t * ex, py + t * ey, pz + t * ez
        distance = box_distance(x, y, z, half[0], half[1], half[2])
        if distance - radius <= 0.0:
            break
        # The distance grows along the offset from the box, so this is its rate along the ray.
        ox = math.copysign(max(abs(x) - half[0], 0.0), x)
        oy = math.copysign(max(abs(y) - half[1], 0.0), y)
        oz = math.copysign(max(abs(z) - half[2], 0.0), z)
        rate = (ox * ex + oy * ey + oz * ez) / distance
        if rate >= 0.0:
            return math.inf
        step = (radius - distance) / rate
        t += step
        if step <= RAY_TOLERANCE * (t + extent):
            break
    return t


@compiled
def _bounding_sphere_entry(
    px: float,
    py: float,
    pz: float,
    ex: float,
    ey: float,
    ez: float,
    half: Floats,
    radius: float,
) -> float:
    """Where a local ray enters the sphere around the obstacle; 0 inside, infinite if it misses."""
    bound = radius + math.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    outside = px * px + py * py + pz * pz - bound * bound
    if outside <= 0.0:
        return 0.0
    ahead = -(px * ex + py * ey + pz * ez)
    chord = ahead * ahead - outside
    if chord < 0.0 or ahead < 0.0:
        return math.inf
    return ahead - math.sqrt(chord)
