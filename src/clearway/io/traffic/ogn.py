"""Lines of the Open Glider Network (APRS): FLARM, OGN trackers and others, as servers send them.

`FLRDDA5BA>OGFLR,qAS,LFMX:/160829h4415.41N/00600.03E'342/049/A=005524 !W52! id06DDA5BA -454fpm ...`
"""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.foreign import note_unended
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    NO_ADDRESS,
    NO_POSITION,
    Sieve,
    address_of,
)
from clearway.traffic.recorded.report import NOT_ICAO, TrafficRecording, TrafficReport

FORM = "Open Glider Network (APRS)"
LINE = re.compile(
    r"(?:(?P<logged>\d{4}-\d\d-\d\dT[\d:.]+(?:Z|[+-]\d\d:?\d\d)?)[\s,;]+)?"
    r"(?P<call>[A-Za-z0-9-]{1,12})>(?P<route>[^:\s]{1,120}):(?P<body>.*)"
)
PLACE = re.compile(
    r"/(?P<hour>\d\d)(?P<minute>\d\d)(?P<second>\d\d)h"
    r"(?P<lat>\d\d)(?P<lat_min>\d\d\.\d\d)(?P<ns>[NS])."
    r"(?P<lon>\d{3})(?P<lon_min>\d\d\.\d\d)(?P<ew>[EW])."
    r"(?:(?P<course>\d{3})/(?P<speed>\d{3}))?(?:/?A=(?P<feet>-?\d{5,6}))?(?P<more>.*)"
)
FINER = re.compile(r"!W(\d)(\d)!")
WHO = re.compile(r"\bid([0-9A-Fa-f]{2})([0-9A-Fa-f]{6})\b")
CLIMB = re.compile(r"([-+]\d+)fpm\b")
LEVEL = re.compile(r"\bFL(-?\d{3}\.\d\d)\b")
HEAD = re.compile(
    rb"^(?:\d{4}-\d\d-\d\dT\S+[\s,;]+)?[A-Za-z0-9-]{1,12}>[^:\s]{1,120}:/\d{6}h\d{4}\.\d\d[NS]",
    re.MULTILINE,
)
"""A line with a place."""
ICAO = 1
NOT_TRACKED = 0x40
DAY_S = 86_400.0
HALF_DAY_S = 43_200.0
FINER_DEG = 0.001 / 60.0
MOST_LINE = 2_000


def is_ogn(head: bytes) -> bool:
    """Whether a line is one of a position."""
    return HEAD.search(head) is not None


class Days:
    """Seconds since 1970, or since midnight of the first day, of times that tell no day."""

    def __init__(self) -> None:
        self._last_s: float | None = None
        self.dated = False

    def moment(self, second: float, logged: str | None) -> float:
        """The day nearest to when the line was logged, else to the line before."""
        near = self._last_s
        if logged:
            stamp = datetime.fromisoformat(logged)
            near = (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
            self.dated = True
        if near is None:
            near = second
        self._last_s = second + DAY_S * round((near - second) / DAY_S)
        return self._last_s


def read_ogn(source: str, content: bytes) -> TrafficRecording:
    """Reports of positions; lines may begin with the date and time at which they were logged.

    Raises InputError where some lines are dated and others are not.
    """
    sieve, days = Sieve(source), Days()
    lines = content.decode("utf-8", "replace").splitlines()
    sieve.notes.extend(note_unended(content))
    undated = False
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        found = LINE.fullmatch(text[:MOST_LINE])
        if found is None and number == len(lines) and not content.endswith(b"\n"):
            sieve.cut_off(f"line {number}, the last one: {text[:20]!r} ...")
            continue
        if found is None:
            sieve.drop(DAMAGED, f"line {number}: {text[:40]!r}")
            continue
        undated |= found["logged"] is None
        _take(found, f"line {number}", days, sieve)
    if days.dated and undated:
        raise InputError(source, "some lines begin with a date and others do not; valid: all, none")
    if not days.dated:
        sieve.notes.append("times are seconds since midnight UTC: the lines tell no day")
    sieve.notes.append("altitudes are above sea level by GPS, all alike; told as geometric")
    return sieve.recording(FORM, "utc" if days.dated else "relative")


def _take(line: re.Match[str], number: str, days: Days, sieve: Sieve) -> None:
    body = line["body"]
    if body.startswith(">"):
        sieve.use("status")
        return
    place, who = PLACE.fullmatch(body), WHO.search(body)
    if who is None and ("TCPIP*" in line["route"] or place is not None):
        if "TCPIP*" in line["route"]:
            sieve.use("position of a receiver")
        else:
            sieve.drop(NO_ADDRESS)
        return
    if place is None or who is None:
        sieve.drop(NO_POSITION, f"{number}: {body[:40]!r}")
        return
    try:
        hour, minute, second = (float(place[name]) for name in ("hour", "minute", "second"))
        if hour > 23.0 or minute > 59.0 or second > 60.0:
            raise ValueError("no time of day")
        time_s = days.moment(3600.0 * hour + 60.0 * minute + second, line["logged"])
    except (ValueError, OverflowError) as cause:
        sieve.drop(DAMAGED, f"{number}: {cause}")
        return
    flags = int(who[1], 16)
    address = address_of(("" if flags & 3 == ICAO else NOT_ICAO) + who[2])
    sieve.heard[address] += 1
    if flags & NOT_TRACKED:
        sieve.odd("asks not to be tracked: use it to keep clear alone")
    sieve.take(_report(place, time_s, address))


def _report(place: re.Match[str], time_s: float, address: str) -> TrafficReport:
    finer, climb = FINER.search(place["more"]), CLIMB.search(place["more"])
    level = LEVEL.search(place["more"])
    latitude = _degrees(place["lat"], place["lat_min"], finer and finer[1], place["ns"] == "S")
    longitude = _degrees(place["lon"], place["lon_min"], finer and finer[2], place["ew"] == "W")
    height = None if place["feet"] is None else float(place["feet"]) * FOOT_M
    pressure = None if level is None else 100.0 * float(level[1]) * FOOT_M
    altitude = height if pressure is None else pressure
    speed = None if place["speed"] is None else float(place["speed"]) * KNOT_MPS
    # A course of 000 is reported where there is none; 360 is north.
    course = float(place["course"]) if speed and place["course"] != "000" else None
    return TrafficReport(
        time_s,
        address,
        latitude,
        longitude,
        altitude,
        None if altitude is None else "geometric" if pressure is None else "barometric",
        height,
        speed,
        None if course is None else math.radians(course % 360.0),
        None if climb is None else float(climb[1]) * FOOT_PER_MINUTE_MPS,
        "",
        "flarm",
    )


def _degrees(whole: str, minutes: str, finer: str | None, negative: bool) -> float:
    """Degrees and minutes, of which a third decimal may stand in the comment."""
    value = float(whole) + float(minutes) / 60.0 + FINER_DEG * float(finer or 0)
    return -value if negative else value
