"""A telemetry log of MAVLink 2 (.tlog), by pymavlink: own GPS positions and two aircraft."""

from __future__ import annotations

import math
import struct
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


def write_telemetry(path: Path, rng: np.random.Generator) -> None:
    """Two minutes: each second the own position, then both aircraft."""
    del rng
    dialect: Any = import_module("pymavlink.dialects.v20.ardupilotmega")
    codec = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    content, last_s = b"", -1.0
    for row in rows():
        if row.after_s > last_s:
            last_s = row.after_s
            content += _record(row.time_s, _own(dialect, row.after_s).pack(codec))
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
