"""Beginnings of escapes: where each leads, and whether it keeps what is asked; found out one by
one, as a search comes to them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.avoidance.escape.legs import EscapeTerms, LegRoom, leg_keeps_margin, leg_unseen_m
from clearway.base.arrays import Floats, Floats2, Int8s, Ints
from clearway.base.compiled import compiled
from clearway.reach.escapes.legs import Legs
from clearway.reach.escapes.ways import Ways

UNDECIDED = 0
KEEPS = 1
FAILS = 2
Known = npt.NDArray[np.int8]
"""Of each, whether it is UNKNOWN, KEEPS what is asked, or FAILS."""


class Tips(NamedTuple):
    """Where beginnings lead from a start at yaw 0, for places to be looked up: it stays the same
    from decision to decision, and is filled in as far as any asked."""

    places: Floats2
    """[beginnings, 6] place at its end in still air, cosine and sine of the yaw, and when."""
    known: Ints
    """[1] the first so many are filled in."""


def tips_of(ways: Ways) -> Tips:
    """Nothing but where they start."""
    places = np.zeros((len(ways.parent), 6))
    places[0, 3] = 1.0
    return Tips(places, np.ones(1, dtype=np.int64))


class Begun(NamedTuple):
    """Where beginnings lead from one start, each as soon as it is asked for."""

    poses: Floats2
    """[beginnings, 4] at their ends, in still air: what is verified begins there."""
    times_s: Floats
    """[beginnings]"""
    posed: Int8s
    """[beginnings] whether the two are known."""
    placed: Floats2
    """[beginnings, 5] by `place_pose`, but for rounding: to look places up."""
    up: Ints
    """[beginnings] room for those before one."""
    tips: Tips
    missing: Ints
    """[beginnings] ends of movements up to its own that were not seen, as far as was looked."""
    most_missing: int
    """So many may be."""
    spent_m: Floats
    """[beginnings] metres of it that lead through unobserved space, once that was found out."""


@compiled
def begin_at(pose: Floats, start_s: float, tips: Tips, terms: EscapeTerms) -> Begun:
    """The empty beginning, and room for the others."""
    count = len(tips.places)
    poses, times, posed = np.empty((count, 4)), np.empty(count), np.zeros(count, dtype=np.int8)
    placed = np.empty((count, 5))
    poses[0], times[0], posed[0], placed[0] = pose, start_s, KEEPS, place_pose(pose, start_s, terms)
    up, missing = np.empty(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    most, spent = terms.unseen_places, np.zeros(count)
    return Begun(poses, times, posed, placed, up, tips, missing, most, spent)


@compiled
def miss_beginning(begin: int, ways: Ways, begun: Begun, is_missing: bool) -> bool:
    """Note whether a beginning's end was not seen; returns whether too many up to it were not."""
    before = begun.missing[ways.parent[begin]]
    begun.missing[begin] = before + 1 if is_missing else before
    return bool(begun.missing[begin] > begun.most_missing)


@compiled
def wind_of(terms: EscapeTerms) -> Floats:
    """[3] in the world; the terms have it in the level frame."""
    cosine, sine = np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    level, wind = terms.wind_mps, np.empty(3)
    wind[0] = cosine * level[0] - sine * level[1]
    wind[1] = sine * level[0] + cosine * level[1]
    wind[2] = level[2]
    return wind


@compiled
def place_pose(pose: Floats, start_s: float, terms: EscapeTerms) -> Floats:
    """[5] world place of a pose at a time, cosine and sine of its yaw."""
    yaw, origin, placed = terms.yaw_rad, terms.origin_m, np.empty(5)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    placed[0] = origin[0] + cosine * pose[0] - sine * pose[1]
    placed[1] = origin[1] + sine * pose[0] + cosine * pose[1]
    placed[2] = origin[2] + pose[2]
    placed[:3] += start_s * wind_of(terms)
    placed[3], placed[4] = np.cos(yaw + pose[3]), np.sin(yaw + pose[3])
    return placed


@compiled
def place_beginning(begin: int, ways: Ways, legs: Legs, begun: Begun, wind: Floats) -> None:
    """Fill in where a beginning is placed."""
    tips, placed = begun.tips.places, begun.placed
    if begin >= begun.tips.known[0]:
        lead_up_to(begin, ways, legs, begun.tips)
    cosine, sine, when = placed[0, 3], placed[0, 4], tips[begin, 5]
    ahead, left, cos_yaw, sin_yaw = tips[begin, 0], tips[begin, 1], tips[begin, 3], tips[begin, 4]
    placed[begin, 0] = placed[0, 0] + cosine * ahead - sine * left + wind[0] * when
    placed[begin, 1] = placed[0, 1] + sine * ahead + cosine * left + wind[1] * when
    placed[begin, 2] = placed[0, 2] + tips[begin, 2] + wind[2] * when
    placed[begin, 3] = cosine * cos_yaw - sine * sin_yaw
    placed[begin, 4] = sine * cos_yaw + cosine * sin_yaw


@compiled
def lead_up_to(begin: int, ways: Ways, legs: Legs, tips: Tips) -> None:
    """Fill in where beginnings up to one lead; those before them come first."""
    places, end = tips.places, legs.path.shape[2] - 1
    for b in range(tips.known[0], begin + 1):
        parent, m = ways.parent[b], ways.movement[b]
        at = ways.attitude[parent]
        ahead, left, up = (
            legs.path[at, m, end, 0],
            legs.path[at, m, end, 1],
            legs.path[at, m, end, 2],
        )
        cosine, sine = places[parent, 3], places[parent, 4]
        cos_turn, sin_turn = np.cos(legs.path[at, m, end, 3]), np.sin(legs.path[at, m, end, 3])
        places[b, 0] = places[parent, 0] + cosine * ahead - sine * left
        places[b, 1] = places[parent, 1] + sine * ahead + cosine * left
        places[b, 2] = places[parent, 2] + up
        places[b, 3] = cosine * cos_turn - sine * sin_turn
        places[b, 4] = sine * cos_turn + cosine * sin_turn
        places[b, 5] = places[parent, 5] + legs.duration_s[m]
    tips.known[0] = begin + 1


@compiled
def put(begin: int, ways: Ways, legs: Legs, begun: Begun) -> None:
    """Fill in to what pose a beginning leads, and when, and those before it."""
    poses, times, posed, up = begun.poses, begun.times_s, begun.posed, begun.up
    end, count, before = legs.path.shape[2] - 1, 0, begin
    # `_note_up_to`, written out: the call takes a sixth of a search among a thousand shapes.
    while posed[before] == UNDECIDED:
        up[count] = before
        count += 1
        before = ways.parent[before]
    for n in range(count - 1, -1, -1):
        b = up[n]
        parent, m = ways.parent[b], ways.movement[b]
        at = ways.attitude[parent]
        x, y, z, yaw = poses[parent, 0], poses[parent, 1], poses[parent, 2], poses[parent, 3]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        ahead, left = legs.path[at, m, end, 0], legs.path[at, m, end, 1]
        poses[b, 0] = x + cosine * ahead - sine * left
        poses[b, 1] = y + sine * ahead + cosine * left
        poses[b, 2] = z + legs.path[at, m, end, 2]
        poses[b, 3] = yaw + legs.path[at, m, end, 3]
        times[b] = times[parent] + legs.duration_s[m]
        posed[b] = KEEPS


@compiled
def begin_was_seen(
    begin: int,
    unseen: float,
    ways: Ways,
    legs: Legs,
    begun: Begun,
    seen: Int8s,
    terms: EscapeTerms,
    room: LegRoom,
) -> bool:
    """Whether a beginning may be flown, and leads through seen space where that is asked for, but
    for as many metres as may lead elsewhere."""
    poses, times = begun.poses, begun.times_s
    if begun.posed[begin] == UNDECIDED:
        put(begin, ways, legs, begun)
    for n in range(_note_up_to(begin, ways, seen, begun.up) - 1, -1, -1):
        b = begun.up[n]
        parent, m = ways.parent[b], ways.movement[b]
        at, when = ways.attitude[parent], (times[parent], times[b])
        good = seen[parent] == KEEPS and legs.following[at, m] >= 0
        if good and terms.must_see:
            path, sagitta = legs.path[at, m], legs.sagitta_m[at, m]
            left = terms.unobserved_m - begun.spent_m[parent]
            spent = leg_unseen_m(poses[parent], path, sagitta, when, unseen, terms, room, left)
            begun.spent_m[b], good = begun.spent_m[parent] + spent, spent <= left
        seen[b] = KEEPS if good else FAILS
    return bool(seen[begin] == KEEPS)


@compiled
def begin_keeps_margin(
    begin: int,
    ways: Ways,
    legs: Legs,
    begun: Begun,
    clear: Int8s,
    terms: EscapeTerms,
    room: LegRoom,
) -> bool:
    """Whether a beginning keeps the margin."""
    poses, times = begun.poses, begun.times_s
    if begun.posed[begin] == UNDECIDED:
        put(begin, ways, legs, begun)
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


@compiled
def _note_up_to(begin: int, ways: Ways, state: Int8s, up: Ints) -> int:
    """Fill in a beginning and those before it of which nothing is known yet, the first one last;
    returns how many."""
    count, b = 0, begin
    while state[b] == UNDECIDED:
        up[count] = b
        count += 1
        b = ways.parent[b]
    return count
