"""BaseStation messages (SBS-1, port 30003): lines `MSG,3,...` of positions and velocities."""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from dataclasses import dataclass
from datetime import UTC, datetime

from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.traffic.mode_s import UNKNOWN_MOTION, VELOCITY_AGE_S, Motion
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    NO_TIME,
    ON_GROUND,
    Altitude,
    Sieve,
    address_of,
)
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

FORM = "BaseStation"
MOST_FIELDS = 22
LEAST_FIELDS = 16
KIND = 1
ADDRESS = 4
DATE = 6
TIME = 7
CALLSIGN = 10
ALTITUDE = 11
SPEED = 12
TRACK = 13
LATITUDE = 14
LONGITUDE = 15
RATE = 16
GROUND = 21
OTHER = {"SEL": "selection", "ID": "new callsign", "AIR": "new aircraft", "STA": "status",
         "CLK": "clock"}  # fmt: skip


@dataclass(slots=True)
class _SbsAircraft:
    """What an aircraft has told between its positions."""

    callsign: str = ""
    motion: Motion = UNKNOWN_MOTION
    motion_s: float = -math.inf


def read_sbs(source: str, content: bytes) -> TrafficRecording:
    """Reports of positions, with the latest velocity and callsign of the same aircraft.

    Times are those of the computer that wrote the file, whose zone it does not tell: taken as UTC.
    Raises InputError where the last line is cut off.
    """
    sieve = Sieve(source)
    sieve.notes.append("times have no zone in the file: taken as UTC")
    known: dict[str, _SbsAircraft] = defaultdict(_SbsAircraft)
    lines = content.decode("ascii", "replace").splitlines()
    for place, row in enumerate(csv.reader(lines), start=1):
        if not row:
            continue
        if row[0] in OTHER:
            sieve.use(OTHER[row[0]])
        elif row[0] == "MSG" and len(row) >= LEAST_FIELDS:
            _take([*row, *[""] * (MOST_FIELDS - len(row))], f"line {place}", known, sieve)
        elif place == len(lines) and not content.endswith(b"\n"):
            sieve.cut_off(f"line {place}, the last one: {row[0][:20]!r} ...")
        else:
            sieve.drop(DAMAGED, f"line {place}: {','.join(row)[:40]!r}")
    return sieve.recording(FORM)


def _take(row: list[str], place: str, known: dict[str, _SbsAircraft], sieve: Sieve) -> None:
    try:
        numbers = {
            at: None if not row[at].strip() else float(row[at])
            for at in (ALTITUDE, SPEED, TRACK, LATITUDE, LONGITUDE, RATE)
        }
    except ValueError as cause:
        sieve.drop(DAMAGED, f"{place}: {cause}")
        return
    address, time_s = address_of(row[ADDRESS]), _time_s(row)
    mine = known[address]
    mine.callsign = row[CALLSIGN].strip() or mine.callsign
    if numbers[SPEED] is not None and time_s is not None:
        mine.motion_s = time_s
        mine.motion = (
            _times(numbers[SPEED], KNOT_MPS),
            _times(numbers[TRACK], math.pi / 180.0),
            _times(numbers[RATE], FOOT_PER_MINUTE_MPS),
        )
    if numbers[LATITUDE] is None:
        _use(row, address, sieve)
        return
    told = sieve.complete(time_s, address, numbers[LATITUDE], numbers[LONGITUDE])
    if told is None:
        return
    moment_s, _, (latitude_deg, longitude_deg) = told
    altitude_m = _times(numbers[ALTITUDE], FOOT_M)
    altitude: Altitude = (altitude_m, None if altitude_m is None else "barometric", None)
    if row[GROUND].strip() in ("1", "-1"):
        altitude = ON_GROUND
    motion = mine.motion if moment_s - mine.motion_s <= VELOCITY_AGE_S else UNKNOWN_MOTION
    sieve.take(
        TrafficReport(
            moment_s,
            address,
            latitude_deg,
            longitude_deg,
            *altitude,
            *motion,
            mine.callsign,
            "unknown",
        )
    )


def _use(row: list[str], address: str, sieve: Sieve) -> None:
    """A message that tells no position."""
    if address:
        sieve.heard[address] += 1
    what = {"1": "identification", "4": "velocity"}.get(row[KIND].strip(), "without position")
    if _time_s(row) is None:
        sieve.drop(NO_TIME)
    else:
        sieve.use(what)


def _time_s(row: list[str]) -> float | None:
    """Seconds since 1970 of a date such as 2023/08/30 and a time."""
    try:
        moment = datetime.fromisoformat(
            f"{row[DATE].strip().replace('/', '-')} {row[TIME].strip()}"
        )
    except ValueError:
        return None
    return moment.replace(tzinfo=UTC).timestamp()


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor
