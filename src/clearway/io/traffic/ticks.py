"""Clocks of receivers of Mode S: counters of six bytes, made into seconds since the first."""

from __future__ import annotations

from dataclasses import dataclass

TICK_HZ = 12_000_000
COUNTS = 2**48
NANOSECOND_BITS = 30
"""Of a GPS time: nanoseconds below, seconds of the day above."""
NANOSECONDS = 1_000_000_000
DAY_NS = 86_400_000_000_000
LATE_S = 60
"""Receivers pass on frames late by up to this; what goes back further was started anew."""
PAUSE_S = 3_600
"""Assumed between the end of one count and the start of the next, so that nothing is paired."""


@dataclass(slots=True)
class TickClock:
    """Seconds since the first frame, of counters in the order of the frames."""

    gps: bool = False
    """Whether counters are GPS times of day instead of 12 MHz ticks."""
    restarts: int = 0
    frames: int = 0
    stands: bool = True
    """Whether every frame has the same time."""
    _first: int = 0
    """In units of the clock, as all that follows."""
    _base: int = 0
    """What to add to a counter, for all times that it began again."""
    _last: int = 0

    def seconds(self, ticks: int) -> float:
        """Time of a frame since the first one."""
        second, period = (NANOSECONDS, DAY_NS) if self.gps else (TICK_HZ, COUNTS)
        count = self._base + self._count(ticks)
        if not self.frames:
            self._first = self._last = count
        self.frames += 1
        self.stands &= count == self._first
        if count < self._last - period // 2:
            self._base += period
            count += period
        elif count > self._last + period // 2:
            return (count - period - self._first) / second  # late, from before it ran over
        elif count < self._last - LATE_S * second:
            self.restarts += 1
            pause = self._last + PAUSE_S * second - count
            self._base += pause
            count += pause
        self._last = max(self._last, count)
        return (count - self._first) / second

    def notes(self) -> tuple[str, ...]:
        """What was found odd, and assumed."""
        if not self.restarts:
            return ()
        return (
            f"the receiver's clock started anew {self.restarts} times: {PAUSE_S // 60} minutes "
            "are assumed in between each time",
        )

    def _count(self, ticks: int) -> int:
        if not self.gps:
            return ticks
        whole, nanoseconds = divmod(ticks, 1 << NANOSECOND_BITS)
        return whole * NANOSECONDS + nanoseconds
