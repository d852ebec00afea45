"""Own states of the last while, to place distances where the vehicle was when they were taken."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from clearway.base.frames import wrap_angle
from clearway.base.state import State

KEPT = 64
"""States: some seconds at any usual rate."""


class PastStates:
    """States with the heading of the nose at their time, in the order of time."""

    def __init__(self) -> None:
        self._entries: deque[tuple[State, float]] = deque(maxlen=KEPT)

    @property
    def newest_s(self) -> float:
        """Time of the newest state; -inf before any."""
        return self._entries[-1][0].time_s if self._entries else -math.inf

    def add(self, state: State, heading_rad: float) -> None:
        """The newest; those that are not newer are left out."""
        if not self._entries or state.time_s > self._entries[-1][0].time_s:
            self._entries.append((state, heading_rad))

    def at(self, time_s: float, within_s: float) -> tuple[State, float] | None:
        """State and heading at a time, between those known; None if none is within that time."""
        entries = self._entries
        later = next((entry for entry in entries if entry[0].time_s >= time_s), None)
        earlier = next((e for e in reversed(entries) if e[0].time_s <= time_s), None)
        first, last = earlier or later, later or earlier
        if first is None or last is None:
            return None
        if min(abs(time_s - entry[0].time_s) for entry in (first, last)) > within_s:
            return None
        span = last[0].time_s - first[0].time_s
        share = (time_s - first[0].time_s) / span if span > 0.0 else 0.0
        turned = wrap_angle(last[0].attitude_rad - first[0].attitude_rad)
        state = replace(
            first[0],
            position_m=first[0].position_m + share * (last[0].position_m - first[0].position_m),
            attitude_rad=first[0].attitude_rad + share * turned,
            time_s=time_s,
        )
        turn = float(wrap_angle(np.asarray(last[1] - first[1])))
        return state, first[1] + share * turn
