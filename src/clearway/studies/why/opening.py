"""Any log of a flight as a recorded flight."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import world_from_body
from clearway.io.flights.bag_flight import bag_flight
from clearway.io.flights.dataflash_flight import dataflash_flight
from clearway.io.flights.recorded import RangeReading, RecordedFlight, RecordedSensor
from clearway.io.flights.ulog_flight import ulog_flight
from clearway.io.foreign_errors import damage_told
from clearway.io.poses.pose_track import pose_track, quaternions_of
from clearway.io.scans.bag import METADATA
from clearway.io.what_file import require_file, what_file
from clearway.view.replay.raw_scans import KeptReadings, RawScan, is_run_file, read_raw_scans
from clearway.view.replay.reading import RUN_FILE, Recording, read_run, run_file

BAGS = (".bag", ".db3", ".mcap", ".zstd")
VALID = (
    "valid: a run folder of `clearway fly` or its run.mcap, .mcap, .bag, .db3 or the folder of a "
    "ROS 2 bag, .ulg of PX4, .bin of ArduPilot"
)


def open_flight(path: Path) -> RecordedFlight:
    """The flight of a log. Raises InputError naming the file and what is valid."""
    flight = _open(path)
    if not len(flight.track.time_s):
        left_out = "; ".join(flight.track.notes)
        raise InputError(str(path), f"no poses of the vehicle that can be used: {left_out}")
    return flight


def _open(path: Path) -> RecordedFlight:
    if path.is_dir():
        if (path / METADATA).is_file():
            return bag_flight(path)
        if not (path / RUN_FILE).is_file() and not any(
            (path / name).is_file() for name in ("track.csv", "mission.toml")
        ):
            raise InputError(str(path), f"neither a run nor a bag; {VALID}")
        return _run_flight(run_file(path))
    require_file(path)
    suffix = path.suffix.lower()
    if suffix == ".mcap" and is_run_file(path):
        return _run_flight(path)
    if suffix in BAGS:
        return bag_flight(path)
    if suffix == ".ulg":
        return ulog_flight(path)
    if suffix == ".bin":
        return dataflash_flight(path)
    raise InputError(
        str(path),
        f"suffix {suffix or '(none)'!r} is no log of a flight{what_file(path)}; {VALID}",
    )


def _run_flight(path: Path) -> RecordedFlight:
    """A run of clearway; its sensors have readings where it was flown with `--scans`."""
    run, kept = read_run(path), read_raw_scans(path)
    with damage_told(path, "run"):
        return _make_flight(path, run, kept)


def _make_flight(path: Path, run: Recording, kept: KeptReadings) -> RecordedFlight:
    states = list(run.states)
    times = np.array([one["time_s"] for one in states])
    turns = np.array([world_from_body(one["attitude_rad"]) for one in states])
    surface = [one["obstacle_distance_m"] for one in states]
    aircraft: dict[str, list[list[float]]] = {}
    for one in run.intruders:
        for there in one["intruders"]:
            place = [one["time_s"], *there["position_m"]]
            aircraft.setdefault(there["name"], []).append(place)
    places = np.array([one["position_m"] for one in states], dtype=np.float64).reshape(-1, 3)
    track = pose_track(str(path), times, places, quaternions_of(turns))
    if not np.array_equal(track.time_s, times):
        raise InputError(str(path), "damaged run: its states do not follow each other in time")
    return RecordedFlight(
        str(path),
        "run of clearway",
        track,
        tuple(
            RecordedSensor(name, _readings(scans, float(times[0])))
            for name, scans in kept.scans.items()
        ),
        surface_m=np.array([np.inf if one is None else one for one in surface]),
        intruders={name: np.array(rows) for name, rows in aircraft.items()},
        intruder_radius_m={
            name: float(radius or 0.0) for name, radius in run.mission["intruder_radius_m"].items()
        },
        mission_toml=kept.mission_toml,
        notes=()
        if kept.scans
        else ("the run has no raw scans: fly it with `clearway fly --scans`",),
    )


def _readings(scans: list[RawScan], start_s: float) -> Callable[[], Iterator[RangeReading]]:
    return lambda: (RangeReading(start_s + one.after_s, one.points_m) for one in scans)
