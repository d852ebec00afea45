"""How far a vehicle that follows its plan was found outside the plan's tube.

The tube is that of the vehicle as declared. One that lags, is carried, or answers late is found
outside of it; the margin then grows by as much, and with it falls the speed near obstacles.
"""

from __future__ import annotations

from collections import deque

WINDOW_S = 10.0
"""For so long a distance outside the tube counts: the time of some turns and brakings."""
HEADROOM = 1.25
"""Of the farthest that was seen: the next one may be farther."""


class Tracking:
    """The farthest outside the tube, of the last seconds."""

    def __init__(self) -> None:
        self._beyond: deque[tuple[float, float]] = deque()

    def take(self, time_s: float, beyond_m: float) -> None:
        """An own state estimate of a time that lies so far outside the tube."""
        while self._beyond and self._beyond[-1][1] <= beyond_m:
            self._beyond.pop()
        self._beyond.append((time_s, beyond_m))

    def excess_m(self, now_s: float) -> float:
        """By how much the tube is taken to be wider than declared."""
        while self._beyond and self._beyond[0][0] < now_s - WINDOW_S:
            self._beyond.popleft()
        return HEADROOM * self._beyond[0][1] if self._beyond else 0.0
