"""Room to circle, or to brake: whether a vehicle could stay where a trajectory takes it.

One that cannot stop is lost in a dead end too narrow to turn round in. Level circles of its turning
radius, to the left and to the right of a place, are checked against the evidence: while one of them
is free, as far as is known, there is always an escape. One with inertia needs as much room as it
takes to brake from the speed at which a trajectory ends: without, time to go from there is a guess.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.clearance import (
    Found,
    Span,
    circle_clearance,
    points_clearance,
    reach_about,
)
from clearway.avoidance.clear.crowds import clearance_among, crowd_of
from clearway.avoidance.clear.hazards import PointBins
from clearway.base.arrays import Bools, Floats, Floats2, Floats4, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.reach.tree import SIDE, ReachSet

EARLY_MOVEMENTS = 3
"""Movements within which a way should have room to circle: later, much of the circle is
unobserved."""


class Stops(NamedTuple):
    """Ways to brake to rest, from every class of motion."""

    ways_m: Floats4
    """[classes, ways, samples, 3] level axes along the heading at their start, straight on first;
    [0, 0, 0, 3] for a vehicle that needs none."""
    tube_m: Floats
    """[classes] within how far of them the vehicle is."""
    at: Ints
    """[nodes] class at the end of each node."""

    def __repr__(self) -> str:
        return brief(self)


NO_STOPS = Stops(np.zeros((0, 0, 0, 3)), np.zeros(0), np.zeros(0, dtype=np.int64))


class LoiterCircles(NamedTuple):
    """Circles that a vehicle can hold at the ends of the movements of a reach set."""

    needed: Bools
    """[nodes] where a trajectory leaves through the side: it ends near, possibly in a pocket, and
    is complete only if the vehicle could circle there for as long as it takes."""
    end_m: Floats2
    """[nodes, 3] grid frame."""
    left: Floats2
    """[nodes, 3] level unit vector to the left of the heading there, grid frame."""
    up: Floats
    """[3] vertical in the grid frame."""
    radius_m: float
    """Turning radius; 0 where nothing needs to circle."""
    stops: Stops
    """Of a vehicle with inertia."""
    brakes: bool
    """Whether it is asked for room to brake."""

    def __repr__(self) -> str:
        return brief(self)


NO_LOITER = LoiterCircles(
    np.zeros(0, dtype=np.bool_),
    np.zeros((0, 3)),
    np.zeros((0, 3)),
    np.zeros(3),
    0.0,
    NO_STOPS,
    False,
)
"""Asks for no room."""


def loiter_circles(
    reach_set: ReachSet, turning_radius_m: float, stops: Stops = NO_STOPS
) -> LoiterCircles:
    """Circles at the ends of a reach set's movements, or ways to brake; none for a vehicle that
    needs neither."""
    circles = np.isfinite(turning_radius_m) and turning_radius_m > 0.0
    if not circles and not len(stops.at):
        return NO_LOITER
    pitch = reach_set.start_pitch_rad
    yaw = reach_set.states[:, 5]
    across = -np.sin(yaw)
    left = np.stack([np.cos(pitch) * across, np.cos(yaw), np.sin(pitch) * across], axis=1)
    return LoiterCircles(
        np.equal(reach_set.exit_kind, SIDE),
        np.ascontiguousarray(reach_set.states[:, :3]),
        left,
        np.array([-np.sin(pitch), 0.0, np.cos(pitch)]),
        float(turning_radius_m) if circles else 0.0,
        stops,
        bool(len(stops.at)),
    )


@compiled
def room_to_brake(
    loiter: LoiterCircles, n: int, bins: PointBins, shapes: Shapes, enough: float
) -> Found:
    """Clearance of the best way to brake at the end of a node, exact below `enough`."""
    best, stops, up = (-np.inf, 0, -1), loiter.stops, loiter.up
    at, left = stops.at[n], loiter.left[n]
    ahead = np.array(
        [
            left[1] * up[2] - left[2] * up[1],
            left[2] * up[0] - left[0] * up[2],
            left[0] * up[1] - left[1] * up[0],
        ]
    )
    ways, samples = stops.ways_m.shape[1], stops.ways_m.shape[2]
    corners, middle = np.empty((samples + 1, 3)), np.empty(3)
    crowd, more = crowd_of(shapes, samples + 1), stops.tube_m[at]
    for way in range(ways):
        for axis in range(3):
            corners[0, axis] = loiter.end_m[n, axis]
            for q in range(samples):
                corners[q + 1, axis] = (
                    loiter.end_m[n, axis]
                    + stops.ways_m[at, way, q, 0] * ahead[axis]
                    + stops.ways_m[at, way, q, 1] * left[axis]
                    + stops.ways_m[at, way, q, 2] * up[axis]
                )
        span = Span(corners, middle, reach_about(corners, middle), 0.0, 0.0)
        found = points_clearance(span, bins, enough + more, best[0] + more)
        by_shape = clearance_among(span, shapes, crowd, found[0], best[0] + more)
        if by_shape[2] >= 0:
            found = by_shape
        if found[0] - more > best[0]:
            best = (found[0] - more, found[1], found[2])
        if best[0] >= enough:
            break
    return best


@compiled
def room_to_circle(
    loiter: LoiterCircles, n: int, bins: PointBins, shapes: Shapes, enough: float
) -> Found:
    """Clearance of the better of the two circles at the end of a node."""
    best = (-np.inf, 0, -1)
    for side in (1.0, -1.0):
        center = loiter.end_m[n] + side * loiter.radius_m * loiter.left[n]
        found = circle_clearance(center, loiter.up, loiter.radius_m, bins, shapes, enough)
        if found[0] > best[0]:
            best = found
        if best[0] >= enough:
            break
    return best


@compiled
def early_room(
    loiter: LoiterCircles,
    path: Ints,
    bins: PointBins,
    shapes: Shapes,
    enough: float,
    known: Floats2,
) -> Found:
    """Clearance of the best circle within the first movements of a path, exact below `enough`.

    path: its nodes, the first movement last. known: [nodes, 3] what was found at a node before,
    nan where nothing was; filled in, since paths share their first movements.
    """
    best = (-np.inf, 0, -1)
    for at in range(len(path) - 1, max(-1, len(path) - 1 - EARLY_MOVEMENTS), -1):
        n = path[at]
        if np.isnan(known[n, 0]):
            found = room_to_circle(loiter, n, bins, shapes, enough)
            known[n, 0], known[n, 1], known[n, 2] = found
        if known[n, 0] > best[0]:
            best = (known[n, 0], int(known[n, 1]), int(known[n, 2]))
        if best[0] >= enough:
            break
    return best
