"""Escapes held against all that is known: the compiled loops of `way_out`.

Two distances count: the margin from what is known to stand somewhere, and the body's radius from
what nobody has seen. Places are in the level frame of the decision: the vehicle's place, its yaw.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.avoidance.clearance import moving_clearance, span_clearance, span_of
from clearway.avoidance.hazards import MovingHazards, PointBins
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.obstacles.obstacle import Shapes
from clearway.reach.escapes import Legs, Ways
from clearway.sensors.free_space import (
    NO_VOXELS,
    Voxels,
    box_about,
    is_box_free,
    is_declared,
    is_free,
)

GROWN_S = 10.0
"""For how long what is unsure about the wind adds up: then own states have told it anew."""
MOST_COMPARED = 6
"""Escapes of which the one with most room from intruders is taken."""
NEARLY = 0.9
"""Of a distance, so that rounding never makes a first look stricter than the last."""
UNKNOWN, KEEPS, FAILS = 0, 1, 2
Known = npt.NDArray[np.int8]
"""Of each, whether it is UNKNOWN, KEEPS what is asked, or FAILS."""
Times = tuple[float, float]
"""When a movement begins and ends, s from the decision on."""


class EscapeTerms(NamedTuple):
    """What an escape is held against."""

    free: Voxels
    """Of what was seen to be free, with its window."""
    window: FloatArray
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
    wind_mps: FloatArray
    """[3] level frame."""
    unsure_mps: float
    """How far off it may be."""
    least_s: float
    """For how long an escape is looked at, in whole rounds of its loop: once where there is no
    wind, since it then comes back to where it began."""

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
def carried(pose: FloatArray, path: FloatArray, times: Times, terms: EscapeTerms) -> FloatArray:
    """[samples + 1, 3] as `corners_of`, carried by the wind; poses are those in still air."""
    corners = corners_of(pose, path)
    wind, last = terms.wind_mps, len(corners) - 1
    if wind[0] != 0.0 or wind[1] != 0.0 or wind[2] != 0.0:
        for s in range(last + 1):
            time = times[0] + (times[1] - times[0]) * s / last
            for axis in range(3):
                corners[s, axis] += wind[axis] * time
    return corners


@compiled
def unsure_after(end_s: float, terms: EscapeTerms) -> float:
    """How far off the wind may have carried the vehicle by then."""
    return terms.unsure_mps * min(end_s, GROWN_S)


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
    return _way_was_seen(
        corners, sagitta + terms.unseen_m, terms.origin_m, terms.yaw_rad, terms.free, terms.window
    )


@compiled
def _way_was_seen(
    corners: FloatArray,
    radius: float,
    origin: FloatArray,
    yaw: float,
    free: Voxels,
    window: FloatArray,
) -> bool:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    last = len(corners) - 1
    half = 0.0
    for s in range(last):
        dx, dy = corners[s + 1, 0] - corners[s, 0], corners[s + 1, 1] - corners[s, 1]
        dz = corners[s + 1, 2] - corners[s, 2]
        half = max(half, 0.5 * np.sqrt(dx * dx + dy * dy + dz * dz))
    known = NO_VOXELS  # Boxes of neighbours share most of their voxels.
    for at in range(len(corners)):
        s = last - at
        x = origin[0] + cosine * corners[s, 0] - sine * corners[s, 1]
        y = origin[1] + sine * corners[s, 0] + cosine * corners[s, 1]
        z = origin[2] + corners[s, 2]
        if not is_declared(window, x, y, z, radius + half):
            box = box_about(window, x, y, z, radius + half)
            if box != known and not is_box_free(free, window, box, known):
                return False
            known = box
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
    pose: FloatArray,
    path: FloatArray,
    sagitta: float,
    start_s: float,
    end_s: float,
    terms: EscapeTerms,
) -> bool:
    """Whether a movement from a pose [4] is safe: through seen space, with the margin."""
    times = (start_s, end_s)
    if terms.must_see and not _leg_was_seen(pose, path, sagitta, times, terms.unseen_m, terms):
        return False
    return _leg_keeps_margin(pose, path, sagitta, times, terms)


@compiled
def _leg_was_seen(
    pose: FloatArray,
    path: FloatArray,
    sagitta: float,
    times: Times,
    unseen: float,
    terms: EscapeTerms,
) -> bool:
    """Whether it leads through seen space, so far from the unseen."""
    corners = carried(pose, path, times, terms)
    radius = sagitta + unsure_after(times[1], terms) + unseen
    return _way_was_seen(corners, radius, terms.origin_m, terms.yaw_rad, terms.free, terms.window)


@compiled
def _leg_keeps_margin(
    pose: FloatArray, path: FloatArray, sagitta: float, times: Times, terms: EscapeTerms
) -> bool:
    corners = carried(pose, path, times, terms)
    around = sagitta + unsure_after(times[1], terms)
    return keeps_margin(corners, around, times[0], times[1], terms)


@compiled
def chain_keeps(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
) -> bool:
    """Whether movements one after the other are safe, from an attitude and a pose [4].

    What is quick to find out is looked at first: most chains fail in what nobody has seen.
    """
    unseen = terms.unseen_m
    if terms.must_see and not _chain_was_seen(movements, start, pose, start_s, legs, unseen, terms):
        return False
    return _chain_keeps_margin(movements, start, pose, start_s, legs, terms)


@compiled
def _chain_was_seen(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    unseen: float,
    terms: EscapeTerms,
) -> bool:
    """Whether all movements may be flown, through seen space, so far from the unseen.

    Those half way along come first, each time: most chains are loops, and fail there.
    """
    count = len(movements)
    poses, times = np.empty((count + 1, 4)), np.empty(count + 1)
    at = np.empty(count + 1, dtype=np.int64)
    poses[0], times[0], at[0] = pose, start_s, start
    for n in range(count):
        m = movements[n]
        at[n + 1], times[n + 1] = legs.following[at[n], m], times[n] + legs.duration_s[m]
        if at[n + 1] < 0:
            return False
        _step(poses, n, legs.path[at[n], m])
    stride = max(1, count // 4)
    for begins in range(stride):
        for lap in range((count - begins + stride - 1) // stride):
            n = (count // 2 + begins + lap * stride) % count
            m, when = movements[n], (times[n], times[n + 1])
            path, sagitta = legs.path[at[n], m], legs.sagitta_m[at[n], m]
            if not _leg_was_seen(poses[n], path, sagitta, when, unseen, terms):
                return False
    return True


@compiled
def _chain_keeps_margin(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
) -> bool:
    """Whether all movements may be flown, with the margin."""
    at = start
    for m in movements:
        if legs.following[at, m] < 0:
            return False
        path, times = legs.path[at, m], (start_s, start_s + legs.duration_s[m])
        if not _leg_keeps_margin(pose, path, legs.sagitta_m[at, m], times, terms):
            return False
        pose, at, start_s = pose_after(pose, path), legs.following[at, m], times[1]
    return True


@compiled
def chain_corners(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
) -> FloatArray:
    """[movements x samples, 3] places along movements one after the other, level frame."""
    samples, at = legs.path.shape[2], start
    places = np.empty((len(movements) * samples, 3))
    for n in range(len(movements)):
        m = movements[n]
        path, times = legs.path[at, m], (start_s, start_s + legs.duration_s[m])
        places[n * samples : (n + 1) * samples] = carried(pose, path, times, terms)[1:]
        pose, at, start_s = pose_after(pose, path), legs.following[at, m], times[1]
    return places


@compiled
def rounds(loop: IntArray, legs: Legs, least_s: float) -> IntArray:
    """A loop as often as it takes to fly for so long, once at least."""
    one_s = 0.0
    for m in loop:
        one_s += legs.duration_s[m]
    number = max(1, int(np.ceil(least_s / one_s - 1e-6)))
    movements = np.empty(number * len(loop), dtype=np.int64)
    for n in range(number):
        movements[n * len(loop) : (n + 1) * len(loop)] = loop
    return movements


@compiled
def _step(poses: FloatArray, n: int, path: FloatArray) -> None:
    """Fill in the pose after the one numbered `n`."""
    cosine, sine = np.cos(poses[n, 3]), np.sin(poses[n, 3])
    last = len(path) - 1
    poses[n + 1, 0] = poses[n, 0] + cosine * path[last, 0] - sine * path[last, 1]
    poses[n + 1, 1] = poses[n, 1] + sine * path[last, 0] + cosine * path[last, 1]
    poses[n + 1, 2] = poses[n, 2] + path[last, 2]
    poses[n + 1, 3] = poses[n, 3] + path[last, 3]


@compiled
def loop_places(ways: Ways, legs: Legs) -> FloatArray:
    """[...,  3] where each movement of each loop ends, from the loop's start at yaw 0."""
    places = np.empty((len(ways.loop_movement), 3))
    poses = np.empty((2, 4))
    for loop in range(len(ways.loop_attitude)):
        at = ways.loop_attitude[loop]
        poses[0] = 0.0
        for n in range(ways.loop_at[loop], ways.loop_at[loop + 1]):
            m = ways.loop_movement[n]
            _step(poses, 0, legs.path[at, m])
            places[n] = poses[1, :3]
            poses[0], at = poses[1], legs.following[at, m]
    return places


@compiled
def _places_were_seen(
    places: FloatArray,
    first: int,
    last: int,
    placed: FloatArray,
    radius: float,
    free: Voxels,
    window: FloatArray,
) -> bool:
    """Whether places first to last of a loop were seen, those half way round first.

    placed: where the loop begins, by `_placed_at`. The places alone are looked up, with a radius:
    quick to tell that a loop leads where nobody has looked, which most do.
    """
    x0, y0, z0, cosine, sine = placed[0], placed[1], placed[2], placed[3], placed[4]
    count = last - first
    stride = max(1, count // 4)
    for begins in range(stride):
        for lap in range((count - begins + stride - 1) // stride):
            n = first + (count // 2 + begins + lap * stride) % count
            x = x0 + cosine * places[n, 0] - sine * places[n, 1]
            y = y0 + sine * places[n, 0] + cosine * places[n, 1]
            if not is_free(free, window, x, y, z0 + places[n, 2], radius):
                return False
    return True


@compiled
def _placed_at(pose: FloatArray, terms: EscapeTerms) -> FloatArray:
    """[5] world place of a pose, cosine and sine of its yaw."""
    yaw, origin, placed = terms.yaw_rad, terms.origin_m, np.empty(5)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    placed[0] = origin[0] + cosine * pose[0] - sine * pose[1]
    placed[1] = origin[1] + sine * pose[0] + cosine * pose[1]
    placed[2] = origin[2] + pose[2]
    placed[3], placed[4] = np.cos(yaw + pose[3]), np.sin(yaw + pose[3])
    return placed


@compiled
def chain_room(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
    enough: float,
) -> float:
    """Smallest distance from intruders at equal times along movements, no more than `enough`."""
    at, best = start, enough
    for m in movements:
        corners = carried(pose, legs.path[at, m], (start_s, start_s + legs.duration_s[m]), terms)
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
    ways: Ways,
    legs: Legs,
    places: FloatArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    terms: EscapeTerms,
    aloof_m: FloatArray,
) -> tuple[int, float]:
    """The first escape that is safe from an attitude and a pose [4], and its room from intruders.

    places: of the loops, by `loop_places`. aloof_m: distances to be kept from what nobody has seen,
    in place of that of the terms; a later one only where those before leave nothing. Among
    intruders the best of a few; -1 if none is safe.

    What is quick to find out is looked at first, and what does not depend on the distance once.
    """
    count, escapes = len(ways.parent), len(ways.begins)
    poses, times = np.empty((count, 4)), np.empty(count)
    placed = np.empty((count, 5))
    poses[0], times[0], placed[0], known = pose, start_s, _placed_at(pose, terms), 1
    clear = np.zeros(count, dtype=np.int8)  # Whether a beginning keeps the margin.
    clear[0] = KEEPS
    looped = np.zeros(escapes, dtype=np.int8)  # Whether the places of its loop were seen at all.
    cleared = np.zeros(escapes, dtype=np.int8)  # Whether its loop keeps the margin.
    best, best_room = -1, -np.inf
    for unseen in aloof_m:
        seen, compared = np.zeros(count, dtype=np.int8), 0
        seen[0] = KEEPS
        for escape in range(escapes):
            begin, loop = ways.begins[escape], ways.loop[escape]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            while known <= begin:  # Parents come first.
                parent, m = ways.parent[known], ways.movement[known]
                poses[known] = pose_after(poses[parent], legs.path[ways.attitude[parent], m])
                times[known] = times[parent] + legs.duration_s[m]
                placed[known] = _placed_at(poses[known], terms)
                known += 1
            # Where wind carries the places, they are looked up with the rest.
            if terms.must_see and terms.least_s == 0.0 and looped[escape] == UNKNOWN:
                met = _places_were_seen(
                    places, first, last, placed[begin], 0.0, terms.free, terms.window
                )
                looped[escape] = KEEPS if met else FAILS
            if looped[escape] == FAILS or cleared[escape] == FAILS or clear[begin] == FAILS:
                continue
            if looped[escape] == KEEPS and not _places_were_seen(
                places, first, last, placed[begin], NEARLY * unseen, terms.free, terms.window
            ):
                continue
            if not _begin_was_seen(begin, unseen, ways, legs, poses, times, seen, terms):
                continue
            movements = rounds(ways.loop_movement[first:last], legs, terms.least_s)
            at, then, when = ways.attitude[begin], poses[begin], times[begin]
            if terms.must_see and not _chain_was_seen(
                movements, at, then, when, legs, unseen, terms
            ):
                continue
            if not _begin_keeps_margin(begin, ways, legs, poses, times, clear, terms):
                continue
            if cleared[escape] == UNKNOWN:
                keeps = _chain_keeps_margin(movements, at, then, when, legs, terms)
                cleared[escape] = KEEPS if keeps else FAILS
            if cleared[escape] == FAILS:
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
        if best >= 0:
            break
    return best, best_room


@compiled
def _begin_was_seen(
    begin: int,
    unseen: float,
    ways: Ways,
    legs: Legs,
    poses: FloatArray,
    times: FloatArray,
    seen: Known,
    terms: EscapeTerms,
) -> bool:
    """Whether a beginning may be flown, and leads through seen space where that is asked for."""
    for b in _up_to(begin, ways, seen):
        parent, m = ways.parent[b], ways.movement[b]
        at, when = ways.attitude[parent], (times[parent], times[b])
        good = seen[parent] == KEEPS and legs.following[at, m] >= 0
        if good and terms.must_see:
            path, sagitta = legs.path[at, m], legs.sagitta_m[at, m]
            good = _leg_was_seen(poses[parent], path, sagitta, when, unseen, terms)
        seen[b] = KEEPS if good else FAILS
    return bool(seen[begin] == KEEPS)


@compiled
def _begin_keeps_margin(
    begin: int,
    ways: Ways,
    legs: Legs,
    poses: FloatArray,
    times: FloatArray,
    clear: Known,
    terms: EscapeTerms,
) -> bool:
    """Whether a beginning keeps the margin."""
    for b in _up_to(begin, ways, clear):
        parent, m = ways.parent[b], ways.movement[b]
        at, when = ways.attitude[parent], (times[parent], times[b])
        path, sagitta = legs.path[at, m], legs.sagitta_m[at, m]
        good = clear[parent] == KEEPS and _leg_keeps_margin(
            poses[parent], path, sagitta, when, terms
        )
        clear[b] = KEEPS if good else FAILS
    return bool(clear[begin] == KEEPS)


@compiled
def _up_to(begin: int, ways: Ways, state: Known) -> IntArray:
    """A beginning and those before it of which nothing is known yet, the first one first."""
    depth, b = 0, begin
    while state[b] == UNKNOWN:
        depth += 1
        b = ways.parent[b]
    up, b = np.empty(depth, dtype=np.int64), begin
    for n in range(depth - 1, -1, -1):
        up[n] = b
        b = ways.parent[b]
    return up
