"""What a traffic recording holds: one value for each report of a position, SI at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, NamedTuple

from clearway.base.brief import brief

AltitudeKind = Literal["barometric", "geometric", "ground"]
Source = Literal[
    "adsb", "adsr", "tisb", "mlat", "mode s", "flarm", "remote id", "scripted", "unknown"
]
"""Who measured: the aircraft (rebroadcast or not, by whichever radio), a radar, receivers on the
ground, a script."""
Clock = Literal["utc", "relative"]

NOT_ICAO = "~"
"""First character of an address that no state has given out: anonymous, or a radar's track."""


class TrafficReport(NamedTuple):
    """One report of where one aircraft was; a tuple, since recordings hold very many."""

    time_s: float
    """Of the position, on the clock of the recording."""
    address: str
    """Six hexadecimal digits in lower case, after `~` if not an ICAO address; a name in scripts."""
    latitude_deg: float
    """WGS 84."""
    longitude_deg: float
    altitude_m: float | None = None
    """As `altitude_kind` says; None where unknown and on the ground."""
    altitude_kind: AltitudeKind | None = None
    """Barometric: above the 1013.25 hPa level; geometric: above the ellipsoid, or above sea level
    by GPS where a note says so of the whole recording; None: unknown."""
    geometric_altitude_m: float | None = None
    """Also stated, above the ellipsoid; the same as `altitude_m` where that is geometric."""
    ground_speed_mps: float | None = None
    track_rad: float | None = None
    """Over ground, clockwise from north."""
    vertical_rate_mps: float | None = None
    """Up positive."""
    callsign: str = ""
    source: Source = "unknown"

    @property
    def barometric_altitude_m(self) -> float | None:
        return self.altitude_m if self.altitude_kind == "barometric" else None


def nothing() -> Mapping[str, int]:
    """No counts."""
    return MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class TrafficRecording:
    """All of one file: every message is a report, was of use to others, or is left out."""

    source: str
    format: str
    clock: Clock
    """`utc`: seconds since 1970; `relative`: since the start of the recording."""
    messages: int
    """Messages, rows or frames read; the sum of reports, `of_use` and `left_out`."""
    reports: tuple[TrafficReport, ...]
    """By time."""
    of_use: Mapping[str, int] = field(default_factory=nothing)
    """Messages without a position of their own, by what they tell."""
    left_out: Mapping[str, int] = field(default_factory=nothing)
    """Messages left out, by reason."""
    heard: Mapping[str, int] = field(default_factory=nothing)
    """Messages by address, of those that name it beyond doubt."""
    own_address: str | None = None
    """Where the file says whose recording it is."""
    notes: tuple[str, ...] = ()
    """What was assumed, or found odd; to be shown."""

    __repr__ = brief
