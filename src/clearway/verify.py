"""Verification of candidate trajectories against the coated evidence itself.

Cells alone are too coarse to keep a margin: each movement of a reach set is held against every hit
point and map shape, and against every intruder at the same instant of time. Clearance is the
distance from the vehicle's centre to the surface of the evidence; a candidate passes where its
clearance is at least the margin all along.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from clearway.compiled import compiled
from clearway.frames import FloatArray
from clearway.obstacles import Shapes, rounded_box_distance, shapes_of
from clearway.reach.tree import SIDE, ReachSet
from clearway.state import BoolArray, IndexArray, IntArray

CIRCLE_SAMPLES = 96
"""Points on a circle that shapes are held against; half their spacing is taken off."""
TERNARY_STEPS = 24
"""Halvings (by a third) of a chord: enough for 1e-4 of its length."""


class Cause(IntEnum):
    """What limits a clearance."""

    NOTHING = 0
    POINT = 1
    MAP = 2
    INTRUDER = 3


class PointHazards(NamedTuple):
    """Balls that stand for returns."""

    position_m: FloatArray
    """[m, 3] grid frame."""
    radius_m: FloatArray
    """[m] half the beam spacing there, plus what thinning added."""


class MovingHazards(NamedTuple):
    """Balls that move in a straight line and grow with time."""

    position_m: FloatArray
    """[k, 3] grid frame, at the start of the trajectories."""
    velocity_mps: FloatArray
    """[k, 3] grid frame."""
    radius_m: FloatArray
    """[k] at the start."""
    growth_mps: FloatArray
    """[k] growth of the radius: spread and uncertainty."""


def no_points() -> PointHazards:
    return PointHazards(np.zeros((0, 3)), np.zeros(0))


def no_shapes() -> Shapes:
    return shapes_of(())


def no_movers() -> MovingHazards:
    return MovingHazards(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class Hazards:
    """All that a trajectory must keep its margin from, in the grid frame."""

    points: PointHazards = field(default_factory=no_points)
    shapes: Shapes = field(default_factory=no_shapes)
    movers: MovingHazards = field(default_factory=no_movers)


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
            hazards.points,
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
        paths, node, hazards.points, hazards.shapes, hazards.movers
    )
    return Clearance(distance, Cause(cause), index)


def clearances(paths: Paths, hazards: Hazards, cap_m: float) -> FloatArray:
    """[nodes, 2] smallest clearance along the path to each node, and clearance lacking to `cap_m`
    summed over its movements: the measure of how bad a path is where none is good."""
    return _clearances(paths, hazards.points, hazards.shapes, hazards.movers, cap_m)


@compiled
def _chord_distance(
    px: float,
    py: float,
    pz: float,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
) -> float:
    """Distance from point p to the segment a-b."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    wx, wy, wz = px - ax, py - ay, pz - az
    length2 = ux * ux + uy * uy + uz * uz
    share = 0.0
    if length2 > 0.0:
        share = min(1.0, max(0.0, (wx * ux + wy * uy + wz * uz) / length2))
    dx, dy, dz = wx - share * ux, wy - share * uy, wz - share * uz
    return float(np.sqrt(dx * dx + dy * dy + dz * dz))


@compiled
def _shape_chord_distance(
    a: FloatArray, b: FloatArray, shapes: Shapes, s: int, enough: float
) -> float:
    """Distance from the segment a-b to shape `s`; exact where it is below `enough`.

    A rounded box is convex, so its distance along a straight line is too: a ternary search finds
    the smallest.
    """
    center, rotation = shapes.center_m[s], shapes.rotation[s]
    half, radius = shapes.half_m[s], shapes.radius_m[s]
    at_a = rounded_box_distance(a[0], a[1], a[2], center, rotation, half, radius)
    at_b = rounded_box_distance(b[0], b[1], b[2], center, rotation, half, radius)
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    if 0.5 * (at_a + at_b - length) >= enough:
        return float(min(at_a, at_b))
    low, high = 0.0, 1.0
    for _ in range(TERNARY_STEPS):
        first, second = low + (high - low) / 3.0, high - (high - low) / 3.0
        at_first = rounded_box_distance(
            a[0] + first * ux, a[1] + first * uy, a[2] + first * uz, center, rotation, half, radius
        )
        at_second = rounded_box_distance(
            a[0] + second * ux,
            a[1] + second * uy,
            a[2] + second * uz,
            center,
            rotation,
            half,
            radius,
        )
        if at_first < at_second:
            high = second
        else:
            low = first
    middle = 0.5 * (low + high)
    at_middle = rounded_box_distance(
        a[0] + middle * ux, a[1] + middle * uy, a[2] + middle * uz, center, rotation, half, radius
    )
    return float(min(at_a, at_b, at_middle))


@compiled
def _node_clearance(
    paths: Paths,
    n: int,
    points: PointHazards,
    shapes: Shapes,
    movers: MovingHazards,
    enough: float,
) -> tuple[float, int, int]:
    """Clearance of one movement, exact where it is below `enough`: distance, cause, index."""
    count = paths.samples_m.shape[1]
    chain = np.zeros((count + 1, 3))
    start_time = 0.0
    if paths.parent[n] >= 0:
        chain[0] = paths.samples_m[paths.parent[n], count - 1]
        start_time = paths.end_time_s[paths.parent[n]]
    chain[1:] = paths.samples_m[n]
    sagitta = paths.sagitta_m[n]
    cx = 0.5 * (chain[0, 0] + chain[count, 0])
    cy = 0.5 * (chain[0, 1] + chain[count, 1])
    cz = 0.5 * (chain[0, 2] + chain[count, 2])
    reach = 0.0
    for q in range(count + 1):
        dx, dy, dz = chain[q, 0] - cx, chain[q, 1] - cy, chain[q, 2] - cz
        reach = max(reach, np.sqrt(dx * dx + dy * dy + dz * dz))
    best, cause, index = enough + sagitta, 0, -1

    for m in range(len(points.radius_m)):
        px, py, pz = points.position_m[m, 0], points.position_m[m, 1], points.position_m[m, 2]
        dx, dy, dz = px - cx, py - cy, pz - cz
        far = best + reach + points.radius_m[m]
        if dx * dx + dy * dy + dz * dz >= far * far:
            continue
        for q in range(count):
            distance = (
                _chord_distance(
                    px,
                    py,
                    pz,
                    chain[q, 0],
                    chain[q, 1],
                    chain[q, 2],
                    chain[q + 1, 0],
                    chain[q + 1, 1],
                    chain[q + 1, 2],
                )
                - points.radius_m[m]
            )
            if distance < best:
                best, cause, index = distance, 1, m

    for s in range(len(shapes.radius_m)):
        from_center = rounded_box_distance(
            cx,
            cy,
            cz,
            shapes.center_m[s],
            shapes.rotation[s],
            shapes.half_m[s],
            shapes.radius_m[s],
        )
        if from_center - reach >= best:
            continue
        for q in range(count):
            distance = _shape_chord_distance(chain[q], chain[q + 1], shapes, s, best)
            if distance < best:
                best, cause, index = distance, 2, s

    step = (paths.end_time_s[n] - start_time) / count
    for k in range(len(movers.radius_m)):
        for q in range(count):
            from_time, to_time = start_time + q * step, start_time + (q + 1) * step
            distance = (
                _chord_distance(
                    0.0,
                    0.0,
                    0.0,
                    chain[q, 0] - movers.position_m[k, 0] - movers.velocity_mps[k, 0] * from_time,
                    chain[q, 1] - movers.position_m[k, 1] - movers.velocity_mps[k, 1] * from_time,
                    chain[q, 2] - movers.position_m[k, 2] - movers.velocity_mps[k, 2] * from_time,
                    chain[q + 1, 0] - movers.position_m[k, 0] - movers.velocity_mps[k, 0] * to_time,
                    chain[q + 1, 1] - movers.position_m[k, 1] - movers.velocity_mps[k, 1] * to_time,
                    chain[q + 1, 2] - movers.position_m[k, 2] - movers.velocity_mps[k, 2] * to_time,
                )
                - movers.radius_m[k]
                - movers.growth_mps[k] * to_time
            )
            if distance < best:
                best, cause, index = distance, 3, k
    return best - sagitta, cause, index


@compiled
def _room_to_circle(
    refuge: Refuge, n: int, points: PointHazards, shapes: Shapes, enough: float
) -> tuple[float, int, int]:
    """Clearance of the better of the two circles at the end of a node: distance, cause, index."""
    best, best_cause, best_index = -np.inf, 0, -1
    for side in (1.0, -1.0):
        center = refuge.end_m[n] + side * refuge.radius_m * refuge.left[n]
        distance, cause, index = _circle_clearance(refuge, center, points, shapes, enough)
        if distance > best:
            best, best_cause, best_index = distance, cause, index
        if best >= enough:
            break
    return best, best_cause, best_index


@compiled
def _circle_clearance(
    refuge: Refuge, center: FloatArray, points: PointHazards, shapes: Shapes, enough: float
) -> tuple[float, int, int]:
    """Clearance of a level circle, exact where it is below `enough`: distance, cause, index."""
    radius, up = refuge.radius_m, refuge.up
    best, cause, index = enough, 0, -1
    for m in range(len(points.radius_m)):
        wx = points.position_m[m, 0] - center[0]
        wy = points.position_m[m, 1] - center[1]
        wz = points.position_m[m, 2] - center[2]
        height = wx * up[0] + wy * up[1] + wz * up[2]
        if abs(height) - points.radius_m[m] >= best:
            continue
        level = np.sqrt(max(0.0, wx * wx + wy * wy + wz * wz - height * height))
        distance = np.hypot(level - radius, height) - points.radius_m[m]
        if distance < best:
            best, cause, index = distance, 1, m
    # A level circle: `forward` completes `up` to a level frame.
    forward = np.array([up[2], 0.0, -up[0]])
    for s in range(len(shapes.radius_m)):
        for corner in range(CIRCLE_SAMPLES):
            angle = 2.0 * np.pi * corner / CIRCLE_SAMPLES
            ahead, across = radius * np.cos(angle), radius * np.sin(angle)
            distance = rounded_box_distance(
                center[0] + ahead * forward[0],
                center[1] + across,
                center[2] + ahead * forward[2],
                shapes.center_m[s],
                shapes.rotation[s],
                shapes.half_m[s],
                shapes.radius_m[s],
            )
            if distance - radius * np.pi / CIRCLE_SAMPLES < best:
                best, cause, index = distance - radius * np.pi / CIRCLE_SAMPLES, 2, s
    return best, cause, index


@compiled
def _first_clear(
    paths: Paths,
    candidates: IntArray,
    points: PointHazards,
    shapes: Shapes,
    movers: MovingHazards,
    margin: float,
    refuge: Refuge,
) -> tuple[int, IntArray, IntArray, IntArray, FloatArray]:
    nodes = len(paths.parent)
    # 0 not looked at, 1 keeps the margin, -1 does not: paths share their first movements.
    status = np.zeros(nodes, dtype=np.int8)
    found = np.zeros((nodes, 2), dtype=np.int64)
    clearance = np.zeros(nodes)
    tried = len(candidates)
    blocked_at = np.full(tried, -1, dtype=np.int64)
    causes = np.zeros(tried, dtype=np.int64)
    cause_index = np.full(tried, -1, dtype=np.int64)
    shortfall = np.zeros(tried)
    path = np.empty(nodes, dtype=np.int64)
    for c in range(tried):
        n, steps = candidates[c], 0
        while n >= 0:
            path[steps] = n
            steps += 1
            n = paths.parent[n]
        for at in range(steps - 1, -1, -1):
            n = path[at]
            if status[n] == 0:
                distance, cause, index = _node_clearance(paths, n, points, shapes, movers, margin)
                clearance[n], found[n, 0], found[n, 1] = distance, cause, index
                status[n] = 1 if distance >= margin - 1e-9 else -1
            if status[n] < 0:
                blocked_at[c], shortfall[c] = n, clearance[n]
                causes[c], cause_index[c] = found[n, 0], found[n, 1]
                break
        end = candidates[c]
        if blocked_at[c] < 0 and len(refuge.needed) and refuge.needed[end]:
            room, cause, index = _room_to_circle(refuge, end, points, shapes, margin)
            if room < margin - 1e-9:
                blocked_at[c], shortfall[c] = end, room
                causes[c], cause_index[c] = cause, index
        if blocked_at[c] < 0:
            return c, blocked_at[:c], causes[:c], cause_index[:c], shortfall[:c]
    return -1, blocked_at, causes, cause_index, shortfall


@compiled
def _path_clearance(
    paths: Paths,
    node: int,
    points: PointHazards,
    shapes: Shapes,
    movers: MovingHazards,
) -> tuple[float, int, int]:
    best, cause, index = np.inf, 0, -1
    n = node
    while n >= 0:
        distance, node_cause, node_index = _node_clearance(paths, n, points, shapes, movers, best)
        if node_cause != 0 and distance < best:
            best, cause, index = distance, node_cause, node_index
        n = paths.parent[n]
    return best, cause, index


@compiled
def _clearances(
    paths: Paths,
    points: PointHazards,
    shapes: Shapes,
    movers: MovingHazards,
    cap: float,
) -> FloatArray:
    result = np.empty((len(paths.parent), 2))
    for n in range(len(paths.parent)):
        distance, _cause, _index = _node_clearance(paths, n, points, shapes, movers, cap)
        distance = min(distance, cap)
        before, lacking = cap, 0.0
        if paths.parent[n] >= 0:
            before, lacking = result[paths.parent[n], 0], result[paths.parent[n], 1]
        result[n, 0] = min(before, distance)
        result[n, 1] = lacking + (cap - distance)
    return result
