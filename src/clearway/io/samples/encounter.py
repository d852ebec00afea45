"""Two light aircraft whose ways cross: what all samples of traffic tell, each in its own form."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

BEGIN_S = 1_767_268_800.0
"""2026-01-01T12:00:00Z."""
LASTS_S = 120
CLOSEST_S = 60.0
LATITUDE = 50.0
LONGITUDE = 8.0
"""Where they meet."""
METRES_A_DEGREE = 111_195.0
KNOT_MPS = 0.514444
FOOT_M = 0.3048


class LightAircraft(NamedTuple):
    """One that flies straight on."""

    address: str
    callsign: str
    track_deg: float
    """Clockwise from north."""
    speed_mps: float
    altitude_m: float
    aside_m: float
    """To the right of the meeting point."""


class Row(NamedTuple):
    """One second of one of them."""

    aircraft: LightAircraft
    after_s: float
    latitude: float
    longitude: float

    @property
    def time_s(self) -> float:
        """Seconds since 1970."""
        return BEGIN_S + self.after_s

    @property
    def altitude_ft(self) -> int:
        """Rounded to the 25 ft of a transponder."""
        return 25 * round(self.aircraft.altitude_m / FOOT_M / 25.0)

    @property
    def speed_kt(self) -> float:
        return self.aircraft.speed_mps / KNOT_MPS


AIRCRAFT = (
    LightAircraft("3c0001", "DEMO1", 90.0, 50.0, 1219.2, 0.0),
    LightAircraft("3c0002", "DEMO2", 0.0, 45.0, 1249.68, 120.0),
)


def rows(lasts_s: int = LASTS_S, step_s: float = 1.0) -> Iterator[Row]:
    """Both, second by second."""
    for number in range(round(lasts_s / step_s) + 1):
        after_s = number * step_s
        for one in AIRCRAFT:
            yield row_at(one, after_s)


def row_at(one: LightAircraft, after_s: float) -> Row:
    """Where an aircraft is."""
    track = math.radians(one.track_deg)
    ahead = one.speed_mps * (after_s - CLOSEST_S)
    north = ahead * math.cos(track) - one.aside_m * math.sin(track)
    east = ahead * math.sin(track) + one.aside_m * math.cos(track)
    latitude = LATITUDE + north / METRES_A_DEGREE
    longitude = LONGITUDE + east / METRES_A_DEGREE / math.cos(math.radians(LATITUDE))
    return Row(one, after_s, latitude, longitude)
