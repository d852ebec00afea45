"""Volumes of obstacles inside cells to 1e-5 of the cell: the reference mode of (5.52), (5.53).

A cell is halved until each part is inside, outside, or cut by one nearly plane surface. Signed
distances prune exactly, so nothing is missed however thin; only edges, and lines where two
surfaces cross, are followed to the smallest parts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Ints
from clearway.base.compiled import compiled
from clearway.base.grid import GridEdges
from clearway.obstacles.cell_share import blur_share, half_space_share
from clearway.obstacles.obstacle import Shapes, shape_distance
from clearway.obstacles.rounded_box import box_distance, local_point, outward_normal, turn_of

SMOOTH_PARTS = 64.0
"""A part cut by one smooth surface is at most this share of the cell's width."""
EDGE_PARTS = 512.0
"""A part that holds an edge or a crossing is halved down to this share of the cell's width."""
THIN_PARTS = 2048.0
"""A wire is followed until parts are small for its radius, or this share of the cell."""
CURVE_PARTS = 12.0
"""A surface curved like the cell's third is cut by parts of this share of its radius or less."""
SAME_SURFACE = 1e-9
"""Surfaces no farther apart, in radii of a part, are one; normals so nearly opposite are."""
STACK = 256


class Part(NamedTuple):
    """A part of a cell: bounds in distance, azimuth and elevation, centre, widths, radius."""

    x: float
    y: float
    z: float
    out: float
    """Width along the distance, metres."""
    across: float
    up: float
    radius: float
    """No point of the part is farther than this from (x, y, z)."""
    volume: float


class Cut(NamedTuple):
    """How one obstacle's surface passes a part: a plane at the centre's distance."""

    distance: float
    """From the part's centroid to the surface, its mean curvature included; negative inside."""
    nx: float
    ny: float
    nz: float
    flat: bool
    """No edge or rounding is near."""
    slab: float
    """Distance between this face and the opposite one; infinite where that is far."""


@compiled
def part_of(d0: float, d1: float, a0: float, a1: float, e0: float, e1: float) -> Part:
    """The part between two distances, azimuths and elevations."""
    d, a, e = 0.5 * (d0 + d1), 0.5 * (a0 + a1), 0.5 * (e0 + e1)
    widest = 1.0 if e0 <= 0.0 <= e1 else max(math.cos(e0), math.cos(e1))
    up_chord = 2.0 * math.sin(0.25 * (e1 - e0))
    across_chord = 2.0 * math.sin(min(0.25 * (a1 - a0), 0.5 * math.pi))
    chord = up_chord**2 + widest * math.cos(e) * across_chord**2
    return Part(
        d * math.cos(e) * math.cos(a),
        d * math.cos(e) * math.sin(a),
        d * math.sin(e),
        d1 - d0,
        d1 * widest * (a1 - a0),
        d1 * (e1 - e0),
        math.sqrt((0.5 * (d1 - d0)) ** 2 + d1 * d * chord),
        (d1**3 - d0**3) / 3.0 * (math.sin(e1) - math.sin(e0)) * (a1 - a0),
    )


@compiled
def cut_of(part: Part, shapes: Shapes, n: int) -> Cut:
    """The surface of shape n as seen from a part: its nearest plane, moved by its curvature."""
    center, rotation, half = shapes.center_m[n], shapes.rotation[n], shapes.half_m[n]
    radius = shapes.radius_m[n]
    lx, ly, lz = local_point(part.x, part.y, part.z, center, rotation)
    qx, qy, qz = abs(lx) - half[0], abs(ly) - half[1], abs(lz) - half[2]
    nearest, farthest = max(qx, max(qy, qz)), min(qx, min(qy, qz))
    second = qx + qy + qz - nearest - farthest
    distance = box_distance(lx, ly, lz, half[0], half[1], half[2])
    flat = second < -part.radius
    slab = np.inf
    if flat:
        face = 0 if qx == nearest else (1 if qy == nearest else 2)
        slab = 2.0 * (half[face] + radius)
    distance -= radius
    if second > 0.0 and radius > 0.0:
        # A curved surface bends away from its plane: cylinder once, ball twice.
        bends = 2.0 if farthest > 0.0 else 1.0
        squares = part.out * part.out + part.across * part.across + part.up * part.up
        distance += bends * squares / (72.0 * radius)
    nx, ny, nz = outward_normal(lx, ly, lz, half[0], half[1], half[2], turn_of(rotation))
    return Cut(distance, nx, ny, nz, flat, slab)


@compiled
def plane_share(part: Part, cut: Cut) -> float:
    """Share of a part on the inner side of a plane, or between it and the opposite face."""
    d = math.sqrt(part.x * part.x + part.y * part.y + part.z * part.z)
    level = math.sqrt(part.x * part.x + part.y * part.y)
    ux, uy, uz = part.x / d, part.y / d, part.z / d
    ax, ay = (-part.y / level, part.x / level) if level > 0.0 else (0.0, 1.0)
    vx, vy, vz = -uz * ay, uz * ax, ux * ay - uy * ax
    along = cut.nx * ux + cut.ny * uy + cut.nz * uz
    above = cut.nx * vx + cut.ny * vy + cut.nz * vz
    aside = cut.nx * ax + cut.ny * ay
    # The part is not a box: its centroid lies farther out than its middle and sags inwards.
    sag = (part.across * part.across + part.up * part.up) / (24.0 * d)
    rise = uz / max(level / d, 1e-9) * (part.across * part.across - 2.0 * part.up * part.up)
    shift = along * (part.out * part.out / (6.0 * d) - sag) + above * rise / (24.0 * d)
    b1, b2, b3 = abs(along) * part.out, abs(aside) * part.across, abs(above) * part.up
    distance = cut.distance + shift
    share = half_space_share(b1, b2, b3, distance)
    if cut.slab < np.inf:
        share += half_space_share(b1, b2, b3, -distance - cut.slab) - 1.0
    return max(share, 0.0)


@compiled
def _is_hidden_behind(a: Cut, b: Cut, radius: float) -> bool:
    """Whether, within a ball, what lies inside surface b lies inside surface a too."""
    dx, dy, dz = a.nx - b.nx, a.ny - b.ny, a.nz - b.nz
    apart = math.sqrt(dx * dx + dy * dy + dz * dz)
    deeper = b.distance - a.distance
    if apart >= 1.0 or deeper < radius * (apart - SAME_SURFACE):
        return False
    return a.slab >= 2.0 * radius or a.slab - b.slab >= deeper + radius * (apart - SAME_SURFACE)


@compiled
def _curve_width(radius: float, scale: float) -> float:
    """How wide a part may be for its cut of a curved surface to count as smooth.

    What lies in a thin wire is a small share of the cell, so that its relative error counts less.
    """
    parts: float = CURVE_PARTS * (3.0 * radius / scale) ** (2.0 / 3.0)
    return radius / min(max(parts, 3.0), CURVE_PARTS)


@compiled
def _smooth_share(part: Part, wide: float, scale: float, shapes: Shapes, near: Ints) -> float:
    """Share of a part under the union of the near shapes; -1 where it must be halved to tell."""
    first = cut_of(part, shapes, near[0])
    if not (first.flat or wide <= _curve_width(shapes.radius_m[near[0]], scale)):
        return -1.0
    opposite = 0.0
    for m in range(1, len(near)):
        cut = cut_of(part, shapes, near[m])
        if not (cut.flat or wide <= _curve_width(shapes.radius_m[near[m]], scale)):
            return -1.0
        if _is_hidden_behind(first, cut, part.radius):
            continue
        if _is_hidden_behind(cut, first, part.radius):
            first = cut
            continue
        dot = first.nx * cut.nx + first.ny * cut.ny + first.nz * cut.nz
        if dot > SAME_SURFACE - 1.0:
            return -1.0
        opposite = max(opposite, plane_share(part, cut))
    return min(plane_share(part, first) + opposite, 1.0)


@compiled
def _smallest_part(scale: float, shapes: Shapes, near: Ints) -> float:
    """Width at which parts that still hold an edge or a crossing are no longer halved."""
    smallest = scale / EDGE_PARTS
    radius = shapes.radius_m[near[0]]
    if len(near) == 1 and radius > 0.0:
        smallest = min(smallest, max(_curve_width(radius, scale), scale / THIN_PARTS))
    return smallest


@compiled
def _blur_union(part: Part, shapes: Shapes, near: Ints) -> float:
    """Share of a part too small to halve: its shapes as if they met it independently."""
    free = 1.0
    width = part.volume ** (1.0 / 3.0)
    for n in near:
        x, y, z = local_point(part.x, part.y, part.z, shapes.center_m[n], shapes.rotation[n])
        half = shapes.half_m[n]
        free *= 1.0 - blur_share(x, y, z, half[0], half[1], half[2], shapes.radius_m[n], width)
    return 1.0 - free


@compiled
def _keep_near(part: Part, shapes: Shapes, lists: Ints, start: int, stop: int) -> tuple[int, bool]:
    """Copy the shapes of lists[start:stop] that may cut a part behind them.

    Returns where the copies end, and whether one of the shapes holds all of the part.
    """
    end = stop
    for m in range(start, stop):
        n = lists[m]
        distance = shape_distance(part.x, part.y, part.z, shapes, n)
        if distance <= -part.radius:
            return end, True
        if distance < part.radius:
            lists[end] = n
            end += 1
    return end, False


@compiled
def _part_share(part: Part, scale: float, shapes: Shapes, near: Ints) -> float:
    """Share of a part that the near shapes fill; -1 where it must be halved to tell."""
    wide = max(part.out, max(part.across, part.up))
    if wide > scale / SMOOTH_PARTS:
        return -1.0
    share = _smooth_share(part, wide, scale, shapes, near)
    if share < 0.0 and wide <= _smallest_part(scale, shapes, near):
        return _blur_union(part, shapes, near)
    return share


@compiled
def _union_volume(bounds: Floats, shapes: Shapes) -> float:
    """Volume of the union of shapes between bounds (d0, d1, a0, a1, e0, e1)."""
    stack = np.empty((STACK, 6))
    starts, stops = np.empty(STACK, dtype=np.int64), np.empty(STACK, dtype=np.int64)
    # Each part's list of near shapes follows its parent's; siblings share the parent's.
    lists = np.empty((STACK + 1) * len(shapes.radius_m), dtype=np.int64)
    lists[: len(shapes.radius_m)] = np.arange(len(shapes.radius_m))
    stack[0], starts[0], stops[0] = bounds, 0, len(shapes.radius_m)
    whole = part_of(bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5])
    scale = whole.volume ** (1.0 / 3.0)
    volume = 0.0
    top = 1
    while top > 0:
        top -= 1
        b = stack[top].copy()
        part = part_of(b[0], b[1], b[2], b[3], b[4], b[5])
        start = stops[top]
        stop, inside = _keep_near(part, shapes, lists, starts[top], start)
        if inside:
            volume += part.volume
        if inside or stop == start:
            continue
        share = _part_share(part, scale, shapes, lists[start:stop])
        if share >= 0.0:
            volume += share * part.volume
            continue
        wide = max(part.out, max(part.across, part.up))
        axis = 0 if part.out == wide else (2 if part.across == wide else 4)
        for side in range(2):
            stack[top] = b
            stack[top, axis + 1 - side] = 0.5 * (b[axis] + b[axis + 1])
            starts[top], stops[top] = start, stop
            top += 1
    return volume


@compiled
def union_shares(shapes: Shapes, edges: GridEdges) -> Floats:
    """Share of each cell [cells] that the union of shapes in the grid frame fills."""
    layers, columns = len(edges.range_m) - 1, len(edges.azimuth_rad) - 1
    rows = len(edges.elevation_rad) - 1
    shares = np.empty(layers * columns * rows)
    bounds = np.empty(6)
    for i in range(layers):
        bounds[0:2] = edges.range_m[i : i + 2]
        for j in range(columns):
            bounds[2:4] = edges.azimuth_rad[j : j + 2]
            for k in range(rows):
                bounds[4:6] = edges.elevation_rad[k : k + 2]
                cell = part_of(bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5])
                volume = _union_volume(bounds, shapes)
                shares[(i * columns + j) * rows + k] = volume / cell.volume
    return shares
