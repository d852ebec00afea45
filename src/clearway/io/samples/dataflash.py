"""A log of ArduPilot (DataFlash): own GPS positions, pressure, and what its transponder heard."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np

from clearway.io.samples.encounter import BEGIN_S, LATITUDE, LONGITUDE, METRES_A_DEGREE, rows
from clearway.io.samples.made_world import SPEED_MPS

HEAD = b"\xa3\x95"
FMT = 128
BOOT_US = 5_000_000
GPS_EPOCH_S = 315_964_800
WEEK_S = 604_800
LEAP_S = 18
GROUND_M = 100.0
GEOID_M = 48.0
PRESSURE_PA = 99_891.7
MESSAGES = {
    # Name: number, its characters, struct's, columns.
    "FMT": (FMT, "BBnNZ", "<BB4s16s64s", "Type,Length,Name,Format,Columns"),
    "GPS": (129, "QBBIHBcLLeffffB", "<QBBIHBhiiiffffB",
            "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
    "GPA": (130, "QBCCCCfBIHf", "<QBHHHHfBIHf",
            "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,Und"),
    "BARO": (131, "QBff", "<QBff", "TimeUS,I,Alt,Press"),
    "ADSB": (132, "QIiiiHHhH", "<QIiiiHHhH",
             "TimeUS,ICAO_address,Lat,Lng,Alt,Heading,Hor_vel,Ver_vel,Squark"),
}  # fmt: skip


def write_dataflash(path: Path, rng: np.random.Generator) -> None:
    """Two minutes: each second the own position, then both aircraft."""
    del rng
    content = b"".join(_format(name) for name in MESSAGES)
    told_s = -1.0
    for row in rows():
        micro = BOOT_US + round(1e6 * row.after_s)
        if row.after_s > told_s:
            told_s = row.after_s
            content += _own(micro, row.after_s)
        one = row.aircraft
        content += _message(
            "ADSB", micro + 1000, int(one.address, 16), round(1e7 * row.latitude),
            round(1e7 * row.longitude), round(1000.0 * one.altitude_m),
            round(100.0 * one.track_deg), round(100.0 * one.speed_mps), 0, 0o1200,
        )  # fmt: skip
    path.write_bytes(content)


def _own(micro: int, after_s: float) -> bytes:
    """Straight east at a metre a second, 20 m above ground."""
    east = SPEED_MPS * after_s / METRES_A_DEGREE / math.cos(math.radians(LATITUDE))
    week, second = divmod(BEGIN_S + after_s - GPS_EPOCH_S + LEAP_S, WEEK_S)
    place = (round(1e7 * LATITUDE), round(1e7 * (LONGITUDE + east)), round(100 * (GROUND_M + 20.0)))
    return (
        _message("BARO", micro, 0, 20.0, PRESSURE_PA)
        + _message("GPA", micro, 0, 100, 30, 50, 20, 0.0, 1, 0, 200, -GEOID_M)
        + _message("GPS", micro, 0, 3, round(1000.0 * second), int(week), 12, 80, *place,
                   SPEED_MPS, 90.0, 0.0, 0.0, 1)
    )  # fmt: skip


def _message(name: str, *values: object) -> bytes:
    number, _, form, _ = MESSAGES[name]
    return HEAD + bytes((number,)) + struct.pack(form, *values)


def _format(name: str) -> bytes:
    """The message that tells how another one is written."""
    number, characters, form, columns = MESSAGES[name]
    words = (name.encode(), characters.encode(), columns.encode())
    return _message("FMT", number, 3 + struct.calcsize(form), *words)
