"""How low a decision may lead: no candidate goes below the floor, whatever else is in the way."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.rules.rule import worst_on_way
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import BoolArray
from clearway.obstacles.obstacle import Shapes

TOLERANCE_M = 1e-6
WIDE_M = 1e5
THICK_M = 100.0
"""Of the ground under a floor: wider than any way leads."""


def above_floor(prepared: PreparedReachSet, frame: GridFrame, floor_m: float) -> BoolArray:
    """[nodes] whether the way to a node stays above the floor, which is a height of the world.

    A vehicle that is below it already goes no lower; where every way dips, the least deep ones.
    """
    lowest = _lowest_m(prepared, frame)
    flyable = prepared.flyable & prepared.reach_set.complete
    allowed = lowest >= min(floor_m, float(frame.origin_m[2])) - TOLERANCE_M
    if not np.any(allowed & flyable) and np.any(flyable):
        allowed = lowest >= float(lowest[flyable].max()) - TOLERANCE_M
    return allowed


def _lowest_m(prepared: PreparedReachSet, frame: GridFrame) -> FloatArray:
    """[nodes] lowest height on the way to each node, curves and all."""
    reach_set = prepared.reach_set
    heights = frame.world_points(reach_set.samples_m)[:, :, 2].min(axis=1) - reach_set.sagitta_m
    return -worst_on_way(reach_set.parent, -np.ascontiguousarray(heights))


def with_ground(shapes: Shapes, frame: GridFrame, floor_m: float, margin_m: float) -> Shapes:
    """Shapes in the grid frame, and the ground that a margin is kept from by staying above a floor.

    For ways that are looked for among what is around, not among candidates.
    """
    if not np.isfinite(floor_m):
        return shapes
    x, y, z = frame.origin_m
    top_m = min(floor_m, float(z)) - margin_m
    middle = np.array([x, y, top_m - 0.5 * THICK_M])
    half = np.array([0.5 * WIDE_M, 0.5 * WIDE_M, 0.5 * THICK_M])
    ground = Shapes(
        frame.grid_points(middle)[None],
        np.ascontiguousarray(frame.world_from_grid.T)[None],
        half[None],
        np.zeros(1),
        np.array([np.linalg.norm(half)]),
        np.array([-1], dtype=np.int64),
    )
    joined = (np.concatenate(pair) for pair in zip(shapes, ground, strict=True))
    return Shapes(*(np.ascontiguousarray(part) for part in joined))
