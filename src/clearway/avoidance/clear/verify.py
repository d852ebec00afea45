"""Verification of candidate trajectories against the inflated evidence itself.

Cells alone are too coarse to keep a margin: each movement of a reach set is checked against every
hit point and map shape, and against every intruder at the same instant of time. Clearance is the
distance from the vehicle's centre to the surface of the evidence; a candidate passes where its
clearance is at least the margin all along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.clearance import Found, Span, reach_about
from clearway.avoidance.clear.crowds import Crowd, crowd_of, span_clearance
from clearway.avoidance.clear.hazards import Cause, Hazards, MovingHazards, PointBins
from clearway.avoidance.clear.loiter import LoiterCircles, early_room, room_to_brake, room_to_circle
from clearway.base.arrays import Floats, Floats2, Floats3, Int32s, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Shapes
from clearway.reach.tree import ReachSet

KEPT = 1.0 - 1e-9
"""Share of the margin that keeps it: a clearance may lack as much as rounding takes."""
NEAR = 0.5
"""Share of its own reach within which a path's clearance is looked for first, since most hazards
can then be passed over."""


class Paths(NamedTuple):
    """The part of a reach set that verification walks."""

    parent: Int32s
    samples_m: Floats3
    sagitta_m: Floats
    end_time_s: Floats

    def __repr__(self) -> str:
        return brief(self)


class MovementRoom(NamedTuple):
    """Where a movement at a time is laid out."""

    corners_m: Floats2
    """[samples + 1, 3]"""
    middle_m: Floats
    """[3]"""
    crowd: Crowd


def paths_of(reach_set: ReachSet, tube_m: FloatArray | None = None) -> Paths:
    """What verification needs of a reach set.

    tube_m: [nodes] within how far of its prediction the vehicle is on a movement (def. 13): so much
    clearance is lacking.
    """
    sagitta_m = reach_set.sagitta_m if tube_m is None else reach_set.sagitta_m + tube_m
    return Paths(reach_set.parent, reach_set.samples_m, sagitta_m, reach_set.end_time_s)


def sloping(paths: Paths, slope: float) -> Paths:
    """Paths that lack `slope` more clearance for every metre of distance from their start."""
    farthest = np.sqrt(np.einsum("nsi,nsi->ns", paths.samples_m, paths.samples_m)).max(axis=1)
    return paths._replace(sagitta_m=paths.sagitta_m + slope * farthest)


class Verification(NamedTuple):
    """Outcome for candidates in the order in which they were checked against the evidence."""

    chosen: int
    """Index of the first candidate that passes; -1 if none does."""
    blocked_at: Ints
    """[tried] node at which each candidate before the chosen one fails."""
    causes: Ints
    """[tried] `Cause` of that failure."""
    cause_index: Ints
    """[tried] which point, shape or intruder."""
    shortfall_m: Floats
    """[tried] clearance found there."""

    def __repr__(self) -> str:
        return brief(self)


class KnownClearances:
    """What was found of movements of some paths up to now, by what they were checked against: who
    asks again, or of other candidates, need not look at the same movement twice."""

    def __init__(self, paths: Paths) -> None:
        self.paths = paths
        self._known: dict[tuple[Hazards, float], FloatArray] = {}
        self.best: dict[tuple[Hazards, float, bytes], FloatArray] = {}
        """What `emergency.best_clearances` found, by hazards, margin and candidates."""

    def at(self, hazards: Hazards, margin_m: float) -> FloatArray:
        """[nodes, 3] (clearance, cause, index) of movements, exact below a margin; nan through
        unobserved space. The caller that looks fills it in."""
        key = hazards, margin_m
        if key not in self._known:
            self._known[key] = np.full((len(self.paths.parent), 3), np.nan)
        return self._known[key]


@dataclass(frozen=True, slots=True)
class Clearance:
    """Smallest distance from a path to the evidence, and what limits it."""

    distance_m: float
    cause: Cause
    index: int


def path_clearance(
    paths: Paths, node: int, hazards: Hazards, farthest_m: float | None = None
) -> Clearance:
    """Clearance of the whole path from the start to the end of `node`; inf without evidence.

    farthest_m: how far from the start it may come, where that is known.
    """
    near_m = NEAR * (_farthest_m(paths, node) if farthest_m is None else farthest_m)
    distance, cause, index = _path_clearance(
        paths, node, hazards.bins, hazards.shapes, hazards.moving, near_m
    )
    if cause == Cause.NOTHING:
        distance, cause, index = _path_clearance(
            paths, node, hazards.bins, hazards.shapes, hazards.moving, np.inf
        )
    return Clearance(distance, Cause(cause), index)


def nearest_within(
    paths: Paths, node: int, points: PointBins, hazards: Hazards, within_m: float
) -> Found:
    """Clearance of the path to the end of `node` from shapes and what moves of some hazards, and
    from points instead of theirs; `within_m` without any cause where nothing is nearer."""
    return _path_clearance(paths, node, points, hazards.shapes, hazards.moving, within_m)


def _farthest_m(paths: Paths, node: int) -> float:
    """How far from the start the path to the end of `node` may come."""
    farthest = 0.0
    while node >= 0:
        samples = paths.samples_m[node]
        away = float(np.sqrt(np.einsum("si,si->s", samples, samples).max()))
        farthest = max(farthest, away + float(paths.sagitta_m[node]))
        node = int(paths.parent[node])
    return farthest


def clearances(paths: Paths, hazards: Hazards, cap_m: float) -> FloatArray:
    """[nodes, 2] smallest clearance along the path to each node, and clearance lacking to `cap_m`
    summed over its movements: the measure of how bad a path is where none is good."""
    return _clearances(paths, hazards.bins, hazards.shapes, hazards.moving, cap_m)


@compiled
def movement_room(paths: Paths, shapes: Shapes) -> MovementRoom:
    """For one movement at a time."""
    corners = np.empty((paths.samples_m.shape[1] + 1, 3))
    return MovementRoom(corners, np.empty(3), crowd_of(shapes, len(corners)))


@compiled
def movement_clearance(
    paths: Paths,
    n: int,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    enough: float,
    stop: float,
    room: MovementRoom,
) -> Found:
    """Clearance of one movement, exact where it is below `enough` and not below `stop`."""
    samples, corners = paths.samples_m, room.corners_m
    count, parent, start_s = samples.shape[1], paths.parent[n], 0.0
    if parent >= 0:
        start_s = paths.end_time_s[parent]
    for axis in range(3):
        corners[0, axis] = samples[parent, count - 1, axis] if parent >= 0 else 0.0
        for q in range(count):
            corners[q + 1, axis] = samples[n, q, axis]
    reach = reach_about(corners, room.middle_m)
    span = Span(corners, room.middle_m, reach, start_s, paths.end_time_s[n])
    sagitta = paths.sagitta_m[n]
    distance, cause, index = span_clearance(
        span, bins, shapes, moving, room.crowd, enough + sagitta, stop + sagitta
    )
    return distance - sagitta, cause, index


@compiled
def _keeps(
    paths: Paths,
    path: Ints,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    known: Floats2,
    room: MovementRoom,
) -> tuple[int, int, int, float]:
    """Where a path first lacks the margin: (node or -1, cause, index, clearance there).

    path: its nodes, the first movement last. known: [nodes, 3] (clearance, cause, index) of
    movements looked at before, nan elsewhere; filled in, since paths share their first movements.
    """
    for at in range(len(path) - 1, -1, -1):
        n = path[at]
        if np.isnan(known[n, 0]):
            found = movement_clearance(paths, n, bins, shapes, moving, margin, -np.inf, room)
            known[n, 0], known[n, 1], known[n, 2] = found
        # What is not a number keeps no margin.
        if not known[n, 0] >= KEPT * margin:
            return n, int(known[n, 1]), int(known[n, 2]), known[n, 0]
    return -1, 0, -1, margin


@compiled
def _way_to(paths: Paths, end: int, path: Ints) -> Ints:
    """The nodes from `end` back to the first movement, written into the start of `path`."""
    steps, n = 0, end
    while n >= 0:
        path[steps] = n
        steps += 1
        n = paths.parent[n]
    return path[:steps]


@compiled
def first_clear_of(
    paths: Paths,
    candidates: Ints,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    loiter: LoiterCircles,
    cost: Floats,
    price: Floats,
    known: Floats2,
) -> Verification:
    """The first of `candidates` (nodes, best first) that keeps the margin, and why not others.

    With a loiter, a trajectory out through the side must also leave room to circle at its end.
    cost: [candidates] what they cost otherwise, ascending. price: [candidates] what it
    costs to have no room to circle early on the way: such a one is taken only where all that have
    it cost as much more, since what is entered without room to turn round may be a dead end; 0 for
    those that need none. known: of the same hazards and margin, by `KnownClearances.at`.
    """
    nodes, tried = len(paths.parent), len(candidates)
    circling = np.full((nodes, 3), np.nan)
    room = movement_room(paths, shapes)
    blocked_at = np.full(tried, -1, dtype=np.int64)
    causes = np.zeros(tried, dtype=np.int64)
    cause_index = np.full(tried, -1, dtype=np.int64)
    shortfall = np.zeros(tried)
    steps = np.empty(nodes, dtype=np.int64)
    chosen = -1
    for c in range(tried):
        if chosen >= 0 and cost[c] >= cost[chosen] + price[chosen]:
            break
        end = candidates[c]
        path = _way_to(paths, end, steps)
        at, cause, index, found = _keeps(paths, path, bins, shapes, moving, margin, known, room)
        if at < 0 and loiter.radius_m > 0.0:
            if loiter.needed[end]:
                found, cause, index = room_to_circle(loiter, end, bins, shapes, margin)
                at = end if found < KEPT * margin else -1
            if at < 0 and price[c] > 0.0:
                found, cause, index = early_room(loiter, path, bins, shapes, margin, circling)
                if found < KEPT * margin:
                    at = path[-1]
                    chosen = c if chosen < 0 else chosen
        if at < 0 and loiter.brakes and price[c] > 0.0:
            found, cause, index = room_to_brake(loiter, end, bins, shapes, margin)
            if found < KEPT * margin:
                at = end
                chosen = c if chosen < 0 else chosen
        if at < 0:
            chosen = c
            break
        blocked_at[c], causes[c], cause_index[c], shortfall[c] = at, cause, index, found
    told = tried if chosen < 0 else chosen
    return Verification(
        chosen, blocked_at[:told], causes[:told], cause_index[:told], shortfall[:told]
    )


@compiled
def _path_clearance(
    paths: Paths, node: int, bins: PointBins, shapes: Shapes, moving: MovingHazards, enough: float
) -> Found:
    best, room = (enough, 0, -1), movement_room(paths, shapes)
    n = node
    while n >= 0:
        found = movement_clearance(paths, n, bins, shapes, moving, best[0], -np.inf, room)
        if found[1] != 0 and found[0] < best[0]:
            best = found
        n = paths.parent[n]
    return best


@compiled
def _clearances(
    paths: Paths, bins: PointBins, shapes: Shapes, moving: MovingHazards, cap: float
) -> Floats2:
    result, room = np.empty((len(paths.parent), 2)), movement_room(paths, shapes)
    _note_clearances(paths, bins, shapes, moving, cap, room, result)
    return result


@compiled
def _note_clearances(
    paths: Paths,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    cap: float,
    room: MovementRoom,
    result: Floats2,
) -> None:
    for n in range(len(paths.parent)):
        found = movement_clearance(paths, n, bins, shapes, moving, cap, -np.inf, room)
        distance = min(found[0], cap)
        before, lacking = cap, 0.0
        if paths.parent[n] >= 0:
            before, lacking = result[paths.parent[n], 0], result[paths.parent[n], 1]
        result[n, 0] = min(before, distance)
        result[n, 1] = lacking + (cap - distance)
