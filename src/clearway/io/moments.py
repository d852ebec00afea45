"""Moments of time as people write them."""

from __future__ import annotations

from datetime import UTC, datetime

from clearway.errors import InputError


def moment(source: str, text: str) -> datetime:
    """An ISO 8601 date and time; without a time zone it is in UTC. InputError where it is none."""
    try:
        value = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            source, f"{text!r} is no date and time; valid: 2025-06-01T12:00Z, in UTC without a zone"
        ) from None
    return value if value.tzinfo else value.replace(tzinfo=UTC)
