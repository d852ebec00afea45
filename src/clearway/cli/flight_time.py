"""Times of a live session in words: seconds since its beginning, and once when that was."""

from __future__ import annotations

from datetime import UTC, datetime

UNIX_S = 1e9
"""Clocks beyond this count from 1970, as those of recordings and of ROS 2 do."""


class FlightTime:
    """One clock for all lines of a session: flight time where the vehicle's counts from 1970."""

    def __init__(self) -> None:
        self._begin_s: float | None = None

    def begin(self, time_s: float) -> str | None:
        """Take the first time; what to say of it, once, where times are counted from there."""
        if self._begin_s is not None or not time_s:
            return None
        self._begin_s = time_s if time_s >= UNIX_S else 0.0
        if not self._begin_s:
            return None
        when = datetime.fromtimestamp(time_s, UTC)
        return f"0.0 s is {when:%Y-%m-%d %H:%M:%S} UTC"

    def words(self, time_s: float) -> str:
        """A time as `12.3 s`."""
        return f"{max(0.0, time_s - (self._begin_s or 0.0)):.1f} s"
