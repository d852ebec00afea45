"""Sensors: beam patterns, scans, and what they say of every cell."""

from clearway.sensors.beams import BeamPattern
from clearway.sensors.coating import coated_cells, thin_points
from clearway.sensors.combined import SensedCells, combine_detections
from clearway.sensors.detection import Detection, detect, detection_of_cells, unseen
from clearway.sensors.estimate import estimate_pattern
from clearway.sensors.lidar import Lidar, Mounting, Scan
from clearway.sensors.memory import PointMemory, update_memory
from clearway.sensors.named_patterns import NAMED_PATTERNS, named_pattern
from clearway.sensors.placing import Ground
from clearway.sensors.range_sensor import (
    AnySensor,
    LidarSensor,
    RangeSensor,
    range_sensors,
    remembered_after,
)
from clearway.sensors.simulate import Scanner, scanned, simulate_scan
from clearway.sensors.space import SpaceCells, SpaceClass, classify_space
from clearway.sensors.standing import COMBINE_RULES, Standing, combine_rule_named
from clearway.sensors.trust import Court, heard
from clearway.sensors.visibility import expected_hits, swipe_area_m2, visibility

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
    "coated_cells",
    "combine_detections",
    "combine_rule_named",
    "detect",
    "detection_of_cells",
    "estimate_pattern",
    "expected_hits",
    "heard",
    "named_pattern",
    "range_sensors",
    "remembered_after",
    "scanned",
    "simulate_scan",
    "swipe_area_m2",
    "thin_points",
    "unseen",
    "update_memory",
    "visibility",
]
