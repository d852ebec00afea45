"""OBSTACLE_DISTANCE of a flight into scans, each with the attitude of the vehicle at its time.

Distances may come before the own state of their time, so they wait until a tick, when all that has
come is in hand.
"""

from __future__ import annotations

import math
from collections import Counter

from clearway.base.state import State
from clearway.mavlink.dialect import Message
from clearway.mavlink.distances import Sectors, scan_of
from clearway.mavlink.past import PastStates
from clearway.sensors import Lidar, Scan

MOST_WAITING = 16
"""Messages kept until the next tick, the newest."""
OLD_SCAN_S = 0.5
"""How far distances and own position may lie apart in time."""

NO_SENSOR = "distances: the mission has no sensor"
TOO_MANY = "distances: more than can be used"
NO_POSITION = "distances: no own position of their time"


class SectorScans:
    """Takes own states and distances, gives scans of `sensor`; None where the mission has none."""

    def __init__(self, sensor: Lidar | None, counts: Counter[str]) -> None:
        self.newest_s = -math.inf
        """Time of the newest scan that was placed."""
        self._sensor, self._counts = sensor, counts
        self._past = PastStates()
        self._waiting: list[tuple[float, Sectors]] = []

    def move(self, state: State, heading_rad: float) -> None:
        """The own state at a new time, and the yaw of the nose."""
        self._past.add(state, heading_rad)

    def take(self, message: Message, now_s: float) -> None:
        """Distances, which wait until they are placed."""
        if self._sensor is None:
            self._counts[NO_SENSOR] += 1
            return
        sectors = Sectors.of(message, self._counts)
        if sectors is None:
            return
        if len(self._waiting) == MOST_WAITING:
            self._counts[TOO_MANY] += 1
            self._waiting.pop(0)
        self._waiting.append((_measured_at(message.time_usec, now_s), sectors))

    def placed(self) -> list[Scan]:
        """Scans of what has come since the last call."""
        scans: list[Scan] = []
        for time_s, sectors in self._waiting:
            there = self._past.at(time_s, OLD_SCAN_S)
            if there is None or self._sensor is None:
                self._counts[NO_POSITION] += 1
                continue
            self.newest_s = max(self.newest_s, time_s)
            scans.append(scan_of(sectors, self._sensor, *there, self._counts))
        self._waiting.clear()
        return scans


def _measured_at(time_usec: int, now_s: float) -> float:
    """When distances were measured, by a time since boot that makes sense; else now."""
    told = time_usec * 1e-6
    return told if now_s - OLD_SCAN_S <= told <= now_s else now_s
