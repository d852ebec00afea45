"""Intruders as evidence: intersection models of chapter 5.1, timing, and their combination."""

from clearway.intruders.body import body_cells
from clearway.intruders.cells import ModelCells
from clearway.intruders.combined import IntruderCells, assess_intruders, combine_intruders
from clearway.intruders.intruder import Intruder, up_seen_from
from clearway.intruders.line import line_cells
from clearway.intruders.spread import spread_cells
from clearway.intruders.timing import (
    VehicleTimes,
    radial_vehicle_times,
    reach_set_vehicle_times,
)

__all__ = [
    "Intruder",
    "IntruderCells",
    "ModelCells",
    "VehicleTimes",
    "assess_intruders",
    "body_cells",
    "combine_intruders",
    "line_cells",
    "radial_vehicle_times",
    "reach_set_vehicle_times",
    "spread_cells",
    "up_seen_from",
]
