"""BlueSky scenarios (.scn): the aircraft that they create, as they are at that moment."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    FASTEST_READ_MPS,
    HIGHEST_FLIGHT_M,
    IMPOSSIBLE,
    LOWEST_FLIGHT_M,
    NO_POSITION,
    Sieve,
)
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

FORM = "BlueSky scenario"
LINE = re.compile(r"(\d+):(\d\d):(\d\d(?:\.\d+)?)\s*>\s*(.*)")
CREATE = ("CRE", "CREATE")
VALUES = 7
"""CRE callsign, type, latitude, longitude, heading, altitude, speed."""
PLACE = re.compile(r"([NSEW]?)(-?\d+(?:\.\d*)?(?:e-?\d+)?)", re.IGNORECASE)
LARGEST_MACH = 1.0
"""Speeds up to it are Mach numbers."""
GAS_CONSTANT = 287.05287
"""Of air, J/(kg K)."""
TROPOPAUSE_M = 11_000.0
AIR_LOWEST_M = -1_000.0
AIR_HIGHEST_M = 20_000.0
"""Between these the standard atmosphere is known here."""
FASTEST_KT = 2_000.0


def read_bluesky(source: str, content: bytes) -> TrafficRecording:
    """One report of each aircraft at its creation; other commands are counted, not obeyed.

    Altitudes are geometric (feet or flight levels: scripts know no air pressure). Speeds are
    calibrated air speeds in knots, or Mach numbers; ground speeds are the true air speeds of the
    standard atmosphere without wind. Raises InputError where a line is cut off.
    """
    sieve = Sieve(source)
    lines = list(_lines(content))
    whole = content.endswith((b"\n", b"\r"))
    for place, line in lines:
        last = place == lines[-1][0]
        found = LINE.fullmatch(line)
        if found is None:
            if last and not whole:
                sieve.cut_off(f"line {place}, the last one: {line[:40]!r}")
                continue
            sieve.drop(DAMAGED, f"line {place}: no time and command: {line[:40]!r}")
            continue
        hours, minutes, seconds, command = found.groups()
        words = [word for word in re.split(r"\s*,\s*|\s+", command.strip()) if word]
        if not words or words[0].upper() not in CREATE:
            sieve.use("other command")
        elif len(words) <= VALUES and last and not whole:
            sieve.cut_off(f"line {place}, the last one: {line[:60]!r}")
        else:
            time_s = 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
            if last and not whole:
                sieve.notes.append(f"line {place}, the last one, has no line end: cut off?")
            _take(place, words[1:], time_s, sieve)
    return sieve.recording(FORM, clock="relative")


def _lines(content: bytes) -> Iterator[tuple[int, str]]:
    """Number and text of each line but blank ones and comments; lines may end in CR alone."""
    text = content.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
    for place, line in enumerate(text.split("\n"), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield place, line.strip()


def _take(place: int, words: list[str], time_s: float, sieve: Sieve) -> None:
    """One aircraft into the sieve."""
    if len(words) < VALUES:
        sieve.drop(DAMAGED, f"line {place}: CRE with {len(words)} values of {VALUES}")
        return
    callsign, _, *numbers = words
    latitude, longitude = (_degrees(word) for word in numbers[:2])
    heading, altitude = _number(numbers[2]), _altitude_m(numbers[3])
    sieve.heard[callsign] += 1
    if latitude is None or longitude is None:
        sieve.drop(NO_POSITION, f"line {place}: {callsign} begins at {' '.join(numbers[:2])[:40]}")
        return
    speed = _speed_mps(numbers[4], altitude or 0.0)
    # A script that says so is wrong as a whole: no receiver was mistaken here.
    if (
        not LOWEST_FLIGHT_M <= (altitude or 0.0) <= HIGHEST_FLIGHT_M
        or not (speed or 0.0) <= FASTEST_READ_MPS
    ):
        sieve.drop(IMPOSSIBLE)
        return
    sieve.take(
        TrafficReport(
            time_s=time_s,
            address=callsign,
            latitude_deg=latitude,
            longitude_deg=longitude,
            altitude_m=altitude,
            altitude_kind=None if altitude is None else "geometric",
            geometric_altitude_m=altitude,
            ground_speed_mps=speed,
            track_rad=None if heading is None else math.radians(heading) % (2.0 * math.pi),
            callsign=callsign,
            source="scripted",
        )
    )


def _degrees(word: str) -> float | None:
    """Degrees with or without N, S, E, W; names of airports have no place here."""
    found = PLACE.fullmatch(word)
    if found is None:
        return None
    value = float(found[2])
    return -value if found[1].upper() in ("S", "W") else value


def _altitude_m(word: str) -> float | None:
    """Feet, or a flight level in hundreds of feet."""
    level = re.fullmatch(r"FL(\d+)", word, re.IGNORECASE)
    feet = 100.0 * float(level[1]) if level else _number(word)
    return None if feet is None else feet * FOOT_M


def _speed_mps(word: str, altitude_m: float) -> float | None:
    """True air speed of a Mach number or a calibrated air speed in knots."""
    value = _number(word)
    if value is None or value < 0.0:
        return None
    if value > FASTEST_KT:
        return math.inf  # left out as impossible
    pressure, temperature = _air(min(max(altitude_m, AIR_LOWEST_M), AIR_HIGHEST_M))
    if value <= LARGEST_MACH:
        return value * math.sqrt(1.4 * GAS_CONSTANT * temperature)
    density = pressure / (GAS_CONSTANT * temperature)
    ground_pressure, ground_temperature = _air(0.0)
    ground_density = ground_pressure / (GAS_CONSTANT * ground_temperature)
    squared = (value * KNOT_MPS) ** 2 * ground_density / (7.0 * ground_pressure)
    impact = ground_pressure * ((1.0 + squared) ** 3.5 - 1.0)
    return math.sqrt(7.0 * pressure / density * ((1.0 + impact / pressure) ** (2.0 / 7.0) - 1.0))


def _air(altitude_m: float) -> tuple[float, float]:
    """Pressure in Pa and temperature in K of the standard atmosphere, up to 20 km."""
    if altitude_m <= TROPOPAUSE_M:
        temperature = 288.15 - 0.0065 * altitude_m
        return 101_325.0 * (temperature / 288.15) ** 5.25588, temperature
    fall = 9.80665 * (altitude_m - TROPOPAUSE_M) / (GAS_CONSTANT * 216.65)
    return 22_632.06 * math.exp(-fall), 216.65


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None
