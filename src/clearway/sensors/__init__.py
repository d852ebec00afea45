"""Sensors: beam patterns, scans, and what they say of every cell."""

from clearway.sensors.beams.estimate import estimate_pattern
from clearway.sensors.beams.lidar import Lidar, Mounting, Scan
from clearway.sensors.beams.named_patterns import NAMED_PATTERNS, find_pattern
from clearway.sensors.beams.pattern import BeamPattern
from clearway.sensors.beams.simulate import Scanner, scan_world, simulate_scan
from clearway.sensors.cells.detection import Detection, detect, detect_nothing, detection_of_cells
from clearway.sensors.cells.inflation import inflate_points, thin_points
from clearway.sensors.cells.placing import Ground
from clearway.sensors.cells.space import SpaceCells, SpaceClass, classify_space
from clearway.sensors.cells.visibility import compute_expected_hits, swipe_area_m2, visibility
from clearway.sensors.memory.point_memory import PointMemory, update_memory
from clearway.sensors.range_sensor import (
    AnySensor,
    LidarSensor,
    RangeSensor,
    range_sensors,
    remember_reading,
)
from clearway.sensors.several.combined import SensedCells, combine_detections
from clearway.sensors.several.trust import Court, hear_reading
from clearway.sensors.standing import COMBINE_RULES, Standing, combine_rule_named

__all__ = [
    "COMBINE_RULES",
    "NAMED_PATTERNS",
    "AnySensor",
    "BeamPattern",
    "Court",
    "Detection",
    "Ground",
    "Lidar",
    "LidarSensor",
    "Mounting",
    "PointMemory",
    "RangeSensor",
    "Scan",
    "Scanner",
    "SensedCells",
    "SpaceCells",
    "SpaceClass",
    "Standing",
    "classify_space",
    "combine_detections",
    "combine_rule_named",
    "compute_expected_hits",
    "detect",
    "detect_nothing",
    "detection_of_cells",
    "estimate_pattern",
    "find_pattern",
    "hear_reading",
    "inflate_points",
    "range_sensors",
    "remember_reading",
    "scan_world",
    "simulate_scan",
    "swipe_area_m2",
    "thin_points",
    "update_memory",
    "visibility",
]
