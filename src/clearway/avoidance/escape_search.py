"""The first escape of a library that keeps what is asked: the compiled search of `way_out`."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.avoidance.escape_chains import (
    chain_for,
    chain_keeps_margin,
    chain_room,
    chain_was_seen,
    may_be_flown,
    rounds,
    step_on,
)
from clearway.avoidance.escape_legs import EscapeTerms, LegRoom, leg_keeps_margin, leg_was_seen
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.escapes import Legs, Ways
from clearway.sensors.seen_space import Voxels, is_free, is_place_free

MOST_COMPARED = 6
"""Escapes of which the one with most room from intruders is taken."""
NEARLY = 0.9
"""Of a distance, so that rounding never makes a first look stricter than the last."""
LONGEST = 32
"""Movements of a loop that there is room for from the beginning."""
AT_ONCE = 64
"""Escapes that get a first look at once."""
UNKNOWN, KEEPS, FAILS = 0, 1, 2
Known = npt.NDArray[np.int8]
"""Of each, whether it is UNKNOWN, KEEPS what is asked, or FAILS."""


@compiled
def loop_places(ways: Ways, legs: Legs) -> FloatArray:
    """[..., 4] where and when each movement of each loop ends, from the loop's start at yaw 0; of
    each loop those half way round first, since most that lead where nobody has looked do so
    there."""
    places = np.empty((len(ways.loop_movement), 4))
    poses = np.empty((2, 4))
    for loop in range(len(ways.loop_attitude)):
        at = ways.loop_attitude[loop]
        first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
        count = last - first
        in_order, when_s = np.empty((count, 4)), 0.0
        poses[0] = 0.0
        for n in range(count):
            m = ways.loop_movement[first + n]
            step_on(poses, 0, legs.path[at, m])
            when_s += legs.duration_s[m]
            in_order[n, :3], in_order[n, 3] = poses[1, :3], when_s
            poses[0], at = poses[1], legs.following[at, m]
        stride, filled = max(1, count // 4), first
        for begins in range(stride):
            for lap in range((count - begins + stride - 1) // stride):
                places[filled] = in_order[(count // 2 + begins + lap * stride) % count]
                filled += 1
    return places


@borrowing
def _places_were_seen(
    places: FloatArray,
    first: int,
    last: int,
    placed: FloatArray,
    wind: FloatArray,
    radius: float,
    free: Voxels,
    window: FloatArray,
) -> bool:
    """Whether places first to last of a loop were seen, in one round of it.

    placed: where the loop begins, by `_placed_at`. wind: [3] in the world. The places alone are
    looked up, with a radius: quick to tell that a loop leads where nobody has looked, which most
    do.
    """
    x0, y0, z0, cosine, sine = placed[0], placed[1], placed[2], placed[3], placed[4]
    for n in range(first, last):
        ahead, left, when = places[n, 0], places[n, 1], places[n, 3]
        x = x0 + cosine * ahead - sine * left + wind[0] * when
        y = y0 + sine * ahead + cosine * left + wind[1] * when
        if not is_free(free, window, x, y, z0 + places[n, 2] + wind[2] * when, radius):
            return False
    return True


@compiled
def _wind_of(terms: EscapeTerms) -> FloatArray:
    """[3] in the world; the terms have it in the level frame."""
    cosine, sine = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    level, wind = terms.wind_mps, np.empty(3)
    wind[0] = cosine * level[0] - sine * level[1]
    wind[1] = sine * level[0] + cosine * level[1]
    wind[2] = level[2]
    return wind


@compiled
def _placed_at(pose: FloatArray, start_s: float, terms: EscapeTerms) -> FloatArray:
    """[6] world place of a pose at a time, cosine and sine of its yaw, and 1 for a place that
    counts as met since the vehicle is there."""
    yaw, origin, placed = terms.yaw_rad, terms.origin_m, np.empty(6)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    placed[0] = origin[0] + cosine * pose[0] - sine * pose[1]
    placed[1] = origin[1] + sine * pose[0] + cosine * pose[1]
    placed[2] = origin[2] + pose[2]
    placed[:3] += start_s * _wind_of(terms)
    placed[3], placed[4] = np.cos(yaw + pose[3]), np.sin(yaw + pose[3])
    placed[5] = 1.0
    return placed


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

    What is quick to find out is looked at first, and what does not depend on the distance once. Of
    beginnings whose ends nobody has seen, no loop is looked at.
    """
    count, escapes = len(ways.parent), len(ways.begins)
    poses, times = np.empty((count, 4)), np.empty(count)
    placed = np.empty((count, 6))
    poses[0], times[0], placed[0] = pose, start_s, _placed_at(pose, start_s, terms)
    wind, chain = _wind_of(terms), chain_for(LONGEST, legs)
    up = np.empty(count, dtype=np.int64)
    known, looked_at = 1, 0
    clear = np.zeros(count, dtype=np.int8)  # Whether a beginning keeps the margin.
    clear[0] = KEEPS
    looped = np.zeros(escapes, dtype=np.int8)  # Whether the places of its loop were seen at all.
    cleared = np.zeros(escapes, dtype=np.int8)  # Whether its loop keeps the margin.
    best, best_room = -1, -np.inf
    for unseen in aloof_m:
        seen, compared = np.zeros(count, dtype=np.int8), 0
        if terms.must_see and not _is_clear(placed[0], unseen, terms):
            continue  # All begin here.
        seen[0] = KEEPS
        following = 0
        while following < escapes:
            if following >= looked_at:
                looked_at = min(escapes, following + AT_ONCE)
                known = _look_at(
                    following,
                    looked_at,
                    known,
                    ways,
                    legs,
                    places,
                    poses,
                    times,
                    placed,
                    looped,
                    wind,
                    terms,
                )
            escape = _first_left(
                following,
                looked_at,
                ways,
                places,
                placed,
                wind,
                looped,
                cleared,
                clear,
                seen,
                unseen,
                terms,
            )
            following = min(escape + 1, looked_at)
            if escape == looked_at:
                continue
            begin, loop = ways.begins[escape], ways.loop[escape]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            if not _begin_was_seen(
                begin, unseen, ways, legs, poses, times, seen, terms, up, chain.leg
            ):
                continue
            movements = rounds(ways.loop_movement[first:last], legs, terms.least_s)
            if len(movements) >= len(chain.times_s):
                chain = chain_for(len(movements), legs)
            at, then, when = ways.attitude[begin], poses[begin], times[begin]
            if not may_be_flown(movements, at, then, when, legs, chain):
                cleared[escape] = FAILS
                continue
            if terms.must_see and not chain_was_seen(movements, legs, unseen, terms, chain):
                continue
            if not _begin_keeps_margin(
                begin, ways, legs, poses, times, clear, terms, up, chain.leg
            ):
                continue
            if cleared[escape] == UNKNOWN:
                keeps = chain_keeps_margin(movements, legs, terms, chain)
                cleared[escape] = KEEPS if keeps else FAILS
            if cleared[escape] == FAILS:
                continue
            if len(terms.moving.radius_m) == 0:
                return escape, np.inf
            whole, most = movements_of(ways, escape), 2.0 * terms.margin_m
            # One that has no more room than the best need not be looked at to its end.
            room = chain_room(whole, start, pose, start_s, legs, terms, most, best_room)
            if room > best_room:
                best, best_room = escape, room
            compared += 1
            if room >= terms.margin_m or compared >= MOST_COMPARED:
                break
        if best >= 0:
            break
    return best, best_room


@borrowing
def _first_left(
    escape: int,
    last: int,
    ways: Ways,
    places: FloatArray,
    placed: FloatArray,
    wind: FloatArray,
    looped: Known,
    cleared: Known,
    clear: Known,
    seen: Known,
    unseen: float,
    terms: EscapeTerms,
) -> int:
    """The first from an escape on up to the last that nothing known or quickly found out rules
    out, so far from what nobody has seen; the last if there is none."""
    for e in range(escape, last):
        begin, loop = ways.begins[e], ways.loop[e]
        if looped[e] == FAILS or cleared[e] == FAILS or clear[begin] == FAILS:
            continue
        if seen[begin] == UNKNOWN and terms.must_see:
            beyond = seen[ways.parent[begin]] == FAILS
            if beyond or not _is_clear(placed[begin], unseen, terms):
                seen[begin] = FAILS
        if seen[begin] == FAILS:
            continue
        if looped[e] == KEEPS and not _places_were_seen(
            places,
            ways.loop_at[loop],
            ways.loop_at[loop + 1],
            placed[begin],
            wind,
            NEARLY * unseen,
            terms.free,
            terms.window,
        ):
            continue
        return e
    return last


@borrowing
def _look_at(
    escape: int,
    last: int,
    known: int,
    ways: Ways,
    legs: Legs,
    places: FloatArray,
    poses: FloatArray,
    times: FloatArray,
    placed: FloatArray,
    looped: Known,
    wind: FloatArray,
    terms: EscapeTerms,
) -> int:
    """A first look at escapes up to the last: where beginnings lead, and whether the places of
    loops were seen at all; returns how many beginnings are known now.

    A beginning whose end, or that of one before it, lies where nobody has looked fails by its last
    corner: so do all its loops.
    """
    free, window = terms.free, terms.window
    ox, oy, oz = terms.origin_m[0], terms.origin_m[1], terms.origin_m[2]
    cos_yaw, sin_yaw = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    end = legs.path.shape[2] - 1
    for e in range(escape, last):
        begin, loop = ways.begins[e], ways.loop[e]
        while known <= begin:  # Parents come first.
            parent, m = ways.parent[known], ways.movement[known]
            at = ways.attitude[parent]
            x, y, z, yaw = poses[parent, 0], poses[parent, 1], poses[parent, 2], poses[parent, 3]
            cosine, sine = np.cos(yaw), np.sin(yaw)
            ahead, left = legs.path[at, m, end, 0], legs.path[at, m, end, 1]
            x = x + cosine * ahead - sine * left
            y = y + sine * ahead + cosine * left
            z = z + legs.path[at, m, end, 2]
            yaw = yaw + legs.path[at, m, end, 3]
            poses[known, 0], poses[known, 1], poses[known, 2], poses[known, 3] = x, y, z, yaw
            times[known] = times[parent] + legs.duration_s[m]
            when = times[known]
            placed[known, 0] = ox + cos_yaw * x - sin_yaw * y + wind[0] * when
            placed[known, 1] = oy + sin_yaw * x + cos_yaw * y + wind[1] * when
            placed[known, 2] = oz + z + wind[2] * when
            placed[known, 3] = np.cos(terms.yaw_rad + yaw)
            placed[known, 4] = np.sin(terms.yaw_rad + yaw)
            if terms.must_see:
                met = placed[parent, 5] > 0.0 and is_place_free(
                    free, window, placed[known, 0], placed[known, 1], placed[known, 2]
                )
                placed[known, 5] = 1.0 if met else 0.0
            known += 1
        if not terms.must_see:
            continue
        looped[e] = FAILS
        if placed[begin, 5] > 0.0:
            x, y, z = placed[begin, 0], placed[begin, 1], placed[begin, 2]
            cosine, sine = placed[begin, 3], placed[begin, 4]
            looped[e] = KEEPS
            for n in range(ways.loop_at[loop], ways.loop_at[loop + 1]):
                ahead, left, up = places[n, 0], places[n, 1], places[n, 2]
                later = places[n, 3]
                east = x + cosine * ahead - sine * left + wind[0] * later
                north = y + sine * ahead + cosine * left + wind[1] * later
                if not is_place_free(free, window, east, north, z + up + wind[2] * later):
                    looped[e] = FAILS
                    break
    return known


@borrowing
def _is_clear(placed: FloatArray, unseen: float, terms: EscapeTerms) -> bool:
    """Whether about a place, by `_placed_at`, so much was seen: quick to tell that what begins or
    ends there did not."""
    x, y, z = placed[0], placed[1], placed[2]
    return is_free(terms.free, terms.window, x, y, z, NEARLY * unseen)


@borrowing
def _begin_was_seen(
    begin: int,
    unseen: float,
    ways: Ways,
    legs: Legs,
    poses: FloatArray,
    times: FloatArray,
    seen: Known,
    terms: EscapeTerms,
    up: IntArray,
    room: LegRoom,
) -> bool:
    """Whether a beginning may be flown, and leads through seen space where that is asked for.

    up: [beginnings] room for those before it.
    """
    for n in range(_note_up_to(begin, ways, seen, up) - 1, -1, -1):
        b = up[n]
        parent, m = ways.parent[b], ways.movement[b]
        at, when = ways.attitude[parent], (times[parent], times[b])
        good = seen[parent] == KEEPS and legs.following[at, m] >= 0
        if good and terms.must_see:
            path, sagitta = legs.path[at, m], legs.sagitta_m[at, m]
            good = leg_was_seen(poses[parent], path, sagitta, when, unseen, terms, room)
        seen[b] = KEEPS if good else FAILS
    return bool(seen[begin] == KEEPS)


@borrowing
def _begin_keeps_margin(
    begin: int,
    ways: Ways,
    legs: Legs,
    poses: FloatArray,
    times: FloatArray,
    clear: Known,
    terms: EscapeTerms,
    up: IntArray,
    room: LegRoom,
) -> bool:
    """Whether a beginning keeps the margin."""
    for n in range(_note_up_to(begin, ways, clear, up) - 1, -1, -1):
        b = up[n]
        parent, m = ways.parent[b], ways.movement[b]
        at, when = ways.attitude[parent], (times[parent], times[b])
        good = clear[parent] == KEEPS
        if good:
            path, sagitta = legs.path[at, m], legs.sagitta_m[at, m]
            good = leg_keeps_margin(poses[parent], path, sagitta, when, terms, room)
        clear[b] = KEEPS if good else FAILS
    return bool(clear[begin] == KEEPS)


@borrowing
def _note_up_to(begin: int, ways: Ways, state: Known, up: IntArray) -> int:
    """Fill in a beginning and those before it of which nothing is known yet, the first one last;
    returns how many."""
    count, b = 0, begin
    while state[b] == UNKNOWN:
        up[count] = b
        count += 1
        b = ways.parent[b]
    return count
