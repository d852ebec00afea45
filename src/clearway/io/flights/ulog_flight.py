"""A ULog of PX4 as a recorded flight: poses, `obstacle_distance`, and the estimate of the wind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.errors import naming
from clearway.base.frames import FloatArray
from clearway.io.flights.recorded import (
    RangeReading,
    RecordedFlight,
    RecordedSensor,
    keep_winds,
    make_sector_lidar,
    sector_reading,
)
from clearway.io.foreign_errors import damage_told
from clearway.io.poses.ulog import MICROSECOND_S, read_topics, read_ulog, utc_shift

DISTANCES = "obstacle_distance"
FIELDS = (
    "timestamp", "frame", "increment", "angle_offset", "min_distance", "max_distance",
    "distances[71]",
)  # fmt: skip
"""Of `obstacle_distance`; logs of old releases lack some."""
WINDS = ("wind", "wind_estimate")
WIND_FIELDS = ("timestamp", "windspeed_north", "windspeed_east")
BINS = 72
UNKNOWN_CM = 65_535
CENTIMETRE_M = 0.01
BODY_FRD = 12
"""MAV_FRAME_BODY_FRD: sectors are counted clockwise from the nose."""


def ulog_flight(path: Path) -> RecordedFlight:
    """The flight of a log. Raises InputError as `read_ulog`."""
    log = read_ulog(path)
    with naming(path, "read"):
        content = path.read_bytes()
    topics, _ = read_topics(str(path), content, [DISTANCES, *WINDS, "vehicle_gps_position"])
    logged = [data for name, data in topics.topics if name == DISTANCES]
    names = [f"{DISTANCES} {number}" if number else DISTANCES for number in range(len(logged))]
    with damage_told(path, "ULog"):
        shift = utc_shift(topics)
        sensors = [_sensor(name, data, shift) for name, data in zip(names, logged, strict=True)]
        wind = [
            _wind(data, shift)
            for name, data in topics.topics
            if name in WINDS and all(field in data for field in WIND_FIELDS)
        ]
    strange = tuple(
        f"{path}: {name} left out: it lacks fields, or sectors that turn with the vehicle"
        for name, sensor in zip(names, sensors, strict=True)
        if sensor is None
    )
    return RecordedFlight(
        str(path),
        "ULog of PX4",
        log.track,
        tuple(one for one in sensors if one is not None),
        wind=wind[0] if wind else np.zeros((0, 4)),
        notes=(*log.track.notes, *strange),
    )


def _sensor(name: str, data: Any, shift: float) -> RecordedSensor | None:
    """Sectors around the vehicle; None where they do not turn with it, or are none.

    A message without any known sector is no reading: the sensor does not measure then.
    """
    if not all(name in data for name in FIELDS) or not len(data["timestamp"]):
        return None
    if int(data["frame"][0]) != BODY_FRD:
        return None
    step, first = float(data["increment"][0]) or 360.0 / BINS, float(data["angle_offset"][0])
    if not (0.0 < step <= 360.0 and abs(first) <= 360.0):
        return None
    bins = min(BINS, round(360.0 / step))
    # Clockwise in the log, left positive here.
    azimuth = -np.radians(first + step * np.arange(bins))
    times = data["timestamp"].astype(np.float64) * MICROSECOND_S + shift
    centimetres = np.column_stack([data[f"distances[{n}]"] for n in range(bins)])
    farthest = data["max_distance"].astype(np.float64)
    nearest = data["min_distance"].astype(np.float64)

    def readings() -> Iterator[RangeReading]:
        for at, time_s in enumerate(times):
            told = centimetres[at].astype(np.float64)
            if (told == UNKNOWN_CM).all():
                continue
            hit = (told <= farthest[at]) & (told >= nearest[at]) & (told != UNKNOWN_CM)
            yield sector_reading(float(time_s), azimuth, np.where(hit, told * CENTIMETRE_M, np.nan))

    lidar = make_sector_lidar(name, azimuth, max(float(farthest.max()) * CENTIMETRE_M, 1.0))
    return RecordedSensor(name, readings, lidar=lidar)


def _wind(data: Any, shift: float) -> FloatArray:
    """[n, 4] time, east, north, up."""
    times = data["timestamp"].astype(np.float64) * MICROSECOND_S + shift
    north, east = data["windspeed_north"], data["windspeed_east"]
    return keep_winds(
        np.column_stack([times, east, north, np.zeros(len(times))]).astype(np.float64)
    )
