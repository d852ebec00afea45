"""A robot recording as a recorded flight: its poses, and every topic with points as a sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.flights.recorded import RangeReading, RecordedFlight, RecordedSensor
from clearway.io.poses.bag_poses import poses_of_bag
from clearway.io.poses.pose_track import PoseTrack
from clearway.io.scans.bag_scans import SCANS
from clearway.io.scans.open_bag import open_bag
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.timed_scans import ScanSequence
from clearway.sensors import Mounting


def bag_flight(path: Path) -> RecordedFlight:
    """The flight of a bag or MCAP file. Raises InputError where it has no poses."""
    with open_bag(path) as bag:
        kind = bag.kind
        topics = [one.name for one in bag.topics if one.type in SCANS and one.messages]
        track = None if topics else poses_of_bag(path, bag, "", None).track
    sequences = [(name, open_scans(path, name)) for name in topics]
    notes = tuple(dict.fromkeys(note for _, one in sequences for note in one.notes))
    if topics:
        track = _track(path, sequences[0][1])
    if track is None or not len(track.time_s):
        raise InputError(
            str(path),
            "no poses of the vehicle in it: `clearway why` needs odometry, poses or transforms",
        )
    sensors = tuple(
        RecordedSensor(name, _readings(one), one.mounting or Mounting(), sequence=one)
        for name, one in sequences
    )
    return RecordedFlight(str(path), kind, track, sensors, notes=notes)


def _track(path: Path, sequence: ScanSequence) -> PoseTrack | None:
    """The poses that the scans' own are taken from."""
    with open_bag(path) as bag:
        return poses_of_bag(path, bag, sequence.frame, None).track


def _readings(sequence: ScanSequence) -> Callable[[], Iterator[RangeReading]]:
    def readings() -> Iterator[RangeReading]:
        for scan in sequence:
            try:
                points = scan.read().points_m
            except InputError:
                continue
            yield RangeReading(scan.time_s, points)

    return readings
