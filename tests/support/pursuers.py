"""Intruders that hunt: truth of a flight, and a search for what can be kept from them at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton

HEARD_AT_M, STEP_S = 12.0, 0.05


@dataclass(frozen=True)
class Hunt:
    """A pursuer as it is first heard of; the ownship is at the origin and flies along x."""

    place_m: FloatArray
    velocity_mps: FloatArray
    turns_rps: float
    """How fast it can turn towards the ownship."""

    @classmethod
    def of(cls, seed: int) -> Hunt:
        rng = np.random.default_rng([77, seed])
        speed = rng.uniform(0.5, 0.9)
        ahead = np.pi if seed % 2 else 0.5 * np.pi
        bearing, up = rng.uniform(-ahead, ahead), rng.uniform(-0.3, 0.3)
        sight = [np.cos(up) * np.cos(bearing), np.cos(up) * np.sin(bearing), np.sin(up)]
        heads = rng.uniform(-np.pi, np.pi)
        course = -np.array(sight)
        if seed % 3 == 0:
            course = np.array([np.cos(heads), np.sin(heads), 0.0])
        turns = float(rng.choice([0.15, 0.26, 0.5, 10.0]))
        return cls(HEARD_AT_M * np.array(sight), speed * course, turns)


def chased(velocity: FloatArray, aim: FloatArray, most_rad: float) -> FloatArray:
    """A velocity turned towards an aim by at most an angle."""
    speed = float(np.linalg.norm(velocity))
    ahead, wanted = velocity / speed, aim / max(float(np.linalg.norm(aim)), 1e-9)
    cosine = float(np.clip(ahead @ wanted, -1.0, 1.0))
    if np.arccos(cosine) <= most_rad:
        return speed * wanted
    aside = wanted - cosine * ahead
    if np.linalg.norm(aside) < 1e-9:
        aside = np.cross(ahead, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside)
    turned: FloatArray = speed * (np.cos(most_rad) * ahead + np.sin(most_rad) * aside)
    return turned


class Pursuer:
    """Traffic of one intruder that heads for where the ownship is, and tells itself each second."""

    name = "pursuer"

    def __init__(self, hunt: Hunt, radius_m: float) -> None:
        self._hunt, self._radius_m = hunt, radius_m
        self._place, self._velocity, self._time_s = hunt.place_m, hunt.velocity_mps, 0.0
        self._told_s = -np.inf
        self.tracks: dict[str, list[tuple[float, FloatArray]]] = {self.name: []}

    def step(self, own: State) -> None:
        steps = int(np.ceil((own.time_s - self._time_s) / STEP_S - 1e-9))
        for _ in range(steps):
            span = (own.time_s - self._time_s) / steps
            most = self._hunt.turns_rps * span
            self._velocity = chased(self._velocity, own.position_m - self._place, most)
            self._place = self._place + span * self._velocity
        self._time_s = own.time_s
        self.tracks[self.name].append((own.time_s, self._place))

    def reports(self, time_s: float) -> list[Intruder]:
        if time_s < self._told_s + 1.0 - 1e-9:
            return []
        self._told_s = time_s
        told = {"radius_m": self._radius_m, "name": self.name, "time_s": time_s}
        return [Intruder(self._place, self._velocity, **told)]  # type: ignore[arg-type]

    def bodies(self, _time_s: float) -> list[Obstacle]:
        return []

    def radii_m(self) -> dict[str, float]:
        return {self.name: self._radius_m}


def can_be_avoided(hunt: Hunt, automaton: MovementAutomaton, keep_m: float, lasts_s: float) -> bool:
    """Whether a turn held for some time, another one, and straight flight keep the distance.

    All pairs of movements and of how long they are held, against the pursuer's own law.
    """
    movements = [m for m in automaton.movements if m.turn_rate_rps]
    straight = next(m for m in automaton.movements if not m.turn_rate_rps)
    duration = straight.duration_s
    most = int(lasts_s / duration)
    for first in movements:
        for held in (0, 2, 4, 6, 8, 10, 12):
            for second in movements if held else movements[:1]:
                for again in (0, 3, 6) if held else (0,):
                    legs = [first] * held + [second] * again
                    legs += [straight] * (most - len(legs))
                    if _kept(hunt, automaton, legs, keep_m):
                        return True
    return False


def _kept(hunt: Hunt, automaton: MovementAutomaton, legs: list, keep_m: float) -> bool:  # type: ignore[type-arg]
    try:
        own = automaton.fly(np.zeros(6), [(leg, leg.duration_s) for leg in legs], STEP_S, 0.0)
    except ValueError:
        return False
    place, velocity = hunt.place_m, hunt.velocity_mps
    for n in range(1, len(own.time_s)):
        span = own.time_s[n] - own.time_s[n - 1]
        velocity = chased(velocity, own.states[n, :3] - place, hunt.turns_rps * span)
        place = place + span * velocity
        if np.linalg.norm(place - own.states[n, :3]) < keep_m:
            return False
    return True
