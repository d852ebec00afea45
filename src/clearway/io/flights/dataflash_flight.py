"""A DataFlash log of ArduPilot as a recorded flight: the estimator's poses, and proximity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.base.frames import FloatArray
from clearway.io.apart import apart
from clearway.io.flights.recorded import (
    LoggedEnd,
    RangeReading,
    RecordedFlight,
    RecordedSensor,
    keep_winds,
    make_sector_lidar,
    sector_reading,
)
from clearway.io.poses.pose_track import pose_track, quaternions_of
from clearway.io.poses.ulog import ENU_FROM_NED, FRD_FROM_FLU
from clearway.io.traffic.dataflash import MAGIC, MICROSECOND_S, LoggedRow, read_logged_rows
from clearway.io.what_file import what_file

ESTIMATES = ("XKF1", "NKF1")
WINDS = ("XKF2", "NKF2")
SECTORS_DEG = (0, 45, 90, 135, 180, 225, 270, 315)
"""Clockwise from the nose."""
DISTANCES = tuple(f"D{degrees}" for degrees in SECTORS_DEG)
POSE = ("TimeUS", "C", "PN", "PE", "PD", "Roll", "Pitch", "Yaw")
FIELDS = {
    **dict.fromkeys(ESTIMATES, POSE),
    **dict.fromkeys(WINDS, ("TimeUS", "C", "VWN", "VWE")),
    "PRX": ("TimeUS", "Layer", "Health", "He", *DISTANCES),
    "ERR": ("TimeUS", "Subsys", "ECode"),
}
GOOD = 2.0
"""Health of a proximity sensor that works."""
FARTHEST_M = 1e4
"""Beyond which no proximity sensor measures: such a distance is damaged."""
CRASH_CHECK = 12.0
CRASHED = (1.0, 2.0)
"""Subsystem of ERR, and its codes for a crash and for lost control."""
Values = dict[str, float | None]


def dataflash_flight(path: Path) -> RecordedFlight:
    """The flight of a log, seconds since boot.

    Raises InputError where it has no poses, MissingExtraError without [mavlink].
    """
    if find_spec("pymavlink") is None:
        raise MissingExtraError(f"reading {path}", "mavlink")
    with naming(path, "read"):
        content = path.read_bytes()
    if not content.startswith(MAGIC[:2]):
        raise InputError(str(path), f"no DataFlash log of ArduPilot{what_file(path)}")
    rows, _, lost = apart(path, "DataFlash log", read_logged_rows, content, FIELDS)
    if lost < 0:
        notes: tuple[str, ...] = (f"{path}: cut off: what is before was read",)
    else:
        notes = (f"{path}: {lost} bytes hold no message",) if lost else ()
    kind = next((one for one in ESTIMATES if _of(rows, (one,))), ESTIMATES[0])
    poses = _numbers(_of(rows, (kind,)), POSE)
    if not len(poses):
        raise InputError(
            str(path), f"no poses in the log: it has no {' or '.join(ESTIMATES)} of the estimator"
        )
    poses = poses[poses[:, 1] == poses[0, 1]]
    track = pose_track(
        str(path),
        poses[:, 0] * MICROSECOND_S,
        poses[:, 2:5] @ ENU_FROM_NED.T,
        _turns(np.radians(poses[:, 5:8])),
        notes,
    )
    sensor = _proximity(_of(rows, ("PRX",)))
    wind = _numbers(_of(rows, WINDS), ("TimeUS", "VWE", "VWN"))
    return RecordedFlight(
        str(path),
        "DataFlash log of ArduPilot",
        track,
        () if sensor is None else (sensor,),
        end=_end(_of(rows, ("ERR",))),
        wind=keep_winds(
            np.column_stack([wind[:, 0] * MICROSECOND_S, wind[:, 1:], np.zeros(len(wind))])
        ),
        notes=track.notes,
    )


def _of(rows: Sequence[LoggedRow], kinds: Sequence[str]) -> list[Values]:
    return [row.values for row in rows if row.kind in kinds]


def _numbers(rows: Sequence[Values], names: Sequence[str]) -> FloatArray:
    """[n, names]; what an older log lacks is 0."""
    table = [[row[name] or 0.0 for name in names] for row in rows]
    return np.array(table, dtype=np.float64).reshape(-1, len(names))


def _turns(angles_rad: FloatArray) -> FloatArray:
    """[n, 4] world (east, north, up) from body (ahead, left, up), of roll, pitch and yaw [n, 3]."""
    turned = Rotation.from_euler("ZYX", angles_rad[:, ::-1]).as_matrix()
    return quaternions_of(ENU_FROM_NED @ turned @ FRD_FROM_FLU)


def _proximity(rows: Sequence[Values]) -> RecordedSensor | None:
    """The lowest layer; distances from the farthest of the log on, or farther than anything is, are
    no returns."""
    health = ["He" if row["Health"] is None else "Health" for row in rows]
    rows = [
        row
        for row, key in zip(rows, health, strict=True)
        if not row["Layer"] and (row[key] is None or row[key] == GOOD)
    ]
    if not rows:
        return None
    table = _numbers(rows, ("TimeUS", *DISTANCES))
    times, ranges = table[:, 0] * MICROSECOND_S, table[:, 1:]
    ranges = np.where(ranges <= FARTHEST_M, ranges, 0.0)
    farthest = float(ranges.max())
    azimuth = -np.radians(np.array(SECTORS_DEG, dtype=np.float64))

    def readings() -> Iterator[RangeReading]:
        for time_s, told in zip(times, ranges, strict=True):
            hit = (told > 0.0) & (told < farthest)
            yield sector_reading(float(time_s), azimuth, np.where(hit, told, np.nan))

    return RecordedSensor(
        "PRX", readings, lidar=make_sector_lidar("PRX", azimuth, max(farthest, 1.0))
    )


def _end(rows: Sequence[Values]) -> LoggedEnd | None:
    for row in rows:
        if row["Subsys"] == CRASH_CHECK and row["ECode"] in CRASHED:
            return LoggedEnd((row["TimeUS"] or 0.0) * MICROSECOND_S, "ArduPilot's crash check")
    return None
