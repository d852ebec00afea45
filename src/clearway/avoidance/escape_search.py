"""Escapes held against all that is known: the compiled loops of `way_out`.

Two distances count: the margin from what is known to stand somewhere, and the body's radius from
what nobody has seen. Places are in the level frame of the decision: the vehicle's place, its yaw.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clearance import moving_clearance, span_clearance, span_of
from clearway.avoidance.hazards import MovingHazards, PointBins
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.obstacles.obstacle import Shapes
from clearway.reach.escapes import Legs, Ways
from clearway.sensors.free_space import SeenSpace, is_free

MOST_COMPARED = 6
"""Escapes of which the one with most room from intruders is taken."""
UNKNOWN, KEEPS, FAILS = 0, 1, 2


class EscapeTerms(NamedTuple):
    """What an escape is held against."""

    seen: SeenSpace
    must_see: bool
    """Whether what nobody has seen counts as occupied."""
    unseen_m: float
    """Distance to be kept from that."""
    margin_m: float
    """Distance to be kept from what is known."""
    slope: float
    """Growth of the margin with the distance from the vehicle."""
    origin_m: FloatArray
    """[3] world frame."""
    yaw_rad: float
    grid_from_level: FloatArray
    """[3, 3]"""
    bins: PointBins
    shapes: Shapes
    moving: MovingHazards
    nothing: MovingHazards
    """No intruder at all."""

    def __repr__(self) -> str:
        return brief(self)


@compiled
def corners_of(pose: FloatArray, path: FloatArray) -> FloatArray:
    """[samples + 1, 3] level frame: a movement [samples, 4] flown from a pose [4]."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    corners = np.empty((len(path) + 1, 3))
    corners[0] = pose[:3]
    for s in range(len(path)):
        corners[s + 1, 0] = pose[0] + cosine * path[s, 0] - sine * path[s, 1]
        corners[s + 1, 1] = pose[1] + sine * path[s, 0] + cosine * path[s, 1]
        corners[s + 1, 2] = pose[2] + path[s, 2]
    return corners


@compiled
def pose_after(pose: FloatArray, path: FloatArray) -> FloatArray:
    """[4] place and yaw at the end of a movement."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    end = path[len(path) - 1]
    after = np.empty(4)
    after[0] = pose[0] + cosine * end[0] - sine * end[1]
    after[1] = pose[1] + sine * end[0] + cosine * end[1]
    after[2] = pose[2] + end[2]
    after[3] = pose[3] + end[3]
    return after


@compiled
def was_seen(corners: FloatArray, sagitta: float, terms: EscapeTerms) -> bool:
    """Whether the body stays in seen space on its way through corners, level frame."""
    cosine, sine = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    last = len(corners) - 1
    for at in range(len(corners)):
        # The middle and the end first: they are the most likely to fail.
        s = last - at if at % 2 == 0 else at - 1
        before = corners[s] - corners[s - 1] if s > 0 else corners[1] - corners[0]
        half = 0.5 * np.sqrt(before[0] ** 2 + before[1] ** 2 + before[2] ** 2)
        x = terms.origin_m[0] + cosine * corners[s, 0] - sine * corners[s, 1]
        y = terms.origin_m[1] + sine * corners[s, 0] + cosine * corners[s, 1]
        z = terms.origin_m[2] + corners[s, 2]
        if not is_free(terms.seen, x, y, z, terms.unseen_m + half + sagitta):
            return False
    return True


@compiled
def keeps_margin(
    corners: FloatArray, sagitta: float, start_s: float, end_s: float, terms: EscapeTerms
) -> bool:
    """Whether a movement through corners, level frame, keeps the margin from all that stands."""
    turned = np.empty_like(corners)
    g = terms.grid_from_level
    farthest2 = 0.0
    for s in range(len(corners)):
        x, y, z = corners[s, 0], corners[s, 1], corners[s, 2]
        farthest2 = max(farthest2, x * x + y * y + z * z)
        for axis in range(3):
            turned[s, axis] = g[axis, 0] * x + g[axis, 1] * y + g[axis, 2] * z
    needed = terms.margin_m + sagitta + terms.slope * np.sqrt(farthest2)
    span = span_of(turned, start_s, end_s)
    found = span_clearance(span, terms.bins, terms.shapes, terms.nothing, needed)
    return bool(found[0] >= needed - 1e-9 * terms.margin_m)


@compiled
def leg_keeps(
    pose: FloatArray, path: FloatArray, sagitta: float, start_s: float, end_s: float,
    terms: EscapeTerms,
) -> bool:
    """Whether a movement from a pose [4] is safe: through seen space, with the margin."""
    corners = corners_of(pose, path)
    if terms.must_see and not was_seen(corners, sagitta, terms):
        return False
    return keeps_margin(corners, sagitta, start_s, end_s, terms)


@compiled
def chain_keeps(
    movements: IntArray, start: int, pose: FloatArray, start_s: float, legs: Legs,
    terms: EscapeTerms,
) -> bool:
    """Whether movements one after the other are safe, from an attitude and a pose [4]."""
    at = start
    for m in movements:
        if at < 0:
            return False
        end_s = start_s + legs.duration_s[m]
        if not leg_keeps(pose, legs.path[at, m], legs.sagitta_m[at, m], start_s, end_s, terms):
            return False
        pose, start_s, at = pose_after(pose, legs.path[at, m]), end_s, legs.following[at, m]
    return at >= 0


@compiled
def chain_room(
    movements: IntArray, start: int, pose: FloatArray, start_s: float, legs: Legs,
    terms: EscapeTerms, enough: float,
) -> float:
    """Smallest distance from intruders at equal times along movements, no more than `enough`."""
    at, best = start, enough
    for m in movements:
        corners = corners_of(pose, legs.path[at, m])
        turned = np.empty_like(corners)
        for s in range(len(corners)):
            for axis in range(3):
                turned[s, axis] = (
                    terms.grid_from_level[axis, 0] * corners[s, 0]
                    + terms.grid_from_level[axis, 1] * corners[s, 1]
                    + terms.grid_from_level[axis, 2] * corners[s, 2]
                )
        end_s = start_s + legs.duration_s[m]
        found = moving_clearance(span_of(turned, start_s, end_s), terms.moving, best)
        if found[2] >= 0:
            best = min(best, found[0] - legs.sagitta_m[at, m])
        pose, start_s, at = pose_after(pose, legs.path[at, m]), end_s, legs.following[at, m]
    return best


@compiled
def movements_of(ways: Ways, escape: int) -> IntArray:
    """All movements of an escape: its beginning and one round of its loop."""
    loop = ways.loop[escape]
    first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
    count, b = 0, ways.begins[escape]
    while ways.parent[b] >= 0:
        count += 1
        b = ways.parent[b]
    movements = np.empty(count + last - first, dtype=np.int64)
    movements[count:] = ways.loop_movement[first:last]
    b = ways.begins[escape]
    while ways.parent[b] >= 0:
        count -= 1
        movements[count] = ways.movement[b]
        b = ways.parent[b]
    return movements


@compiled
def first_escape(
    ways: Ways, legs: Legs, start: int, pose: FloatArray, start_s: float, terms: EscapeTerms
) -> tuple[int, float]:
    """The first escape that is safe from an attitude and a pose [4], and its room from intruders.

    Among intruders the best of a few; -1 where none is safe.
    """
    count = len(ways.parent)
    state = np.zeros(count, dtype=np.int8)
    poses, times = np.empty((count, 4)), np.empty(count)
    state[0], poses[0], times[0] = KEEPS, pose, start_s
    best, best_room, compared = -1, -np.inf, 0
    for escape in range(len(ways.begins)):
        begin = ways.begins[escape]
        if not _begins(begin, ways, legs, poses, times, state, terms):
            continue
        loop = ways.loop[escape]
        movements = ways.loop_movement[ways.loop_at[loop] : ways.loop_at[loop + 1]]
        if not chain_keeps(
            movements, ways.attitude[begin], poses[begin], times[begin], legs, terms
        ):
            continue
        if len(terms.moving.radius_m) == 0:
            return escape, np.inf
        room = chain_room(
            movements_of(ways, escape), start, pose, start_s, legs, terms, 2.0 * terms.margin_m
        )
        if room > best_room:
            best, best_room = escape, room
        compared += 1
        if room >= terms.margin_m or compared >= MOST_COMPARED:
            break
    return best, best_room


@compiled
def _begins(
    begin: int, ways: Ways, legs: Legs, poses: FloatArray, times: FloatArray, state: IntArray,
    terms: EscapeTerms,
) -> bool:
    """Whether a beginning is safe; what is found out about it and those before it is kept."""
    if state[begin] != UNKNOWN:
        return bool(state[begin] == KEEPS)
    way = np.empty(16, dtype=np.int64)
    depth, b = 0, begin
    while state[b] == UNKNOWN:
        way[depth] = b
        depth += 1
        b = ways.parent[b]
    for at in range(depth - 1, -1, -1):
        b = way[at]
        parent = ways.parent[b]
        if state[parent] == FAILS:
            state[b] = FAILS
            continue
        attitude, m = ways.attitude[parent], ways.movement[b]
        times[b] = times[parent] + legs.duration_s[m]
        path, sagitta = legs.path[attitude, m], legs.sagitta_m[attitude, m]
        safe = leg_keeps(poses[parent], path, sagitta, times[parent], times[b], terms)
        state[b] = KEEPS if safe else FAILS
        poses[b] = pose_after(poses[parent], path)
    return bool(state[begin] == KEEPS)
