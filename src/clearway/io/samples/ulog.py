"""A log of PX4 (ULog): own way, attitude, GPS, and what the transponder heard."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import (
    AIRCRAFT,
    BEGIN_S,
    LATITUDE,
    LONGITUDE,
    METRES_A_DEGREE,
    row_at,
)
from clearway.io.samples.made_world import SPEED_MPS

MAGIC = b"ULog\x01\x12\x35\x01"
BOOT_US = 5_000_000
"""Since the autopilot began, when the log begins."""
LASTS_S = 20
GROUND_M = 100.0
TOPICS: dict[str, tuple[tuple[str, str], ...]] = {
    "vehicle_local_position": (
        ("uint64_t", "timestamp"), ("double", "ref_lat"), ("double", "ref_lon"),
        ("float", "ref_alt"), ("float", "x"), ("float", "y"), ("float", "z"),
        ("bool", "xy_valid"), ("bool", "z_valid"),
    ),
    "vehicle_attitude": (("uint64_t", "timestamp"), ("float[4]", "q")),
    "vehicle_gps_position": (
        ("uint64_t", "timestamp"), ("uint64_t", "time_utc_usec"), ("double", "latitude_deg"),
        ("double", "longitude_deg"), ("double", "altitude_msl_m"),
        ("double", "altitude_ellipsoid_m"), ("float", "vel_m_s"), ("float", "cog_rad"),
        ("float", "vel_d_m_s"), ("uint8_t", "fix_type"),
    ),
    "transponder_report": (
        ("uint64_t", "timestamp"), ("double", "lat"), ("double", "lon"),
        ("uint32_t", "icao_address"), ("float", "altitude"), ("float", "heading"),
        ("float", "hor_velocity"), ("float", "ver_velocity"), ("uint16_t", "flags"),
        ("uint16_t", "squawk"), ("uint8_t", "altitude_type"), ("char[9]", "callsign"),
        ("uint8_t", "emitter_type"), ("uint8_t", "tslc"),
    ),
}  # fmt: skip
LETTERS = {"uint64_t": "Q", "uint32_t": "I", "uint16_t": "H", "uint8_t": "B", "bool": "?",
           "float": "f", "double": "d", "float[4]": "4f", "char[9]": "9s"}  # fmt: skip
HEARD = 1 | 2 | 4 | 8 | 16
"""Place, altitude, heading, velocity and callsign are valid."""


def write_ulog(path: Path, rng: np.random.Generator) -> None:
    """Twenty seconds straight east, while two aircraft are reported."""
    del rng
    content = MAGIC + struct.pack("<Q", BOOT_US)
    content += _message(b"B", bytes(40))
    for topic, fields in TOPICS.items():
        words = ";".join(f"{kind} {name}" for kind, name in fields)
        content += _message(b"F", f"{topic}:{words};".encode())
    for number, topic in enumerate(TOPICS):
        content += _message(b"A", struct.pack("<BH", 0, number) + topic.encode())
    order = list(TOPICS)
    for topic, values in _order_rows():
        letters = "".join(LETTERS[kind] for kind, _ in TOPICS[topic])
        data = struct.pack("<" + letters, *values)
        content += _message(b"D", struct.pack("<H", order.index(topic)) + data)
    path.write_bytes(content)


def _message(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<H", len(data)) + kind + data


def _order_rows() -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Rows of all topics in the order of time."""
    shift = METRES_A_DEGREE * math.cos(math.radians(LATITUDE))
    half, east_rad = math.sqrt(0.5), math.pi / 2.0
    for tenth in range(10 * LASTS_S + 1):
        after_s = tenth / 10.0
        now = BOOT_US + round(1e6 * after_s)
        east = SPEED_MPS * after_s
        place = (now, LATITUDE, LONGITUDE, GROUND_M, 0.0, east, -20.0, True, True)
        yield "vehicle_local_position", place
        # Nose to the east: a quarter turn clockwise about the axis down.
        yield "vehicle_attitude", (now, half, 0.0, 0.0, half)
        if tenth % 10:
            continue
        utc = round(1e6 * (BEGIN_S + after_s))
        longitude = LONGITUDE + east / shift
        height = GROUND_M + 20.0
        yield (
            "vehicle_gps_position",
            (now, utc, LATITUDE, longitude, height, height + 48.0, SPEED_MPS, east_rad, 0.0, 3),
        )
        for one in AIRCRAFT:
            row = row_at(one, after_s)
            heading = math.radians(one.track_deg)
            heading = heading - 2.0 * math.pi if heading > math.pi else heading
            yield "transponder_report", (
                now, row.latitude, row.longitude, int(one.address, 16), one.altitude_m, heading,
                one.speed_mps, 0.0, HEARD, 0, 0, one.callsign.encode(), 1, 0,
            )  # fmt: skip
