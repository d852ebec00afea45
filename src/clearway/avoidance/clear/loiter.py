"""Room to circle: whether a vehicle that cannot stop could stay where a trajectory takes it.

Such a vehicle is lost in a dead end too narrow to turn round in. Level circles of its turning
radius, to the left and to the right of a place, are held against the evidence: while one of them is
free, as far as is known, there is always a way out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.clearance import Found, circle_clearance
from clearway.avoidance.clear.hazards import PointBins
from clearway.base.arrays import Bools, Floats, Floats2, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.reach.tree import SIDE, ReachSet

EARLY_MOVEMENTS = 3
"""Movements within which a way should have room to circle: later, much of the circle is unseen."""


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

    def __repr__(self) -> str:
        return brief(self)


NO_LOITER = LoiterCircles(
    np.zeros(0, dtype=np.bool_), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(3), 0.0
)
"""Asks for no room."""


def loiter_circles(reach_set: ReachSet, turning_radius_m: float) -> LoiterCircles:
    """Circles at the ends of a reach set's movements; none for a vehicle that need not circle."""
    if not (np.isfinite(turning_radius_m) and turning_radius_m > 0.0):
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
        float(turning_radius_m),
    )


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
