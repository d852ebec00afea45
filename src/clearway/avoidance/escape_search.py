"""The first escape of a library that keeps what is asked: the compiled search of `way_out`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.avoidance.escape_chains import (
    chain_for,
    chain_keeps_margin,
    chain_room,
    chain_was_seen,
    may_be_flown,
    rounds,
)
from clearway.avoidance.escape_legs import EscapeTerms, LegRoom, leg_keeps_margin, leg_was_seen
from clearway.avoidance.escape_places import NEARLY, places_are_clear, places_were_seen
from clearway.avoidance.too_near import ASKED, FILLED, LONG, TooNear, are_near, fill_in
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.legs import Legs
from clearway.reach.ways import Ways
from clearway.sensors.seen_space import is_free, is_place_free

MOST_COMPARED = 6
"""Escapes of which the one with most room from intruders is taken."""
LONGEST = 32
"""Movements of a loop that there is room for from the beginning."""
FEW = 8
"""Loops that are held against all that is known at once; of more, first against returns near their
places: most of those that fail then are told by these."""
UNKNOWN, KEEPS, FAILS = 0, 1, 2
HERE = np.zeros((1, 4))
"""No loop, but the place where it would begin."""
Known = npt.NDArray[np.int8]
"""Of each, whether it is UNKNOWN, KEEPS what is asked, or FAILS."""


class Begun(NamedTuple):
    """Where beginnings lead, as far as any was asked for."""

    poses: FloatArray
    """[beginnings, 4] at their ends, in still air."""
    times_s: FloatArray
    """[beginnings]"""
    placed: FloatArray
    """[beginnings, 5] world place, cosine and sine of the yaw."""
    known: IntArray
    """[1] the first so many are filled in."""
    up: IntArray
    """[beginnings] room for those before one."""


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
    """[5] world place of a pose at a time, cosine and sine of its yaw."""
    yaw, origin, placed = terms.yaw_rad, terms.origin_m, np.empty(5)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    placed[0] = origin[0] + cosine * pose[0] - sine * pose[1]
    placed[1] = origin[1] + sine * pose[0] + cosine * pose[1]
    placed[2] = origin[2] + pose[2]
    placed[:3] += start_s * _wind_of(terms)
    placed[3], placed[4] = np.cos(yaw + pose[3]), np.sin(yaw + pose[3])
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
    near: TooNear,
) -> tuple[int, float, float]:
    """The first escape that is safe from an attitude and a pose [4], its room from intruders, and
    the distance that it keeps from what nobody has seen.

    places: of the loops, by `loop_places`. aloof_m: distances to be kept from what nobody has seen,
    in place of that of the terms; a later one only where those before leave nothing. Among
    intruders the best of a few; -1 if none is safe.

    What is quick to find out is looked at first, and what does not depend on the distance once. Of
    beginnings whose ends nobody has seen, no loop is looked at.
    """
    count, escapes = len(ways.parent), len(ways.begins)
    poses, times = np.empty((count, 4)), np.empty(count)
    placed, known = np.empty((count, 5)), np.ones(1, dtype=np.int64)
    poses[0], times[0], placed[0] = pose, start_s, _placed_at(pose, start_s, terms)
    begun = Begun(poses, times, placed, known, np.empty(count, dtype=np.int64))
    wind, chain = _wind_of(terms), chain_for(LONGEST, legs, terms.shapes)
    clear = np.zeros(count, dtype=np.int8)  # Whether a beginning keeps the margin.
    clear[0] = KEEPS
    # Whether the places of its loop were seen at all, or what was not is free and they are clear.
    met = np.zeros(escapes, dtype=np.int8)
    cleared = np.zeros(escapes, dtype=np.int8)  # Whether its loop keeps the margin.
    best, best_room, kept, tried = -1, -np.inf, np.nan, 0
    if not places_are_clear(HERE, 0, 1, pose, start_s, terms):
        return best, best_room, kept  # All begin here.
    for unseen in aloof_m:
        seen, compared = np.zeros(count, dtype=np.int8), 0
        if terms.must_see and not _is_clear(placed[0], unseen, terms):
            continue  # All begin here.
        seen[0] = KEEPS
        following = 0
        while following < escapes:
            asked = (following, ways, legs, places, begun, wind, met, cleared, clear, seen)
            if terms.must_see:
                escape = _first_seen(*asked, unseen, terms, chain.leg, near)
            else:
                escape = _first_clear(*asked, terms, chain.leg, near)
            following = escape + 1
            if escape == escapes:
                break
            begin, loop = ways.begins[escape], ways.loop[escape]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            at, then, when = ways.attitude[begin], poses[begin], times[begin]
            tried += 1
            if tried > FEW:  # All loops of a beginning that keeps no margin are passed over.
                if not _begin_keeps_margin(begin, ways, legs, begun, clear, terms, chain.leg):
                    continue
                if not _is_clear_of_returns(places, first, last, then, when, terms, near):
                    cleared[escape] = FAILS
                    continue
            movements = rounds(ways.loop_movement[first:last], legs, terms.least_s)
            if len(movements) >= len(chain.times_s):
                chain = chain_for(len(movements), legs, terms.shapes)
            if not may_be_flown(movements, at, then, when, legs, chain):
                cleared[escape] = FAILS
                continue
            if terms.must_see and not chain_was_seen(movements, legs, unseen, terms, chain):
                continue
            if not _begin_keeps_margin(begin, ways, legs, begun, clear, terms, chain.leg):
                continue
            if cleared[escape] == UNKNOWN:
                keeps = chain_keeps_margin(movements, legs, terms, chain)
                cleared[escape] = KEEPS if keeps else FAILS
            if cleared[escape] == FAILS:
                continue
            if len(terms.moving.radius_m) == 0:
                return escape, np.inf, unseen
            whole, most = movements_of(ways, escape), 2.0 * terms.margin_m
            # One that has no more room than the best need not be looked at to its end.
            room = chain_room(whole, start, pose, start_s, legs, terms, most, best_room)
            if room > best_room:
                best, best_room, kept = escape, room, unseen
            compared += 1
            if room >= terms.margin_m or compared >= MOST_COMPARED:
                break
        if best >= 0:
            break
    return best, best_room, kept


@borrowing
def _first_seen(
    escape: int,
    ways: Ways,
    legs: Legs,
    places: FloatArray,
    begun: Begun,
    wind: FloatArray,
    met: Known,
    cleared: Known,
    clear: Known,
    seen: Known,
    unseen: float,
    terms: EscapeTerms,
    room: LegRoom,
    near: TooNear,
) -> int:
    """The first from an escape on that nothing known or quickly found out rules out, so far from
    what nobody has seen; their number if there is none.

    Of a beginning that leads where nobody has looked no more loops are looked at: there are many.
    """
    e, escapes = escape, len(ways.begins)
    while e < escapes:
        begin = ways.begins[e]
        if seen[begin] == UNKNOWN:
            if begin >= begun.known[0]:
                _place_up_to(begin, ways, legs, begun, wind, terms)
            beyond = seen[ways.parent[begin]] == FAILS
            if beyond or not _is_clear(begun.placed[begin], unseen, terms):
                seen[begin] = FAILS
        if seen[begin] != FAILS and clear[begin] != FAILS:
            e = _first_loop_seen(e, ways, places, begun, wind, met, cleared, unseen, terms, near)
            if e == escapes:
                return escapes
            if ways.begins[e] == begin and _begin_was_seen(
                begin, unseen, ways, legs, begun, seen, terms, room
            ):
                return e
        while e < escapes and ways.begins[e] == begin:
            e += 1
    return escapes


@borrowing
def _first_clear(
    escape: int,
    ways: Ways,
    legs: Legs,
    places: FloatArray,
    begun: Begun,
    wind: FloatArray,
    met: Known,
    cleared: Known,
    clear: Known,
    seen: Known,
    terms: EscapeTerms,
    room: LegRoom,
    near: TooNear,
) -> int:
    """Likewise where what nobody has seen is free: by the returns near its places."""
    e, escapes = escape, len(ways.begins)
    while e < escapes:
        begin = ways.begins[e]
        if clear[begin] == UNKNOWN:
            if begin >= begun.known[0]:
                _place_up_to(begin, ways, legs, begun, wind, terms)
            pose, when = begun.poses[begin], begun.times_s[begin]
            beyond = clear[ways.parent[begin]] == FAILS
            if beyond or not _is_clear_of_returns(HERE, 0, 1, pose, when, terms, near):
                clear[begin] = FAILS
        if clear[begin] != FAILS:
            e = _first_loop_clear(e, ways, places, begun, met, cleared, terms, near)
            if e == escapes:
                return escapes
            if ways.begins[e] == begin and _begin_was_seen(
                begin, terms.unseen_m, ways, legs, begun, seen, terms, room
            ):
                return e
        while e < escapes and ways.begins[e] == begin:
            e += 1
    return escapes


@borrowing
def _first_loop_seen(
    escape: int,
    ways: Ways,
    places: FloatArray,
    begun: Begun,
    wind: FloatArray,
    met: Known,
    cleared: Known,
    unseen: float,
    terms: EscapeTerms,
    near: TooNear,
) -> int:
    """The first from an escape on, of those with its beginning, of whose loop nothing known rules
    out that it was seen, nor its places; the one after them if there is none."""
    free, window, begins = terms.free, terms.window, ways.begins
    begin, e = begins[escape], escape
    placed, pose, start_s = begun.placed[begin], begun.poses[begin], begun.times_s[begin]
    in_cells, within_m = near.looked[0] == FILLED, NEARLY * terms.margin_m
    x, y, z, cosine, sine = placed[0], placed[1], placed[2], placed[3], placed[4]
    while e < len(begins) and begins[e] == begin:
        if met[e] != FAILS and cleared[e] != FAILS:
            loop = ways.loop[e]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            if met[e] == UNKNOWN:
                met[e] = KEEPS  # What fails without a radius fails at any distance.
                for n in range(first, last):
                    ahead, left, when = places[n, 0], places[n, 1], places[n, 3]
                    east = x + cosine * ahead - sine * left + wind[0] * when
                    north = y + sine * ahead + cosine * left + wind[1] * when
                    up = z + places[n, 2] + wind[2] * when
                    if not is_place_free(free, window, east, north, up):
                        met[e] = FAILS
                        break
            if (
                met[e] == KEEPS
                and in_cells
                and are_near(places, first, last, pose, start_s, within_m, terms.wind_mps, near)
            ):
                cleared[e] = FAILS
            elif met[e] == KEEPS and places_were_seen(
                places, first, last, placed, wind, NEARLY * unseen, free, window
            ):
                return e
        e += 1
    return e


@borrowing
def _first_loop_clear(
    escape: int,
    ways: Ways,
    places: FloatArray,
    begun: Begun,
    met: Known,
    cleared: Known,
    terms: EscapeTerms,
    near: TooNear,
) -> int:
    """Likewise, that it keeps clear of returns."""
    begins = ways.begins
    begin, e = begins[escape], escape
    pose, when = begun.poses[begin], begun.times_s[begin]
    while e < len(begins) and begins[e] == begin:
        if met[e] == UNKNOWN and cleared[e] != FAILS:
            loop = ways.loop[e]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            is_clear = _is_clear_of_returns(places, first, last, pose, when, terms, near)
            met[e] = KEEPS if is_clear else FAILS
        if met[e] == KEEPS and cleared[e] != FAILS:
            return e
        e += 1
    return e


@borrowing
def _is_clear_of_returns(
    places: FloatArray,
    first: int,
    last: int,
    pose: FloatArray,
    start_s: float,
    terms: EscapeTerms,
    near: TooNear,
) -> bool:
    """As `places_are_clear`, in cells once that has been asked often."""
    if near.looked[0] != FILLED and near.margin_m > 0.0:
        near.looked[0] += len(terms.bins.radius_m) + ASKED
        if near.looked[0] > LONG:
            fill_in(near, terms)
    if near.looked[0] == FILLED:
        within_m = NEARLY * terms.margin_m
        near_one = are_near(places, first, last, pose, start_s, within_m, terms.wind_mps, near)
        if near_one or last - first == 1:
            return not near_one  # Of a beginning no more is asked here: its movements tell.
    return places_are_clear(places, first, last, pose, start_s, terms)


@borrowing
def _place_up_to(
    begin: int, ways: Ways, legs: Legs, begun: Begun, wind: FloatArray, terms: EscapeTerms
) -> None:
    """Fill in where beginnings up to one lead; those before them come first."""
    poses, times, placed = begun.poses, begun.times_s, begun.placed
    ox, oy, oz = terms.origin_m[0], terms.origin_m[1], terms.origin_m[2]
    cos_yaw, sin_yaw = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    end = legs.path.shape[2] - 1
    for b in range(begun.known[0], begin + 1):
        parent, m = ways.parent[b], ways.movement[b]
        at = ways.attitude[parent]
        x, y, z, yaw = poses[parent, 0], poses[parent, 1], poses[parent, 2], poses[parent, 3]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        ahead, left = legs.path[at, m, end, 0], legs.path[at, m, end, 1]
        x = x + cosine * ahead - sine * left
        y = y + sine * ahead + cosine * left
        z = z + legs.path[at, m, end, 2]
        yaw = yaw + legs.path[at, m, end, 3]
        poses[b, 0], poses[b, 1], poses[b, 2], poses[b, 3] = x, y, z, yaw
        times[b] = times[parent] + legs.duration_s[m]
        when = times[b]
        placed[b, 0] = ox + cos_yaw * x - sin_yaw * y + wind[0] * when
        placed[b, 1] = oy + sin_yaw * x + cos_yaw * y + wind[1] * when
        placed[b, 2] = oz + z + wind[2] * when
        placed[b, 3] = np.cos(terms.yaw_rad + yaw)
        placed[b, 4] = np.sin(terms.yaw_rad + yaw)
    begun.known[0] = begin + 1


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
    begun: Begun,
    seen: Known,
    terms: EscapeTerms,
    room: LegRoom,
) -> bool:
    """Whether a beginning may be flown, and leads through seen space where that is asked for."""
    poses, times = begun.poses, begun.times_s
    for n in range(_note_up_to(begin, ways, seen, begun.up) - 1, -1, -1):
        b = begun.up[n]
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
    begun: Begun,
    clear: Known,
    terms: EscapeTerms,
    room: LegRoom,
) -> bool:
    """Whether a beginning keeps the margin."""
    poses, times = begun.poses, begun.times_s
    for n in range(_note_up_to(begin, ways, clear, begun.up) - 1, -1, -1):
        b = begun.up[n]
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
