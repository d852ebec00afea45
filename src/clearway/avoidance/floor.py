"""How low a decision may lead: no candidate goes below the floor, whatever else is in the way."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.rules.rule import worst_on_way
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import BoolArray

TOLERANCE_M = 1e-6


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
