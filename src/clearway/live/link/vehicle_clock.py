"""The vehicle's clock as we know it: a time of its own, by the messages that tell it.

Messages arrive late by what the link takes; the least delay of the last while ties our monotonic
clock to the vehicle's. What comes late is old, not from another time: a clock that runs backwards,
or leaps ahead of the least delay, is another matter and is told. A vehicle that stalls is later
from then on: the delay is found anew, slowly, since a link that is slow for a moment looks alike.
"""

from __future__ import annotations

import math
from collections import deque
from enum import StrEnum

TOLERANCE_S = 1.0
"""Steps back or ahead beyond this are no jitter."""
LEAP_S = 10.0
"""The same ahead, where the vehicle's clock does not follow ours."""
FORGOTTEN_S = 60.0
"""Nor is a leap ahead by more the same flight: counters wrap, so a restart may look like one."""
STRAYS = 5
"""So many messages in a row from another time are one: fewer may be stray."""
SPAN_S = 1.0
"""Of the vehicle's time, whose least delay is kept as one number."""
SPANS = 3
"""The least delay is that of so many spans, the present one included: 2 to 3 s."""
SLEWED = 0.5
"""Share of its speed by which the clock is held back until it has the later time."""
RECENT_S = 1.0
"""The delay of what came last is the least one of this time."""


class Tick(StrEnum):
    """What a message says of the clock."""

    GOOD = "good"
    STRAY = "clock: from another time"
    LEAPT = "clock: leapt ahead"
    RESTARTED = "clock: began anew"


class VehicleClock:
    """Seconds by the vehicle's clock; `speedup` 1 but in simulation, None for lock-step.

    In lock-step the vehicle's time stands still between messages.
    """

    def __init__(self, speedup: float | None = 1.0) -> None:
        self._speedup = speedup
        self._newest_s = 0.0
        self._began = False
        self._spans: deque[tuple[float, float]] = deque(maxlen=SPANS)
        """Beginning by our clock, and least delay."""
        self._recent: deque[tuple[float, float]] = deque()
        """By our clock, and delay: each less than all later ones."""
        self._asked: tuple[float, float] | None = None
        self._strays = 0

    @property
    def newest_s(self) -> float:
        """The newest time told."""
        return self._newest_s

    def now(self, wall_s: float) -> float:
        """The vehicle's time at a moment of our monotonic clock; it never runs back."""
        if self._speedup is None or not self._began:
            return self._newest_s
        now = wall_s * self._speedup - self._delay_s
        if self._asked is not None:
            passed_s = max(0.0, wall_s - self._asked[0]) * self._speedup
            now = max(now, self._asked[1] + (1.0 - SLEWED) * passed_s)
        now = max(self._newest_s, now)
        self._asked = (wall_s, now)
        return now

    def estimate_arrival(self, wall_s: float) -> float:
        """The vehicle's time of what arrives now and tells none, if it took as long as the last."""
        if self._speedup is None or not self._recent:
            return self._newest_s
        delays = (delay for at, delay in self._recent if wall_s - at <= RECENT_S)
        latest = self._recent[-1][1]
        return max(self._newest_s, wall_s * self._speedup - min(delays, default=latest))

    def take(self, time_s: float, wall_s: float) -> Tick:
        """Learn from a message that came at a moment; only what is GOOD or LEAPT may be used."""
        if not self._began:
            self._anchor(time_s, wall_s)
            return Tick.GOOD
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
        self._strays = 0
        self._anchor(time_s, wall_s)
        return Tick.LEAPT

    def _is_ahead(self, time_s: float, wall_s: float) -> bool:
        if self._speedup is None:
            return time_s > self._newest_s + LEAP_S
        return time_s > self.now(wall_s) + TOLERANCE_S * max(1.0, self._speedup)

    @property
    def _delay_s(self) -> float:
        return min((delay for _, delay in self._spans), default=math.inf)

    def _anchor(self, time_s: float, wall_s: float) -> None:
        self._began, self._newest_s, self._asked = True, time_s, None
        self._spans.clear()
        self._recent.clear()
        self._tie(wall_s, time_s)

    def _tie(self, wall_s: float, time_s: float) -> None:
        """Keep the least delay of the present span, and those of the ones before."""
        delay = wall_s * (self._speedup or 0.0) - time_s
        if not self._spans or wall_s - self._spans[-1][0] >= SPAN_S / (self._speedup or 1.0):
            self._spans.append((wall_s, delay))
        elif delay < self._spans[-1][1]:
            self._spans[-1] = (self._spans[-1][0], delay)
        while self._recent and self._recent[-1][1] >= delay:
            self._recent.pop()
        self._recent.append((wall_s, delay))
        while wall_s - self._recent[0][0] > RECENT_S:
            self._recent.popleft()
