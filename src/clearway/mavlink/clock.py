"""The vehicle's clock as we know it: its time since boot, by the messages that tell it.

Messages arrive late by what the link takes; the least delay seen so far ties our monotonic clock to
the vehicle's. What comes late is old, not from another time: a clock that runs backwards, or leaps
ahead of the least delay, is another matter and is told.
"""

from __future__ import annotations

from enum import StrEnum

WRAP_S = 2**32 / 1000.0
"""Milliseconds since boot are counted in 32 bits."""
TOLERANCE_S = 1.0
"""Steps back or ahead beyond this are no jitter."""
LEAP_S = 10.0
"""The same ahead, where the vehicle's clock does not follow ours."""
FORGOTTEN_S = 60.0
"""Nor is a leap ahead by more the same flight: counters wrap, so a restart may look like one."""
DRIFT = 1e-3
"""How fast the two clocks may drift apart."""
STRAYS = 5
"""So many messages in a row from another time are one: fewer may be stray."""


class Tick(StrEnum):
    """What a message says of the clock."""

    GOOD = "good"
    STRAY = "clock: from another time"
    LEAPT = "clock: leapt ahead"
    RESTARTED = "clock: began anew"


class VehicleClock:
    """Seconds since the vehicle's boot; `speedup` 1 but in simulation, None for lock-step.

    In lock-step the vehicle's time stands still between messages.
    """

    def __init__(self, speedup: float | None = 1.0) -> None:
        self._speedup = speedup
        self._newest_s = 0.0
        self._heard_s = 0.0
        self._delay_s: float | None = None
        self._strays = 0

    @property
    def newest_s(self) -> float:
        """The newest time told."""
        return self._newest_s

    def now(self, wall_s: float) -> float:
        """The vehicle's time at a moment of our monotonic clock."""
        if self._speedup is None or self._delay_s is None:
            return self._newest_s
        return max(self._newest_s, wall_s * self._speedup - self._delay_s)

    def time_of(self, boot_ms: int) -> float:
        """A time since boot in seconds, without the wrap of its counter."""
        time_s = boot_ms / 1000.0
        return time_s + round((self._newest_s - time_s) / WRAP_S) * WRAP_S

    def boot_ms(self, time_s: float) -> int:
        """The counter at a time."""
        return round(time_s * 1000.0) % 2**32

    def take(self, boot_ms: int, wall_s: float) -> Tick:
        """Learn from a message that came at a moment; only what is GOOD or LEAPT may be used."""
        if self._delay_s is None:
            self._newest_s = boot_ms / 1000.0
            self._anchor(wall_s)
            return Tick.GOOD
        time_s = self.time_of(boot_ms)
        back = time_s < self._newest_s - TOLERANCE_S
        if not (back or self._is_ahead(time_s, wall_s)):
            self._strays = 0
            self._newest_s = max(self._newest_s, time_s)
            self._tie(wall_s, time_s)
            return Tick.GOOD
        self._strays += 1
        if self._strays < STRAYS:
            return Tick.STRAY
        if back or time_s > self.now(wall_s) + FORGOTTEN_S:
            return Tick.RESTARTED
        self._strays, self._newest_s = 0, time_s
        self._anchor(wall_s)
        return Tick.LEAPT

    def _is_ahead(self, time_s: float, wall_s: float) -> bool:
        if self._speedup is None:
            return time_s > self._newest_s + LEAP_S
        return time_s > self.now(wall_s) + TOLERANCE_S * max(1.0, self._speedup)

    def _anchor(self, wall_s: float) -> None:
        self._delay_s = wall_s * (self._speedup or 0.0) - self._newest_s
        self._heard_s = wall_s

    def _tie(self, wall_s: float, time_s: float) -> None:
        """Keep the least delay, which may grow as clocks drift."""
        speedup = self._speedup or 0.0
        grown = (self._delay_s or 0.0) + DRIFT * speedup * max(0.0, wall_s - self._heard_s)
        self._delay_s = min(grown, wall_s * speedup - time_s)
        self._heard_s = wall_s
