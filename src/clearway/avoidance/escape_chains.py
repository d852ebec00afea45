"""Chains of movements held against all that is known, and how far from intruders they lead."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clearance import moving_clearance, span_of
from clearway.avoidance.escape_legs import (
    EscapeTerms,
    carried,
    leg_keeps_margin,
    leg_was_seen,
    pose_after,
)
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.escapes import Legs


@borrowing
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
    if terms.must_see and not chain_was_seen(movements, start, pose, start_s, legs, unseen, terms):
        return False
    return chain_keeps_margin(movements, start, pose, start_s, legs, terms)


@compiled
def chain_was_seen(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    unseen: float,
    terms: EscapeTerms,
) -> bool:
    """Whether all movements may be flown, through seen space, so far from the unseen."""
    count = len(movements)
    poses, times = np.empty((count + 1, 4)), np.empty(count + 1)
    at = np.empty(count + 1, dtype=np.int64)
    poses[0], times[0], at[0] = pose, start_s, start
    if not _may_be_flown(movements, legs, poses, times, at):
        return False
    for turn in range(count):
        n = _far_first(turn, count)
        m, when = movements[n], (times[n], times[n + 1])
        path, sagitta = legs.path[at[n], m], legs.sagitta_m[at[n], m]
        if not leg_was_seen(poses[n], path, sagitta, when, unseen, terms):
            return False
    return True


@compiled
def chain_keeps_margin(
    movements: IntArray,
    start: int,
    pose: FloatArray,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
) -> bool:
    """Whether all movements may be flown, with the margin."""
    count = len(movements)
    poses, times = np.empty((count + 1, 4)), np.empty(count + 1)
    at = np.empty(count + 1, dtype=np.int64)
    poses[0], times[0], at[0] = pose, start_s, start
    if not _may_be_flown(movements, legs, poses, times, at):
        return False
    for turn in range(count):
        n = _far_first(turn, count)
        m, when = movements[n], (times[n], times[n + 1])
        path, sagitta = legs.path[at[n], m], legs.sagitta_m[at[n], m]
        if not leg_keeps_margin(poses[n], path, sagitta, when, terms):
            return False
    return True


@borrowing
def _may_be_flown(
    movements: IntArray, legs: Legs, poses: FloatArray, times: FloatArray, at: IntArray
) -> bool:
    """Whether movements may follow each other; fills in poses, times and attitudes after each."""
    for n in range(len(movements)):
        m = movements[n]
        at[n + 1], times[n + 1] = legs.following[at[n], m], times[n] + legs.duration_s[m]
        if at[n + 1] < 0:
            return False
        step_on(poses, n, legs.path[at[n], m])
    return True


@borrowing
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


@borrowing
def step_on(poses: FloatArray, n: int, path: FloatArray) -> None:
    """Fill in the pose after the one numbered `n`."""
    cosine, sine = np.cos(poses[n, 3]), np.sin(poses[n, 3])
    last = len(path) - 1
    poses[n + 1, 0] = poses[n, 0] + cosine * path[last, 0] - sine * path[last, 1]
    poses[n + 1, 1] = poses[n, 1] + sine * path[last, 0] + cosine * path[last, 1]
    poses[n + 1, 2] = poses[n, 2] + path[last, 2]
    poses[n + 1, 3] = poses[n, 3] + path[last, 3]


@compiled
def chain_room(
    movements: IntArray,
    start: int,
    pose: FloatArray,
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
    count, best = len(movements), enough
    poses, times = np.empty((count + 1, 4)), np.empty(count + 1)
    at = np.empty(count + 1, dtype=np.int64)
    poses[0], times[0], at[0] = pose, start_s, start
    if not _may_be_flown(movements, legs, poses, times, at):
        return -np.inf
    for n in range(count - 1, -1, -1):
        m, when = movements[n], (times[n], times[n + 1])
        corners = carried(poses[n], legs.path[at[n], m], when, terms)
        turned = np.empty_like(corners)
        for s in range(len(corners)):
            for axis in range(3):
                turned[s, axis] = (
                    terms.grid_from_level[axis, 0] * corners[s, 0]
                    + terms.grid_from_level[axis, 1] * corners[s, 1]
                    + terms.grid_from_level[axis, 2] * corners[s, 2]
                )
        sagitta = legs.sagitta_m[at[n], m]
        found = moving_clearance(span_of(turned, *when), terms.moving, best + sagitta)
        if found[2] >= 0:
            best = min(best, found[0] - sagitta)
            if best <= stop:
                break
    return best
