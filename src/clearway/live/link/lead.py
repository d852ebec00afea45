"""How far ahead a vehicle is led: to be where its plan has it, no faster than its own speed.

Autopilots differ: one takes a set-point on at its velocity, another chases where it was, and a link
takes its time. All of it shows as a time by which the vehicle is late along its way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.base.frames import FloatArray, measure_length
from clearway.base.state import State
from clearway.live.link.set_point import SetPoint
from clearway.vehicle.reference import Reference

LEARNED_PER_S = 0.15
"""Share of the time that the vehicle is late by which it is told earlier, a second: autopilots take
one or two to answer, and what is learned faster swings."""
LONGEST_S = 0.5
"""Between two own positions, or set-points, that are learned from."""
LATEST_S = -0.1
"""Lower bound of what is learned."""
EARLIEST_S = 0.3
"""Upper bound of what is learned."""
LEAST_MPS = 1.0
"""More slowly, a place says little of time."""
MOST_LEAD_S = 0.4
"""Of flight at the own speed, by which a place lies ahead of the vehicle at most."""
CATCHES_UP_S = 2.0
"""By which a place may lie ahead for every m/s that the vehicle is slower than its own speed."""
TILTS_S = 0.4
"""Before its own speed an acceleration ends: vehicles tilt back late."""
NEAR = 0.25
"""Share of the own speed within which a vehicle flies at it, and what it lacks is learned from."""
LACK_LEARNED_PER_S = 1.5
"""Seconds of lead learned in a second, for every own speed that it lacks."""
MOST_LEARNED_S = 0.3
"""An autopilot answers no later, where what it is commanded is to be flown at once."""
FOR_ALL = 0.95
"""Share of the own speed from which a plan asks for all of it."""
HOLD_LEAD_S = 1.0
"""The same as `MOST_LEAD_S` where a vehicle is commanded to hold: it slows down by itself."""


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


class OwnSpeed:
    """Ask `limit` for every set-point of one vehicle, in turn.

    Autopilots add about 1 m/s for every metre by which a place lies ahead, to the velocity that
    comes with it. So the place of a vehicle at its own speed is the one where it is when the
    set-point comes to count, and a slower one is led farther ahead. One that answers late would be
    drawn back to where it was: its lateness is learned from how much slower it stays.
    """

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps
        self._late_s = 0.0  # By which it answers later, as learned.
        self._limited_s = -np.inf  # When the last set-point counted.

    def limit(self, point: SetPoint, own: State, own_mps: FloatArray, counts_s: float) -> SetPoint:
        """Return what a vehicle follows from where it is without flying faster than its own speed.

        own_mps: [3] at the own state. counts_s: when the set-point counts, in the mean.
        """
        age_s = max(0.0, counts_s - own.time_s)
        ahead, faster = point.position_m - own.position_m, point.acceleration_mps2
        lead_s = HOLD_LEAD_S
        if point.velocity_mps is not None:
            asked_mps = measure_length(point.velocity_mps)
            along = point.velocity_mps / max(asked_mps, 1e-9)
            lacks_mps = self._speed_mps - measure_length(own_mps)
            if asked_mps >= FOR_ALL * self._speed_mps:
                reaches = float(ahead @ along) > asked_mps * (age_s + self._late_s)
                self._learn(lacks_mps if reaches else 0.0, counts_s)
            slower_mps, lead_s = max(0.0, lacks_mps), MOST_LEAD_S + age_s
            most_m = CATCHES_UP_S * slower_mps + asked_mps * (age_s + self._late_s)
            ahead = ahead - max(0.0, float(ahead @ along) - most_m) * along
            if faster is not None:
                most_mps2 = slower_mps / TILTS_S
                faster = faster - max(0.0, float(faster @ along) - most_mps2) * along
        apart_m = measure_length(ahead)
        share = min(1.0, self._speed_mps * lead_s / max(apart_m, 1e-9))
        return replace(point, position_m=own.position_m + share * ahead, acceleration_mps2=faster)

    def _learn(self, lacks_mps: float, counts_s: float) -> None:
        since_s, self._limited_s = counts_s - self._limited_s, counts_s
        share = lacks_mps / self._speed_mps
        if abs(share) <= NEAR and 0.0 < since_s <= LONGEST_S:
            learned_s = self._late_s + LACK_LEARNED_PER_S * since_s * share
            self._late_s = float(np.clip(learned_s, 0.0, MOST_LEARNED_S))
