"""Intruders as evidence: intersection models of chapter 5.1, timing, and their combination."""

from clearway.traffic.intruder import Intruder, up_seen_from
from clearway.traffic.models.body import body_cells
from clearway.traffic.models.cells import ModelCells
from clearway.traffic.models.combined import IntruderCells, assess_intruders, combine_intruders
from clearway.traffic.models.line import line_cells
from clearway.traffic.models.spread import spread_cells
from clearway.traffic.models.timing import (
    VehicleTimes,
    radial_vehicle_times,
    reach_set_vehicle_times,
)
from clearway.traffic.tracking.manoeuvre import Manoeuvres
from clearway.traffic.tracking.screening import Ownship, TrackerSettings
from clearway.traffic.tracking.tracker import Tracks, track_reports
from clearway.traffic.tracking.tracks import Report

__all__ = [
    "Intruder",
    "IntruderCells",
    "Manoeuvres",
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
