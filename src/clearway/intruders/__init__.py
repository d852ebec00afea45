"""Intruders as evidence: intersection models of chapter 5.1, timing, and their combination."""

from clearway.intruders.body import body_cells
from clearway.intruders.cells import ModelCells
from clearway.intruders.combined import IntruderCells, assess_intruders, combine_intruders
from clearway.intruders.intruder import Intruder, up_seen_from
from clearway.intruders.line import line_cells
from clearway.intruders.screening import Ownship, TrackerSettings
from clearway.intruders.spread import spread_cells
from clearway.intruders.timing import (
    VehicleTimes,
    radial_vehicle_times,
    reach_set_vehicle_times,
)
from clearway.intruders.tracker import Tracks, track_reports
from clearway.intruders.tracks import Report

__all__ = [
    "Intruder",
    "IntruderCells",
    "ModelCells",
    "Ownship",
    "Report",
    "TrackerSettings",
    "Tracks",
    "VehicleTimes",
    "assess_intruders",
    "body_cells",
    "combine_intruders",
    "line_cells",
    "radial_vehicle_times",
    "reach_set_vehicle_times",
    "spread_cells",
    "track_reports",
    "up_seen_from",
]
