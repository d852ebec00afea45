"""Moments of time as people write them."""

from __future__ import annotations

import math
from datetime import UTC, datetime

from clearway.base.errors import InputError

MOST_SECONDS = 1e11
"""Since 1970; later moments are in no calendar."""


def moment(source: str, text: str) -> datetime:
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
