"""Verification of candidate trajectories against the coated evidence itself.

Cells alone are too coarse to keep a margin: each movement of a reach set is held against every hit
point and map shape, and against every intruder at the same instant of time. Clearance is the
distance from the vehicle's centre to the surface of the evidence; a candidate passes where its
clearance is at least the margin all along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.clearance import Found, Span, circle_clearance, span_clearance, span_of
from clearway.compiled import compiled
from clearway.frames import FloatArray
from clearway.hazards import Cause, Hazards, MovingHazards, PointBins
from clearway.obstacles import Shapes
from clearway.reach.tree import SIDE, ReachSet
from clearway.state import BoolArray, IndexArray, IntArray

NEAR_M = 5.0
"""Clearances are looked for within it first, since most hazards can then be passed over."""


class Paths(NamedTuple):
    """The part of a reach set that verification walks."""

    parent: IndexArray
    samples_m: FloatArray
    sagitta_m: FloatArray
    end_time_s: FloatArray


class Refuge(NamedTuple):
    """Circles that a vehicle can hold at the end of trajectories that leave through the side.

    Such a trajectory ends near, possibly in a pocket: it is complete only if the vehicle could
    circle there, on one side or the other, for as long as it takes.
    """

    needed: BoolArray
    """[nodes] where a trajectory leaves through the side."""
    end_m: FloatArray
    """[nodes, 3] grid frame."""
    left: FloatArray
    """[nodes, 3] level unit vector to the left of the heading there, grid frame."""
    up: FloatArray
    """[3] vertical in the grid frame."""
    radius_m: float
    """Turning radius."""


def refuge_of(reach_set: ReachSet, turning_radius_m: float) -> Refuge:
    """Circles at the ends of a reach set's side exits; none for a vehicle that need not circle."""
    pitch = reach_set.start_pitch_rad
    yaw = reach_set.states[:, 5]
    across = -np.sin(yaw)
    left = np.stack([np.cos(pitch) * across, np.cos(yaw), np.sin(pitch) * across], axis=1)
    circles = np.isfinite(turning_radius_m) and turning_radius_m > 0.0
    return Refuge(
        np.equal(reach_set.exit_kind, SIDE) & circles,
        np.ascontiguousarray(reach_set.states[:, :3]),
        left,
        np.array([-np.sin(pitch), 0.0, np.cos(pitch)]),
        float(turning_radius_m) if circles else 0.0,
    )


def paths_of(reach_set: ReachSet) -> Paths:
    """What verification needs of a reach set."""
    return Paths(reach_set.parent, reach_set.samples_m, reach_set.sagitta_m, reach_set.end_time_s)


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """Outcome for candidates in the order in which they were held against the evidence."""

    chosen: int
    """Index of the first candidate that passes; -1 if none does."""
    blocked_at: IntArray
    """[tried] node at which each candidate before the chosen one fails."""
    causes: IntArray
    """[tried] `Cause` of that failure."""
    cause_index: IntArray
    """[tried] which point, shape or intruder."""
    shortfall_m: FloatArray
    """[tried] clearance found there."""


def first_clear(
    paths: Paths,
    candidates: IntArray,
    hazards: Hazards,
    margin_m: float,
    refuge: Refuge | None = None,
) -> Verification:
    """The first of `candidates` (nodes, best first) that keeps the margin, and why not others.

    With a refuge, a trajectory out through the side must also leave room to circle at its end.
    """
    return Verification(
        *_first_clear(
            paths,
            candidates,
            hazards.bins,
            hazards.shapes,
            hazards.movers,
            margin_m,
            refuge or NO_REFUGE,
        )
    )


NO_REFUGE = Refuge(
    np.zeros(0, dtype=np.bool_), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(3), 0.0
)


@dataclass(frozen=True, slots=True)
class Clearance:
    """Smallest distance from a path to the evidence, and what limits it."""

    distance_m: float
    cause: Cause
    index: int


def path_clearance(paths: Paths, node: int, hazards: Hazards) -> Clearance:
    """Clearance of the whole path from the start to the end of `node`; inf without evidence."""
    distance, cause, index = _path_clearance(
        paths, node, hazards.bins, hazards.shapes, hazards.movers, NEAR_M
    )
    if cause == Cause.NOTHING:
        distance, cause, index = _path_clearance(
            paths, node, hazards.bins, hazards.shapes, hazards.movers, np.inf
        )
    return Clearance(distance, Cause(cause), index)


def clearances(paths: Paths, hazards: Hazards, cap_m: float) -> FloatArray:
    """[nodes, 2] smallest clearance along the path to each node, and clearance lacking to `cap_m`
    summed over its movements: the measure of how bad a path is where none is good."""
    return _clearances(paths, hazards.bins, hazards.shapes, hazards.movers, cap_m)


@compiled
def _span(paths: Paths, n: int) -> Span:
    """The movement of a node, from its parent's end."""
    count = paths.samples_m.shape[1]
    corners = np.zeros((count + 1, 3))
    start_s = 0.0
    parent = paths.parent[n]
    if parent >= 0:
        corners[0] = paths.samples_m[parent, count - 1]
        start_s = paths.end_time_s[parent]
    corners[1:] = paths.samples_m[n]
    return span_of(corners, start_s, paths.end_time_s[n])


@compiled
def _node_clearance(
    paths: Paths, n: int, bins: PointBins, shapes: Shapes, movers: MovingHazards, enough: float
) -> Found:
    """Clearance of one movement, exact where it is below `enough`."""
    sagitta = paths.sagitta_m[n]
    distance, cause, index = span_clearance(_span(paths, n), bins, shapes, movers, enough + sagitta)
    return distance - sagitta, cause, index


@compiled
def _room_to_circle(
    refuge: Refuge, n: int, bins: PointBins, shapes: Shapes, enough: float
) -> Found:
    """Clearance of the better of the two circles at the end of a node."""
    best = (-np.inf, 0, -1)
    for side in (1.0, -1.0):
        center = refuge.end_m[n] + side * refuge.radius_m * refuge.left[n]
        found = circle_clearance(center, refuge.up, refuge.radius_m, bins, shapes, enough)
        if found[0] > best[0]:
            best = found
        if best[0] >= enough:
            break
    return best


@compiled
def _first_clear(
    paths: Paths,
    candidates: IntArray,
    bins: PointBins,
    shapes: Shapes,
    movers: MovingHazards,
    margin: float,
    refuge: Refuge,
) -> tuple[int, IntArray, IntArray, IntArray, FloatArray]:
    nodes, tried = len(paths.parent), len(candidates)
    # 0 not looked at, 1 keeps the margin, -1 does not: paths share their first movements.
    status = np.zeros(nodes, dtype=np.int8)
    found = np.zeros((nodes, 2), dtype=np.int64)
    clearance = np.zeros(nodes)
    blocked_at = np.full(tried, -1, dtype=np.int64)
    causes = np.zeros(tried, dtype=np.int64)
    cause_index = np.full(tried, -1, dtype=np.int64)
    shortfall = np.zeros(tried)
    path = np.empty(nodes, dtype=np.int64)
    for c in range(tried):
        end, steps = candidates[c], 0
        n = end
        while n >= 0:
            path[steps] = n
            steps += 1
            n = paths.parent[n]
        for at in range(steps - 1, -1, -1):
            n = path[at]
            if status[n] == 0:
                clearance[n], found[n, 0], found[n, 1] = _node_clearance(
                    paths, n, bins, shapes, movers, margin
                )
                status[n] = 1 if clearance[n] >= margin - 1e-9 else -1
            if status[n] < 0:
                blocked_at[c], shortfall[c] = n, clearance[n]
                causes[c], cause_index[c] = found[n, 0], found[n, 1]
                break
        if blocked_at[c] < 0 and len(refuge.needed) and refuge.needed[end]:
            room, cause, index = _room_to_circle(refuge, end, bins, shapes, margin)
            if room < margin - 1e-9:
                blocked_at[c], shortfall[c] = end, room
                causes[c], cause_index[c] = cause, index
        if blocked_at[c] < 0:
            return c, blocked_at[:c], causes[:c], cause_index[:c], shortfall[:c]
    return -1, blocked_at, causes, cause_index, shortfall


@compiled
def _path_clearance(
    paths: Paths, node: int, bins: PointBins, shapes: Shapes, movers: MovingHazards, enough: float
) -> Found:
    best = (enough, 0, -1)
    n = node
    while n >= 0:
        found = _node_clearance(paths, n, bins, shapes, movers, best[0])
        if found[1] != 0 and found[0] < best[0]:
            best = found
        n = paths.parent[n]
    return best


@compiled
def _clearances(
    paths: Paths, bins: PointBins, shapes: Shapes, movers: MovingHazards, cap: float
) -> FloatArray:
    result = np.empty((len(paths.parent), 2))
    for n in range(len(paths.parent)):
        distance = min(_node_clearance(paths, n, bins, shapes, movers, cap)[0], cap)
        before, lacking = cap, 0.0
        if paths.parent[n] >= 0:
            before, lacking = result[paths.parent[n], 0], result[paths.parent[n], 1]
        result[n, 0] = min(before, distance)
        result[n, 1] = lacking + (cap - distance)
    return result
