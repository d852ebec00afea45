"""Moments of time as people write them."""

from __future__ import annotations

import math
from bisect import bisect_right
from datetime import UTC, datetime

from clearway.base.errors import InputError

MOST_SECONDS = 1e11
"""Since 1970; later moments are in no calendar."""

GPS_EPOCH_S = 315_964_800.0
"""1980-01-06 in seconds since 1970: when the seconds of GPS begin."""
LEAPS = (
    "1981-07", "1982-07", "1983-07", "1985-07", "1988-01", "1990-01", "1991-01", "1992-07",
    "1993-07", "1994-07", "1996-01", "1997-07", "1999-01", "2006-01", "2009-01", "2012-07",
    "2015-07", "2017-01",
)  # fmt: skip
"""Months before which UTC was held for a second, all since GPS began (IERS Bulletin C)."""


def _leap_s(number: int) -> float:
    """Seconds of GPS at which UTC has been held for so many seconds."""
    month = datetime.fromisoformat(f"{LEAPS[number - 1]}-01").replace(tzinfo=UTC)
    return month.timestamp() - GPS_EPOCH_S + number


_LEAPS_S = tuple(_leap_s(number) for number in range(1, len(LEAPS) + 1))


def utc_of_gps(gps_s: float) -> float:
    """Seconds since 1970 in UTC of seconds since the GPS epoch, by the leap seconds of the date."""
    return GPS_EPOCH_S + gps_s - bisect_right(_LEAPS_S, gps_s)


def parse_moment(source: str, text: str) -> datetime:
    """An ISO 8601 date and time; without a time zone it is in UTC. InputError where it is none."""
    try:
        value = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            source, f"{text!r} is no date and time; valid: 2025-06-01T12:00Z, in UTC without a zone"
        ) from None
    return value if value.tzinfo else value.replace(tzinfo=UTC)


def second_of(count: float) -> float:
    """Seconds of the unit that a time since 1970 is counted in, by its size."""
    if not MOST_SECONDS <= abs(count) < math.inf:
        return 1.0
    return 1e-3 if abs(count) < 1e14 else 1e-6 if abs(count) < 1e17 else 1e-9
