"""How far ahead on its plan a vehicle is to be told, so that it is where the plan has it.

Autopilots differ: one takes a set-point on at its velocity, another chases where it was, and a link
takes its time. All of it shows as a time by which the vehicle is late along its way.
"""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray, measure_length
from clearway.vehicle.reference import Reference

LEARNED_PER_S = 0.15
"""Share of the time that the vehicle is late by which it is told earlier, a second: autopilots take
one or two to answer, and what is learned faster swings."""
LONGEST_S = 0.5
"""Between two own positions that are learned from."""
LATEST_S, EARLIEST_S = -0.1, 0.3
"""Bounds of what is learned."""
LEAST_MPS = 1.0
"""More slowly, a place says little of time."""


class LeadTime:
    """Feed it with own positions, and ask `seconds`."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        """How far ahead set-points are."""
        self._taken_s = -np.inf

    def take(self, time_s: float, place_m: FloatArray, asked: Reference) -> None:
        """An own position [3] of a time, and what was asked for then."""
        speed = measure_length(asked.velocity_mps)
        since_s, self._taken_s = time_s - self._taken_s, max(time_s, self._taken_s)
        if speed < LEAST_MPS or not 0.0 < since_s <= LONGEST_S:
            return
        late_s = float((asked.position_m - place_m) @ asked.velocity_mps) / speed**2
        late_s = float(np.clip(late_s, LATEST_S, EARLIEST_S))
        learned = self.seconds + LEARNED_PER_S * since_s * late_s
        self.seconds = float(np.clip(learned, LATEST_S, EARLIEST_S))
