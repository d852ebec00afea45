"""The first escape of a library that keeps what is asked: the compiled search of `way_out`."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.escape.beginnings import (
    FAILS,
    KEEPS,
    UNDECIDED,
    Begun,
    Tips,
    begin_at,
    begin_keeps_margin,
    begin_was_seen,
    lead_up_to,
    miss_beginning,
    place_beginning,
    put,
    wind_of,
)
from clearway.avoidance.escape.chains import (
    chain_for,
    chain_keeps_margin,
    chain_room,
    chain_unseen_m,
    may_be_flown,
    rounds,
)
from clearway.avoidance.escape.legs import EscapeTerms, LegRoom
from clearway.avoidance.escape.places import NEARLY, places_are_clear, places_were_seen
from clearway.avoidance.escape.too_near import ASKED, FILLED, LONG, TooNear, are_near, fill_in
from clearway.avoidance.escape.wide_space import (
    WideSpace,
    first_wide,
    look_at,
    steps_within,
)
from clearway.base.arrays import Floats, Floats2, Int8s, Ints
from clearway.base.compiled import compiled
from clearway.reach.escapes.legs import Legs
from clearway.reach.escapes.ways import Ways
from clearway.sensors.observed.seen_space import is_free, is_place_free

MOST_COMPARED = 6
"""Escapes of which the one with most room from intruders is taken."""
LONGEST = 32
"""Movements of a loop that there is room for from the beginning."""
FEW = 8
"""Loops that are checked against all that is known at once; of more, first against returns near
their places: most of those that fail then are found by these."""
HERE = np.zeros((1, 4))
"""No loop, but the place where it would begin."""


@compiled
def movements_of(ways: Ways, escape: int) -> Ints:
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
    places: Floats2,
    tips: Tips,
    start: int,
    pose: Floats,
    start_s: float,
    terms: EscapeTerms,
    aloof_m: Floats,
    near: TooNear,
    wide: WideSpace,
) -> tuple[int, float, float]:
    """The first escape that is safe from an attitude and a pose [4], its room from intruders, and
    the distance that it keeps from unobserved space.

    places: of the loops, by `loop_places`. aloof_m: distances to be kept from unobserved space, in
    place of that of the terms; a later one only where those before leave nothing. Among intruders
    the best of a few; -1 if none is safe.

    What is quick to find out is looked at first, and what does not depend on the distance once. Of
    beginnings with unobserved ends, no loop is looked at.
    """
    count, escapes = len(ways.parent), len(ways.begins)
    begun = begin_at(pose, start_s, tips, terms)
    wind, chain = wind_of(terms), chain_for(LONGEST, legs, terms.shapes)
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
        all_seen = terms.must_see and terms.unseen_places == 0
        if all_seen and not _is_clear(begun.placed[0], unseen, terms):
            continue  # All begin here.
        seen[0] = KEEPS
        begun.missing[:] = 0
        following = 0
        while following < escapes:
            asked = (following, ways, legs, places, begun, met, cleared, clear, seen)
            if terms.must_see:
                escape = _first_seen(*asked, wind, unseen, terms, chain.leg, near, wide)
            else:
                escape = _first_clear(*asked, terms, chain.leg, near)
            following = escape + 1
            if escape == escapes:
                break
            begin, loop = ways.begins[escape], ways.loop[escape]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            at, then, when = ways.attitude[begin], begun.poses[begin], begun.times_s[begin]
            tried += 1
            if tried > FEW:  # All loops of a beginning that keeps no margin are passed over.
                if not begin_keeps_margin(begin, ways, legs, begun, clear, terms, chain.leg):
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
            if terms.must_see:
                left = terms.unobserved_m - begun.spent_m[begin]
                if chain_unseen_m(movements, legs, unseen, terms, chain, left) > left:
                    continue
            if not begin_keeps_margin(begin, ways, legs, begun, clear, terms, chain.leg):
                continue
            if cleared[escape] == UNDECIDED:
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


@compiled
def _first_seen(
    escape: int,
    ways: Ways,
    legs: Legs,
    places: Floats2,
    begun: Begun,
    met: Int8s,
    cleared: Int8s,
    clear: Int8s,
    seen: Int8s,
    wind: Floats,
    unseen: float,
    terms: EscapeTerms,
    room: LegRoom,
    near: TooNear,
    wide: WideSpace,
) -> int:
    """The first from an escape on that nothing known or quickly found out rules out, so far from
    unobserved space; their number if there is none.

    Of a beginning that leads through unobserved space no more loops are looked at: there are many.
    """
    radius, escapes = NEARLY * unseen, len(ways.begins)
    e, steps = escape, steps_within(wide, radius, terms)
    while e < escapes:
        if steps >= 0:
            if begun.tips.known[0] < len(begun.posed):
                lead_up_to(len(begun.posed) - 1, ways, legs, begun.tips)
            looked_up = (met, cleared, clear, seen, radius, steps, wide, terms.seen)
            e = first_wide(e, ways, places, begun, wind, *looked_up)
            if e == escapes:
                break
        begin, first = ways.begins[e], e
        if steps < 0:  # Else `first_wide` has done both.
            place_beginning(begin, ways, legs, begun, wind)
            if seen[begin] == UNDECIDED:
                if seen[ways.parent[begin]] == FAILS:
                    seen[begin] = FAILS
                else:
                    missing = not _is_clear(begun.placed[begin], unseen, terms)
                    if miss_beginning(begin, ways, begun, missing):
                        seen[begin] = FAILS
        if seen[begin] != FAILS and clear[begin] != FAILS:
            until = e + 1 if steps >= 0 else escapes
            about = (begun, wind, met, cleared, unseen, terms, near)
            e = _first_loop_seen(e, until, ways, legs, places, *about)
            if e < until and ways.begins[e] == begin:
                if begin_was_seen(begin, unseen, ways, legs, begun, seen, terms, room):
                    return e
            elif steps >= 0:
                continue
        while e < escapes and ways.begins[e] == begin:
            e += 1
        if look_at(wide, e - first, terms):
            steps = steps_within(wide, radius, terms)
    return escapes


@compiled
def _first_clear(
    escape: int,
    ways: Ways,
    legs: Legs,
    places: Floats2,
    begun: Begun,
    met: Int8s,
    cleared: Int8s,
    clear: Int8s,
    seen: Int8s,
    terms: EscapeTerms,
    room: LegRoom,
    near: TooNear,
) -> int:
    """Likewise where unobserved space is free: by the returns near its places."""
    e, escapes = escape, len(ways.begins)
    while e < escapes:
        begin = ways.begins[e]
        if clear[begin] == UNDECIDED:
            if begun.posed[begin] == UNDECIDED:
                put(begin, ways, legs, begun)
            then, when = begun.poses[begin], begun.times_s[begin]
            beyond = clear[ways.parent[begin]] == FAILS
            if beyond or not _is_clear_of_returns(HERE, 0, 1, then, when, terms, near):
                clear[begin] = FAILS
        if clear[begin] != FAILS:
            e = _first_loop_clear(e, ways, places, begun, met, cleared, terms, near)
            if e == escapes:
                return escapes
            if ways.begins[e] == begin and begin_was_seen(
                begin, terms.unseen_m, ways, legs, begun, seen, terms, room
            ):
                return e
        while e < escapes and ways.begins[e] == begin:
            e += 1
    return escapes


@compiled
def _first_loop_seen(
    escape: int,
    until: int,
    ways: Ways,
    legs: Legs,
    places: Floats2,
    begun: Begun,
    wind: Floats,
    met: Int8s,
    cleared: Int8s,
    unseen: float,
    terms: EscapeTerms,
    near: TooNear,
) -> int:
    """The first from an escape on, of those with its beginning and before another, of whose loop
    nothing known rules out that it was seen, nor its places; the one after them if there is
    none."""
    space, begins = terms.seen, ways.begins
    begin, e = begins[escape], escape
    in_cells, within_m = near.looked[0] == FILLED, NEARLY * terms.margin_m
    most = begun.most_missing - begun.missing[begin]
    if in_cells and begun.posed[begin] == UNDECIDED:
        put(begin, ways, legs, begun)
    placed, pose, start_s = begun.placed[begin], begun.poses[begin], begun.times_s[begin]
    x, y, z, cosine, sine = placed[0], placed[1], placed[2], placed[3], placed[4]
    while e < until and begins[e] == begin:
        if met[e] != FAILS and cleared[e] != FAILS:
            loop = ways.loop[e]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            if met[e] == UNDECIDED:
                met[e] = KEEPS  # What fails without a radius fails at any distance.
                missing = most
                for n in range(first, last if space.window[14] == 0.0 else first):
                    ahead, left, when = places[n, 0], places[n, 1], places[n, 3]
                    east = x + cosine * ahead - sine * left + wind[0] * when
                    north = y + sine * ahead + cosine * left + wind[1] * when
                    up = z + places[n, 2] + wind[2] * when
                    if not is_place_free(space, east, north, up):
                        missing -= 1
                        if missing < 0:
                            met[e] = FAILS
                            break
            if (
                met[e] == KEEPS
                and in_cells
                and are_near(places, first, last, pose, start_s, within_m, terms.wind_mps, near)
            ):
                cleared[e] = FAILS
            elif met[e] == KEEPS and places_were_seen(
                places, first, last, placed, wind, NEARLY * unseen, most, space
            ):
                return e
        e += 1
    return e


@compiled
def _first_loop_clear(
    escape: int,
    ways: Ways,
    places: Floats2,
    begun: Begun,
    met: Int8s,
    cleared: Int8s,
    terms: EscapeTerms,
    near: TooNear,
) -> int:
    """Likewise, that it keeps clear of returns."""
    begins = ways.begins
    begin, e = begins[escape], escape
    pose, when = begun.poses[begin], begun.times_s[begin]
    while e < len(begins) and begins[e] == begin:
        if met[e] == UNDECIDED and cleared[e] != FAILS:
            loop = ways.loop[e]
            first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
            is_clear = _is_clear_of_returns(places, first, last, pose, when, terms, near)
            met[e] = KEEPS if is_clear else FAILS
        if met[e] == KEEPS and cleared[e] != FAILS:
            return e
        e += 1
    return e


@compiled
def _is_clear_of_returns(
    places: Floats2,
    first: int,
    last: int,
    pose: Floats,
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


@compiled
def _is_clear(placed: Floats, unseen: float, terms: EscapeTerms) -> bool:
    """Whether about a place, by `place_pose`, so much was seen: quick to tell that what begins or
    ends there did not."""
    x, y, z = placed[0], placed[1], placed[2]
    return is_free(terms.seen, x, y, z, NEARLY * unseen)
