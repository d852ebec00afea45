"""How near a movement comes to unobserved space, of who can stop and look instead.

For a vehicle that cannot, the body's radius has to do (`escape_legs`): with the margin on both
sides of what it has seen it would find no loop. One that can stop loses nothing by looking first,
and what shows where nobody had looked is then no nearer than the margin.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.clearance import make_span, points_clearance, shapes_clearance
from clearway.avoidance.escape.legs import EscapeTerms
from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled
from clearway.sensors.observed.free_voxels import VoxelBox, box_about
from clearway.sensors.observed.seen_space import SeenSpace, is_free, is_voxel_free

Ball = tuple[float, float, float, float]
"""Middle and radius, world frame."""


@compiled
def keeps_aloof(
    corners: Floats2, sagitta: float, aloof: float, surface: float, terms: EscapeTerms
) -> bool:
    """Whether a way through corners [n, 3], level frame, stays so far from unobserved space.

    surface: within how far of what is known to stand there that counts as part of it, since beams
    clear nothing up to what they hit; from that the margin is kept anyway.
    """
    origin = terms.origin_m
    cosine, sine = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    last = len(corners) - 1
    half = 0.0
    for s in range(last):
        step = corners[s + 1] - corners[s]
        half = max(half, 0.5 * np.sqrt(np.sum(step * step)))
    around = np.sqrt((aloof + sagitta) ** 2 + half * half)
    for at in range(len(corners)):
        s = last - at
        x = origin[0] + cosine * corners[s, 0] - sine * corners[s, 1]
        y = origin[1] + sine * corners[s, 0] + cosine * corners[s, 1]
        z = origin[2] + corners[s, 2]
        if is_free(terms.seen, x, y, z, around):
            continue
        box = box_about(terms.seen.window, x, y, z, around)
        if not _is_surface((x, y, z, around), box, surface, terms):
            return False
    return True


@compiled
def _is_surface(ball: Ball, box: VoxelBox, surface: float, terms: EscapeTerms) -> bool:
    """Whether all that was not seen of a ball lies at something known."""
    origin, window, g = terms.origin_m, terms.seen.window, terms.grid_from_level
    width = 1.0 / window[3]
    cosine, sine = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    place = np.empty((2, 3))
    for a in range(box[0], box[1] + 1):
        for b in range(box[2], box[3] + 1):
            for c in range(box[4], box[5] + 1):
                if not _is_unseen(terms.seen, ball, a, b, c):
                    continue
                dx, dy = (a + 0.5) * width - origin[0], (b + 0.5) * width - origin[1]
                ahead, left = cosine * dx + sine * dy, cosine * dy - sine * dx
                up = (c + 0.5) * width - origin[2]
                for axis in range(3):
                    place[0, axis] = g[axis, 0] * ahead + g[axis, 1] * left + g[axis, 2] * up
                    place[1, axis] = place[0, axis]
                span = make_span(place, 0.0, 0.0)
                if points_clearance(span, terms.bins, surface, surface)[2] >= 0:
                    continue
                if shapes_clearance(span, terms.shapes, surface, surface)[2] < 0:
                    return False
    return True


@compiled
def _is_unseen(seen: SeenSpace, ball: Ball, a: int, b: int, c: int) -> bool:
    """Whether a ball meets a voxel that was not seen to be free."""
    width = 1.0 / seen.window[3]
    x, y, z, radius = ball
    dx = max(a * width - x, 0.0, x - (a + 1) * width)
    dy = max(b * width - y, 0.0, y - (b + 1) * width)
    dz = max(c * width - z, 0.0, z - (c + 1) * width)
    if dx * dx + dy * dy + dz * dz > radius * radius:
        return False
    return not is_voxel_free(seen, a, b, c)
