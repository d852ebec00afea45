"""Chains of movements checked against all that is known, and how far from intruders they lead."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.clearance import Span, moving_clearance, reach_about
from clearway.avoidance.escape.legs import (
    EscapeTerms,
    LegRoom,
    lay_out_leg,
    leg_keeps_margin,
    leg_room,
    leg_unseen_m,
    pose_after,
    turn_to_grid,
)
from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.reach.escapes.legs import Legs


class Chain(NamedTuple):
    """Where each of some movements, flown one after the other, begins; room for more."""

    poses: Floats2
    """[n + 1, 4]"""
    times_s: Floats
    """[n + 1]"""
    at: Ints
    """[n + 1] attitudes."""
    leg: LegRoom


@compiled
def chain_for(movements: int, legs: Legs, shapes: Shapes) -> Chain:
    """Room for so many movements among shapes."""
    times, at = np.empty(movements + 1), np.empty(movements + 1, dtype=np.int64)
    leg = leg_room(legs.path.shape[2], shapes)
    return Chain(np.empty((movements + 1, 4)), times, at, leg)


@compiled
def chain_keeps(
    movements: Ints,
    start: int,
    pose: Floats,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
) -> bool:
    """Whether movements one after the other are safe, from an attitude and a pose [4].

    What is quick to find out is looked at first: most chains fail in unobserved space.
    """
    chain = chain_for(len(movements), legs, terms.shapes)
    if not may_be_flown(movements, start, pose, start_s, legs, chain):
        return False
    about = (movements, legs, terms.unseen_m, terms, chain, terms.unobserved_m)
    if terms.must_see and chain_unseen_m(*about) > terms.unobserved_m:
        return False
    return chain_keeps_margin(movements, legs, terms, chain)


@compiled
def chain_unseen_m(
    movements: Ints, legs: Legs, unseen: float, terms: EscapeTerms, chain: Chain, most: float
) -> float:
    """Metres of a chain that lead through unobserved space, or nearer to that; inf where these are
    more than `most`."""
    spent = 0.0
    for turn in range(len(movements)):
        n = _far_first(turn, len(movements))
        m, at, when = movements[n], chain.at[n], (chain.times_s[n], chain.times_s[n + 1])
        sagitta = legs.sagitta_m[at, m]
        pose, path, left = chain.poses[n], legs.path[at, m], most - spent
        spent += leg_unseen_m(pose, path, sagitta, when, unseen, terms, chain.leg, left)
        if spent > most:
            return np.inf
    return spent


@compiled
def measure_unobserved(
    movements: Ints, start: int, pose: Floats, start_s: float, legs: Legs, terms: EscapeTerms
) -> float:
    """Metres of movements one after the other, from an attitude and a pose [4], about which nobody
    has seen the body's tube to be free."""
    chain = chain_for(len(movements), legs, terms.shapes)
    if not may_be_flown(movements, start, pose, start_s, legs, chain):
        return np.inf
    return chain_unseen_m(movements, legs, terms.unseen_m, terms, chain, np.inf)


@compiled
def chain_keeps_margin(movements: Ints, legs: Legs, terms: EscapeTerms, chain: Chain) -> bool:
    """Whether all movements of a chain keep the margin."""
    for turn in range(len(movements)):
        n = _far_first(turn, len(movements))
        m, at, when = movements[n], chain.at[n], (chain.times_s[n], chain.times_s[n + 1])
        sagitta = legs.sagitta_m[at, m]
        if not leg_keeps_margin(chain.poses[n], legs.path[at, m], sagitta, when, terms, chain.leg):
            return False
    return True


@compiled
def may_be_flown(
    movements: Ints, start: int, pose: Floats, start_s: float, legs: Legs, chain: Chain
) -> bool:
    """Whether movements may follow each other; fills in where and when each begins."""
    poses, times, at = chain.poses, chain.times_s, chain.at
    for axis in range(4):
        poses[0, axis] = pose[axis]
    times[0], at[0] = start_s, start
    for n in range(len(movements)):
        m = movements[n]
        at[n + 1], times[n + 1] = legs.following[at[n], m], times[n] + legs.duration_s[m]
        if at[n + 1] < 0:
            return False
        step_on(poses, n, legs.path[at[n], m])
    return True


@compiled
def _far_first(turn: int, count: int) -> int:
    """Which of so many movements is looked at in its turn: those half way along come first, each
    time, since most chains are loops, and fail there."""
    stride = max(1, count // 4)
    begins = 0
    while turn >= (count - begins + stride - 1) // stride:
        turn -= (count - begins + stride - 1) // stride
        begins += 1
    return (count // 2 + begins + turn * stride) % count


@compiled
def chain_corners(
    movements: Ints,
    start: int,
    pose: Floats,
    start_s: float,
    legs: Legs,
    wind: Floats,
) -> Floats2:
    """[movements x samples, 3] places along movements one after the other, level frame.

    wind: [3] likewise.
    """
    samples, at = legs.path.shape[2], start
    places, corners = np.empty((len(movements) * samples, 3)), np.empty((samples + 1, 3))
    for n in range(len(movements)):
        m = movements[n]
        path, times = legs.path[at, m], (start_s, start_s + legs.duration_s[m])
        lay_out_leg(pose, path, times, wind, corners)
        places[n * samples : (n + 1) * samples] = corners[1:]
        pose, at, start_s = pose_after(pose, path), legs.following[at, m], times[1]
    return places


@compiled
def rounds(loop: Ints, legs: Legs, least_s: float) -> Ints:
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
def step_on(poses: Floats2, n: int, path: Floats2) -> None:
    """Fill in the pose after the one numbered `n`."""
    cosine, sine = np.cos(poses[n, 3]), np.sin(poses[n, 3])
    last = len(path) - 1
    poses[n + 1, 0] = poses[n, 0] + cosine * path[last, 0] - sine * path[last, 1]
    poses[n + 1, 1] = poses[n, 1] + sine * path[last, 0] + cosine * path[last, 1]
    poses[n + 1, 2] = poses[n, 2] + path[last, 2]
    poses[n + 1, 3] = poses[n, 3] + path[last, 3]


@compiled
def chain_room(
    movements: Ints,
    start: int,
    pose: Floats,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
    enough: float,
    stop: float,
) -> float:
    """Smallest distance from intruders at equal times along movements, no more than `enough`.

    Where it is not above `stop`, only that counts. What comes last is looked at first: intruders
    grow with time, so that most of what comes before need then not be looked at closely.
    """
    chain = chain_for(len(movements), legs, terms.shapes)
    if not may_be_flown(movements, start, pose, start_s, legs, chain):
        return -np.inf
    return _room_along(movements, legs, terms, enough, stop, chain)


@compiled
def _room_along(
    movements: Ints,
    legs: Legs,
    terms: EscapeTerms,
    enough: float,
    stop: float,
    chain: Chain,
) -> float:
    best, leg = enough, chain.leg
    for n in range(len(movements) - 1, -1, -1):
        m, at, when = movements[n], chain.at[n], (chain.times_s[n], chain.times_s[n + 1])
        lay_out_leg(chain.poses[n], legs.path[at, m], when, terms.wind_mps, leg.level_m)
        turn_to_grid(leg, terms.grid_from_level)
        span = Span(leg.grid_m, leg.middle_m, reach_about(leg.grid_m, leg.middle_m), *when)
        sagitta = legs.sagitta_m[at, m]
        found = moving_clearance(span, terms.moving, best + sagitta)
        if found[2] >= 0:
            best = min(best, found[0] - sagitta)
            if best <= stop:
                break
    return best
