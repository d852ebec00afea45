"""Distance to the truth along the segments of a track, not only at its samples.

A distance changes by no more than the way flown, which bounds it between two samples; segments
whose bound could matter are halved until it cannot.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.obstacles.world import World

TOLERANCE = 1e-3
"""Of the margin: how far a least distance along a segment may be off."""
MOST_HALVINGS = 40


def measure_swept_distance_m(world: World, positions_m: FloatArray, margin_m: float) -> FloatArray:
    """[n] least distance to the nearest surface since the position before, of positions [n, 3].

    Straight between positions. Exact within TOLERANCE * margin_m as to whether a segment touches
    something, whether it comes nearer than the margin, and what the least distance of all is;
    elsewhere that of its ends. inf in an empty world.
    """
    at_ends = world.distance_m(np.ascontiguousarray(positions_m))
    least = at_ends.copy()
    if len(least) < 2 or not np.any(np.isfinite(at_ends)):
        return least
    least[1:] = np.minimum(at_ends[1:], at_ends[:-1])
    tolerance = TOLERANCE * margin_m
    owner = np.arange(1, len(least))
    start, end = positions_m[:-1], positions_m[1:]
    at_start, at_end = at_ends[:-1], at_ends[1:]
    for _ in range(MOST_HALVINGS):
        bound = 0.5 * (at_start + at_end - np.linalg.norm(end - start, axis=1))
        open_ = _find_undecided(bound, least[owner], float(least.min()), margin_m, tolerance)
        if not len(open_):
            break
        owner, start, end = owner[open_], start[open_], end[open_]
        at_start, at_end = at_start[open_], at_end[open_]
        middle = 0.5 * (start + end)
        at_middle = world.distance_m(np.ascontiguousarray(middle))
        np.minimum.at(least, owner, at_middle)
        owner = np.concatenate([owner, owner])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
        at_start = np.concatenate([at_start, at_middle])
        at_end = np.concatenate([at_middle, at_end])
    return least


def touches(world: World, step_m: FloatArray, margin_m: float) -> tuple[bool, float]:
    """Whether the way between two positions [2, 3] touches something, and the distance at its end.

    As of `measure_swept_distance_m`, which is asked only where the way may.
    """
    at_start, at_end = world.distance_m(step_m).tolist()
    bound = 0.5 * (at_start + at_end - math.dist(*step_m.tolist()))
    if at_start > 0.0 and at_end > 0.0 and bound > TOLERANCE * margin_m:
        return False, at_end
    return bool(measure_swept_distance_m(world, step_m, margin_m)[1] <= 0.0), at_end


def _find_undecided(
    bound: FloatArray, least: FloatArray, least_of_all: float, margin_m: float, tolerance: float
) -> IntArray:
    """Pieces [n] that may touch, come inside the margin, or be nearest of all, undecided so far."""
    may_touch = (bound <= -tolerance) & (least > 0.0)
    may_lose_margin = (bound < margin_m - tolerance) & (least >= margin_m)
    may_be_nearest = bound < least_of_all - tolerance
    return np.flatnonzero(may_touch | may_lose_margin | may_be_nearest)
