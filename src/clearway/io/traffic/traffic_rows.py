"""What all readers of traffic share: fields checked one by one, every message counted once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from types import MappingProxyType
from typing import Any

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.moments import second_of
from clearway.io.traffic.false_zeros import without_false_zeros
from clearway.traffic.recorded.report import (
    NOT_ICAO,
    AltitudeKind,
    Clock,
    Source,
    TrafficRecording,
    TrafficReport,
)

LOWEST_FLIGHT_M = -1_000.0
HIGHEST_FLIGHT_M = 40_000.0
LATEST_S = 5e10
"""Sixteen centuries from 1970, either way: what calendars can tell."""
FASTEST_READ_MPS = 1_200.0
STEEPEST_MPS = 200.0
TOLD_PLACES = 3
"""Damaged places that are named; the rest are only counted."""
ALIKE_S = 0.6
"""The same position again within this time is the same report, told twice."""

DAMAGED = "damaged"
NO_POSITION = "no position"
NO_ADDRESS = "no address"
NO_TIME = "no time"
IMPOSSIBLE = "impossible value"
DUPLICATE = "told twice"
ELSEWHERE = "another place at the time of another report by that address"
ELSEWHERE_DEG = 0.01
"""Of a great circle: 1.1 km."""
CUT_OFF = "cut off"


class Sieve:
    """Takes the messages of one file one by one; each ends up in exactly one count."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.messages = 0
        self.of_use: Counter[str] = Counter()
        self.left_out: Counter[str] = Counter()
        self.heard: Counter[str] = Counter()
        self.notes: list[str] = []
        self._reports: list[TrafficReport] = []
        self._places: dict[tuple[str, float], tuple[float, float]] = {}
        self._last: dict[str, TrafficReport] = {}
        self._odd: Counter[str] = Counter()

    def drop(self, reason: str, place: str = "", count: int = 1) -> None:
        """Leave messages out; `place` says where, and what is wrong there."""
        self.messages += count
        self.left_out[reason] += count
        if place and self.left_out[reason] <= TOLD_PLACES:
            self.notes.append(place)

    def cut_off(self, place: str) -> None:
        """The last message, of which the end is missing: a recorder that is stopped leaves one."""
        self.drop(CUT_OFF)
        self.notes.append(f"truncated: {place}; left out, all before it was read")

    def complete(
        self, time_s: float | None, address: str, latitude: Any, longitude: Any
    ) -> tuple[float, str, tuple[float, float]] | None:
        """Time, address and place in degrees of a message that tells all; another is dropped."""
        latitude_deg, longitude_deg = number(latitude), number(longitude)
        if address:
            self.heard[address] += 1
        if latitude_deg is None or longitude_deg is None:
            self.drop(NO_POSITION)
        elif not address:
            self.drop(NO_ADDRESS)
        elif time_s is None:
            self.drop(NO_TIME)
        else:
            return time_s, address, (latitude_deg, longitude_deg)
        return None

    def use(self, kind: str, count: int = 1) -> None:
        """Messages that tell something else than a position."""
        self.messages += count
        self.of_use[kind] += count

    def odd(self, what: str) -> None:
        """A message that is kept although something about it is not as it should be."""
        self._odd[what] += 1

    def take(self, report: TrafficReport) -> None:
        """A report with a position, if it can be true and is not reported twice."""
        key = (report.address, report.time_s)
        last = self._last.get(report.address)
        wrong = _impossible_fields(report)
        twice = key in self._places or (last is not None and _is_same(last, report))
        if _is_nowhere(report) or (twice and wrong):
            self.drop(IMPOSSIBLE)
        elif twice and _is_elsewhere(self._places.get(key), report):
            self.drop(ELSEWHERE, f"{report.address} is at two places at one time")
        elif twice:
            self.drop(DUPLICATE)
        else:
            self.messages += 1
            self._places[key] = (report.latitude_deg, report.longitude_deg)
            self._last[report.address] = report
            self._reports.append(self._without(report, wrong) if wrong else report)

    def _without(self, report: TrafficReport, wrong: Sequence[str]) -> TrafficReport:
        """The report with fields that cannot be true taken as unknown, and counted.

        To drop it would hide an aircraft: somebody is there all the same.
        """
        for name in wrong:
            what = name.rpartition("_")[0].replace("_", " ")
            self.odd(f"{what} is impossible, taken as unknown")
        unknown: dict[str, Any] = dict.fromkeys(wrong)
        kept = report._replace(**unknown)
        if "altitude_m" in wrong:
            height_m = kept.geometric_altitude_m
            kind: AltitudeKind | None = None if height_m is None else "geometric"
            kept = kept._replace(altitude_m=height_m, altitude_kind=kind)
        return kept

    def recording(
        self, form: str, clock: Clock = "utc", own_address: str | None = None
    ) -> TrafficRecording:
        """Everything taken in, by time. Raises InputError if most of the file is damaged."""
        if 2 * self.left_out[DAMAGED] > self.messages:
            raise InputError(
                self.source,
                [
                    f"damaged, or not of the format that it looks like ({form}): "
                    f"{self.left_out[DAMAGED]} of {self.messages} messages cannot be read",
                    *self.notes,
                ],
            )
        reports, zeros = without_false_zeros(sorted(self._reports, key=_time))
        if zeros:
            self._odd["altitude is 0 where that is impossible, taken as on the ground"] = zeros
        told = (f"{what}: {count} messages" for what, count in self._odd.items())
        return TrafficRecording(
            source=self.source,
            format=form,
            clock=clock,
            messages=self.messages,
            reports=tuple(reports),
            of_use=MappingProxyType(dict(self.of_use)),
            left_out=MappingProxyType(dict(self.left_out)),
            heard=MappingProxyType(dict(self.heard)),
            own_address=own_address,
            notes=(*self.notes, *told),
        )


def _time(report: TrafficReport) -> float:
    return report.time_s


def _is_nowhere(report: TrafficReport) -> bool:
    """Off the Earth, or at no time; NaN and infinity fail here too."""
    return not (
        abs(report.time_s) <= LATEST_S
        and abs(report.latitude_deg) <= 90.0
        and abs(report.longitude_deg) <= 360.0
    )


def _impossible_fields(report: TrafficReport) -> list[str]:
    """Names of fields beside time and place that cannot be true; NaN never is."""
    altitude_m, geometric_m = report.altitude_m, report.geometric_altitude_m
    speed_mps, rate_mps, track_rad = (
        report.ground_speed_mps, report.vertical_rate_mps, report.track_rad,
    )  # fmt: skip
    found = []
    if altitude_m is not None and not LOWEST_FLIGHT_M <= altitude_m <= HIGHEST_FLIGHT_M:
        found.append("altitude_m")
    if geometric_m is not None and not LOWEST_FLIGHT_M <= geometric_m <= HIGHEST_FLIGHT_M:
        found.append("geometric_altitude_m")
    if speed_mps is not None and not 0.0 <= speed_mps <= FASTEST_READ_MPS:
        found.append("ground_speed_mps")
    if rate_mps is not None and not abs(rate_mps) <= STEEPEST_MPS:
        found.append("vertical_rate_mps")
    if track_rad is not None and not math.isfinite(track_rad):
        found.append("track_rad")
    return found


def _is_same(last: TrafficReport, report: TrafficReport) -> bool:
    return (
        abs(report.time_s - last.time_s) < ALIKE_S
        and report.latitude_deg == last.latitude_deg
        and report.longitude_deg == last.longitude_deg
    )


def _is_elsewhere(place_deg: tuple[float, float] | None, report: TrafficReport) -> bool:
    """Whether a report lies so far from a place of the same time that another aircraft sent it."""
    if place_deg is None:
        return False
    north = abs(report.latitude_deg - place_deg[0])
    east = abs((report.longitude_deg - place_deg[1] + 180.0) % 360.0 - 180.0)
    return max(north, east * math.cos(math.radians(place_deg[0]))) > ELSEWHERE_DEG


def number(value: Any) -> float | None:
    """A number of a file, None if it is none; a truth value or a text is none."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return None


def times(value: Any, factor: float) -> float | None:
    """A number of a file in SI units."""
    given = number(value)
    return None if given is None else given * factor


def epoch_s(value: Any) -> float | None:
    """A moment of a file in seconds since 1970: seconds, or thousandths, millionths, billionths of
    them by their size, or an ISO 8601 date and time, in UTC without a zone; None if it is none."""
    given = number(value)
    if given is not None:
        return given * second_of(given)
    try:
        moment = datetime.fromisoformat(clean_text(value))
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def clean_text(value: Any) -> str:
    return value.strip() if isinstance(value, str) else ""


def address_of(value: Any) -> str:
    """An address as it is written here: lower case, six digits after an optional `~`."""
    word = clean_text(value).lower()
    digits = word.removeprefix(NOT_ICAO)
    if len(digits) != 6 or not set(digits) <= set("0123456789abcdef"):
        return ""
    return word


Altitude = tuple[float | None, AltitudeKind | None, float | None]
"""Altitude, its kind, and the geometric altitude, in metres."""
ON_GROUND: Altitude = (None, "ground", None)


def altitude_of(barometric_ft: Any, geometric_ft: Any, sieve: Sieve) -> Altitude:
    """Of fields in feet; `"ground"` in place of a number is a kind too."""
    geometric = times(geometric_ft, FOOT_M)
    if barometric_ft == "ground":
        return None, "ground", geometric
    barometric = times(barometric_ft, FOOT_M)
    if barometric is not None:
        return barometric, "barometric", geometric
    if isinstance(barometric_ft, str):
        sieve.odd(f"altitude is the text {barometric_ft[:20]!r}, taken as unknown")
    return geometric, None if geometric is None else "geometric", geometric


def report_of(
    time_s: float,
    address: str,
    place_deg: tuple[float, float],
    altitude: Altitude,
    motion: tuple[Any, Any, Any],
    callsign: str,
    source: Source,
) -> TrafficReport:
    """A report of fields in knots, degrees and feet a minute (`motion`: speed, track, rate)."""
    speed_kt, track_deg, rate_fpm = motion
    latitude_deg, longitude_deg = place_deg
    altitude_m, kind, geometric_m = altitude
    return TrafficReport(
        time_s,
        address,
        latitude_deg,
        longitude_deg,
        altitude_m,
        kind,
        geometric_m,
        times(speed_kt, KNOT_MPS),
        times(track_deg, math.pi / 180.0),
        times(rate_fpm, FOOT_PER_MINUTE_MPS),
        callsign,
        source,
    )


SOURCES: Mapping[str, Source] = MappingProxyType(
    {"adsb": "adsb", "adsr": "adsr", "tisb": "tisb", "mlat": "mlat", "mode": "mode s"}
)


def source_of(kind: Any, address: str) -> Source:
    """By readsb's `type` (`adsb_icao`, `tisb_other` ...), else by the address."""
    word = clean_text(kind).split("_")[0]
    if word:
        return SOURCES.get(word, "unknown")
    return "tisb" if address.startswith(NOT_ICAO) else "unknown"
