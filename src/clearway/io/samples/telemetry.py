"""A telemetry log of MAVLink 2 (.tlog): own GPS positions, two aircraft, a drone's Remote ID."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import (
    BEGIN_S,
    LATITUDE,
    LONGITUDE,
    METRES_A_DEGREE,
    Row,
    rows,
)
from clearway.io.samples.made_world import SPEED_MPS

HEARD = 1 | 2 | 4 | 8 | 16
"""Place, altitude, heading, velocity and callsign are valid."""
GROUND_MM = 100_000
DRONE = b"\x60\x60\x1f\x00\x00\x01"
DRONE_MPS = 8.0
"""The address that it sends from."""


def write_telemetry(path: Path, rng: np.random.Generator) -> None:
    """Two minutes: each second the own position and the drone's, then both aircraft."""
    del rng
    dialect: Any = import_module("pymavlink.dialects.v20.ardupilotmega")
    codec = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    content, last_s = b"", -1.0
    for row in rows():
        if row.after_s > last_s:
            last_s = row.after_s
            content += _record(row.time_s, _own(dialect, row.after_s).pack(codec))
            for one in _drone(dialect, row.time_s, row.after_s):
                content += _record(row.time_s + 0.005, one.pack(codec))
        content += _record(row.time_s + 0.01, _other(dialect, row).pack(codec))
    path.write_bytes(content)


def _record(time_s: float, frame: bytes) -> bytes:
    return struct.pack(">Q", round(1e6 * time_s)) + bytes(frame)


def _own(dialect: Any, after_s: float) -> Any:
    """Straight east at a metre a second."""
    east = SPEED_MPS * after_s / METRES_A_DEGREE / math.cos(math.radians(LATITUDE))
    return dialect.MAVLink_gps_raw_int_message(
        round(1e6 * (BEGIN_S + after_s)), 3, round(1e7 * LATITUDE), round(1e7 * (LONGITUDE + east)),
        GROUND_MM + 20_000, 80, 80, round(100.0 * SPEED_MPS), 9000, 12, GROUND_MM + 68_000,
    )  # fmt: skip


def _other(dialect: Any, row: Row) -> Any:
    one = row.aircraft
    return dialect.MAVLink_adsb_vehicle_message(
        int(one.address, 16), round(1e7 * row.latitude), round(1e7 * row.longitude), 0,
        round(1000.0 * one.altitude_m), round(100.0 * one.track_deg),
        round(100.0 * one.speed_mps), 0, one.callsign.encode(), 1, 0, HEARD, 0,
    )  # fmt: skip


def _drone(dialect: Any, time_s: float, after_s: float) -> Iterator[Any]:
    """Remote ID of a drone that flies north beside us: who it is, now and then, and where."""
    nobody, sender = bytes(20), DRONE.ljust(20, b"\0")
    if after_s % 10.0 == 0.0:
        yield dialect.MAVLink_open_drone_id_basic_id_message(
            0, 0, sender, 1, 2, b"DEMO-DRONE-1".ljust(20, b"\0")
        )
        yield dialect.MAVLink_open_drone_id_basic_id_message(
            0, 0, nobody, 1, 2, b"OURS".ljust(20, b"\0")
        )
    north = DRONE_MPS * after_s / METRES_A_DEGREE
    yield dialect.MAVLink_open_drone_id_location_message(
        0, 0, sender, 2, 0, round(100.0 * DRONE_MPS), 0, round(1e7 * (LATITUDE + north)),
        round(1e7 * (LONGITUDE + 0.001)), -1000.0, 1e-3 * GROUND_MM + 68.0 + 20.0, 0, 20.0,
        10, 4, 4, 3, time_s % 3600.0, 1,
    )  # fmt: skip
