"""Recorded traffic: reports of aircraft as files have them, tracks made of them, closest pairs."""

from clearway.recordings.aircraft import Aircraft, aircraft_of
from clearway.recordings.closest import ClosestPair, closest_pairs
from clearway.recordings.ghosts import without_ghosts
from clearway.recordings.local import local_reports
from clearway.recordings.own_part import OwnPart, take_part
from clearway.recordings.report import TrafficRecording, TrafficReport

__all__ = [
    "Aircraft",
    "ClosestPair",
    "OwnPart",
    "TrafficRecording",
    "TrafficReport",
    "aircraft_of",
    "closest_pairs",
    "local_reports",
    "take_part",
    "without_ghosts",
]
