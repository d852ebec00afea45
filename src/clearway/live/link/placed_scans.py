"""Scans of a link, each made for the own state of its time.

They may come before the own state of their time, so they wait until a tick, when all that has come
is known.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable

from clearway.base.state import State
from clearway.live.link.past import PastStates
from clearway.sensors import Scan

ScanMaker = Callable[[State, float], Scan]
"""(own state at the scan's time, yaw of the nose) -> the scan."""
MOST_WAITING = 16
"""Kept until the next tick, the newest."""
OLD_SCAN_S = 0.5
"""How far a scan and an own position may lie apart in time."""

NO_SENSOR = "distances: the mission has no sensor"
TOO_MANY = "distances: more than can be used"
NO_POSITION = "distances: no own position of their time"


class PlacedScans:
    """Takes own states and scans, gives scans with their times."""

    def __init__(self, has_sensor: bool, counts: Counter[str]) -> None:
        self.newest_s = -math.inf
        """Time of the newest scan that was placed."""
        self._has_sensor, self._counts = has_sensor, counts
        self._past = PastStates()
        self._waiting: list[tuple[float, ScanMaker]] = []

    def move(self, state: State, heading_rad: float) -> None:
        """The own state at a new time, and the yaw of the nose."""
        self._past.add(state, heading_rad)

    def take(
        self, told_s: float | None, arrived_s: float, now_s: float, scan_at: ScanMaker
    ) -> None:
        """A scan, which waits until it is placed.

        told_s: when it was taken, by the sensor; arrived_s: the vehicle's time when it came, at the
        delay of the last second, which after a stall is longer than the least one; now_s: at that.
        """
        if not self._has_sensor:
            self._counts[NO_SENSOR] += 1
            return
        if len(self._waiting) == MOST_WAITING:
            self._counts[TOO_MANY] += 1
            self._waiting.pop(0)
        makes_sense = told_s is not None and arrived_s - OLD_SCAN_S <= told_s <= now_s
        self._waiting.append((told_s if makes_sense and told_s is not None else arrived_s, scan_at))

    @property
    def ready(self) -> bool:
        """Whether a scan waits of whose time the own position is known."""
        return any(time_s <= self._past.newest_s for time_s, _ in self._waiting)

    def place_waiting(self) -> list[Scan]:
        """Scans of what has come since the last call."""
        scans: list[Scan] = []
        for time_s, scan_at in self._waiting:
            there = self._past.at(time_s, OLD_SCAN_S)
            if there is None:
                self._counts[NO_POSITION] += 1
                continue
            self.newest_s = max(self.newest_s, time_s)
            scans.append(scan_at(*there))
        self._waiting.clear()
        return scans
