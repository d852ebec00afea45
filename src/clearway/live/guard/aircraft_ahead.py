"""Whether a velocity that is kept up keeps clear of aircraft until they have passed.

A leg of half a second says nothing of an aircraft that crosses in ten. A wish is therefore flown on
in thought, straight, until everyone has come closest; where that is too close, the nearest velocity
that keeps clear takes its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton

LOOKS_S = 15.0
"""How far ahead a wish is flown on: nobody wishes the same for longer."""
DIRECTIONS = 16
"""Of the level velocities that are tried."""
SPEED_SHARES = (0.5, 1.0)
"""Of the greatest speed, their speeds."""
SPARE = 0.15
"""Share of what is to be kept that another velocity keeps beyond it: it is not exchanged again at
the next tick."""


@dataclass(frozen=True)
class AircraftAhead:
    """How near velocities come to aircraft, if they are changed to now and kept up."""

    place_m: FloatArray
    """[3] own, world frame."""
    velocity_mps: FloatArray
    """[3] own."""
    intruders: Sequence[Intruder]
    """At their places now."""
    margin_m: float
    sigmas: float
    acceleration_mps2: float

    def spare_m(self, velocities_mps: FloatArray) -> FloatArray:
        """[n] by how much each velocity [n, 3] keeps more than is asked from all; inf without any.

        Notes
        -----
        A change dv at an acceleration a leaves the vehicle dv |dv| / 2a behind.
        """
        spare = np.full(len(velocities_mps), np.inf)
        change = velocities_mps - self.velocity_mps
        size = np.linalg.norm(change, axis=1)
        behind = change * (size / (2.0 * self.acceleration_mps2))[:, None]
        for other in self.intruders:
            apart = other.position_m - self.place_m + behind
            closing = other.velocity_mps - velocities_mps
            squared = np.maximum((closing**2).sum(axis=1), 1e-12)
            when = np.clip(-(apart * closing).sum(axis=1) / squared, 0.0, LOOKS_S)
            nearest = np.linalg.norm(apart + when[:, None] * closing, axis=1)
            unsure = self.sigmas * (other.position_std_m + other.velocity_std_mps * when)
            spare = np.minimum(spare, nearest - self._distance_to_keep_m(other) - unsure)
        return spare

    def nearest_clear(
        self, wished_mps: FloatArray, automaton: MovementAutomaton
    ) -> FloatArray | None:
        """The velocity [3] nearest to a wished one that keeps clear, or comes least close; None
        where the wished one does."""
        if not self.intruders or float(self.spare_m(wished_mps[None])[0]) >= 0.0:
            return None
        tried = _velocities(automaton)
        spare = self.spare_m(tried)
        clear = np.flatnonzero(
            spare >= SPARE * max(self._distance_to_keep_m(one) for one in self.intruders)
        )
        best = int(np.argmax(spare))
        if len(clear):
            off = np.linalg.norm(tried[clear] - wished_mps, axis=1)
            best = int(clear[int(np.argmin(off))])
        found: FloatArray = tried[best]
        return found

    def _distance_to_keep_m(self, other: Intruder) -> float:
        return self.margin_m + other.radius_m


def _velocities(automaton: MovementAutomaton) -> FloatArray:
    """[n, 3] that a vehicle that can stop can fly: all round, up and down, and none."""
    climb = _climbs(automaton)
    speeds = [share * automaton.fastest_mps for share in SPEED_SHARES]
    bearings = [math.tau * n / DIRECTIONS for n in range(DIRECTIONS)]
    level = [(v * math.cos(at), v * math.sin(at)) for v, at in product(speeds, bearings)]
    ways = [(*way, up) for way, up in product([(0.0, 0.0), *level], (0.0, *climb))]
    return np.array(ways)


def _climbs(automaton: MovementAutomaton) -> tuple[float, float]:
    """Fastest rates of sinking and climbing."""
    classes = automaton.classes
    if classes is not None:
        return float(classes.climb_mps.min()), float(classes.climb_mps.max())
    rates = [movement.climb_mps or 0.0 for movement in automaton.movements]
    return min(rates), max(rates)
