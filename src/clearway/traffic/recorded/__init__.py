"""Recorded traffic: reports of aircraft as files have them, tracks made of them, closest pairs."""

from clearway.traffic.recorded.aircraft import Aircraft, collect_aircraft
from clearway.traffic.recorded.closest import ClosestPair, closest_pairs
from clearway.traffic.recorded.ghosts import without_ghosts
from clearway.traffic.recorded.local import local_reports
from clearway.traffic.recorded.own_part import OwnPart, take_part
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

__all__ = [
    "Aircraft",
    "ClosestPair",
    "OwnPart",
    "TrafficRecording",
    "TrafficReport",
    "closest_pairs",
    "collect_aircraft",
    "local_reports",
    "take_part",
    "without_ghosts",
]
