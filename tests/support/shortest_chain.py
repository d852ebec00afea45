"""The shortest chain of a plane's own movements, searched exhaustively by branch and bound."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.vehicle.automaton import MovementAutomaton

CHORDS, PARTS = 6, 4
"""Chords to a movement that are checked for the goal, and parts of each that its length is of."""
CELL = 0.02
"""Of a movement: states that lie nearer to each other count as one. Over 40 movements that is less
than a sixteenth of the 2 % that are looked for."""
BATCH, MOST_STATES = 512, 150_000
SLACK = 0.995
"""On the bound: a turn whose pitch changes on the way is shorter by up to 0.4 %."""
GREED = 1.15
"""Above 1 chains near the goal are followed first."""


class Way(NamedTuple):
    """A movement from one pitch, in axes along the heading."""

    places_m: FloatArray
    """[chords + 1, 3]"""
    flown_m: FloatArray
    """[chords + 1]"""
    turn_rad: float
    pitch: int
    """At its end, as a number of the table."""


class Open(NamedTuple):
    """Chains that may be flown on; arrays [n]."""

    place_m: FloatArray
    yaw_rad: FloatArray
    pitch: FloatArray
    flown_m: FloatArray
    least_m: FloatArray

    def some(self, at: IntArray | BoolArray) -> Open:
        return Open(*(values[at] for values in self))


class ShortestChains:
    """Looks for chains shorter than one that was flown."""

    def __init__(self, automaton: MovementAutomaton) -> None:
        self._automaton, self._radius_m = automaton, float(automaton.turning_radius_m)
        steepest = automaton.steepest_rad
        assert steepest is not None
        self._pitches = np.linspace(0.0, steepest, 5)
        self._starts, self._ways = [0.0], {}  # type: ignore[var-annotated]

    def _from(self, pitch: int) -> list[Way]:
        if pitch not in self._ways:
            state = np.array([0.0, 0.0, 0.0, 0.0, self._starts[pitch], 0.0])
            allowed = [m for m in self._automaton.movements if self._automaton.allowed(state, m)]
            self._ways[pitch] = [self._way(state, movement) for movement in allowed]
        ways: list[Way] = self._ways[pitch]
        return ways

    def _way(self, state: FloatArray, movement: object) -> Way:
        times = np.linspace(0.0, movement.duration_s, CHORDS * PARTS + 1)  # type: ignore[attr-defined]
        each = self._automaton.predict_each(state, movement, times)  # type: ignore[arg-type]
        flown = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(each[:, :3], axis=0), axis=1)))
        end = float(each[-1, 4])
        known = [n for n, pitch in enumerate(self._starts) if abs(pitch - end) < 1e-6]
        if not known:
            self._starts.append(end)
        at = known[0] if known else len(self._starts) - 1
        return Way(each[::PARTS, :3], flown[::PARTS], float(each[-1, 5]), at)

    def bound_m(self, place_m: FloatArray, yaw_rad: FloatArray, goal: FloatArray) -> FloatArray:
        """[n] what no chain to within a reach radius of a goal [4] is shorter than: a turn at any
        pitch, then a straight climb."""
        way, reach_m, radius = goal[:3] - place_m, goal[3], self._radius_m
        straight = np.linalg.norm(way, axis=1) - reach_m
        ahead = np.cos(yaw_rad) * way[:, 0] + np.sin(yaw_rad) * way[:, 1]
        aside = np.abs(np.cos(yaw_rad) * way[:, 1] - np.sin(yaw_rad) * way[:, 0])
        least = np.full(len(way), np.inf)
        for pitch in self._pitches:
            narrow = radius * np.cos(pitch)
            from_center = np.hypot(ahead, aside - narrow)
            tangent = np.sqrt(np.maximum(from_center**2 - narrow**2, 0.0))
            angle = np.arctan2(aside - narrow, ahead) + np.arctan2(narrow, tangent)
            angle = np.mod(angle + 1e-9, 2.0 * np.pi)
            rise = np.maximum(np.abs(way[:, 2]) - radius * angle * np.sin(pitch), 0.0)
            turned = radius * angle + np.hypot(tangent, rise) - reach_m
            least = np.minimum(least, np.where(from_center > narrow + reach_m, turned, straight))
        bound: FloatArray = np.maximum(np.maximum(SLACK * least, straight), 0.0)
        return bound

    def shorter(self, start: FloatArray, goal: FloatArray, than_m: float) -> float | None:
        """Length of a chain from a level state [6] to a goal [4] that is shorter; None without any.

        Raises AssertionError where too many states had to be looked at.
        """
        place, yaw = start[None, :3], start[5:6]
        zero = np.zeros(1)
        least = self.bound_m(place, yaw, goal)
        left, seen = Open(place, yaw, zero.astype(np.int64), zero, least), {}  # type: ignore[var-annotated]
        while len(left.yaw_rad):
            order = np.argsort(left.flown_m + GREED * left.least_m, kind="stable")
            now, left = left.some(order[:BATCH]), left.some(order[BATCH:])
            parts = []
            for pitch in np.unique(now.pitch):
                those = now.some(now.pitch == pitch)
                for way in self._from(int(pitch)):
                    found_m, ends = self._flown_on(those, way, goal)
                    if found_m < than_m:
                        return found_m
                    parts.append(ends)
            ends = Open(*(np.concatenate(values) for values in zip(*parts, strict=True)))
            ends = ends.some(ends.flown_m + ends.least_m < than_m)
            left = Open(
                *(
                    np.concatenate(values)
                    for values in zip(left, self._fresh(ends, seen), strict=True)
                )
            )
            assert len(seen) < MOST_STATES, "undecided"
        return None

    def _flown_on(self, those: Open, way: Way, goal: FloatArray) -> tuple[float, Open]:
        """Length of the shortest that come to the goal by a movement, and where all of them end."""
        cosine, sine = np.cos(those.yaw_rad)[:, None], np.sin(those.yaw_rad)[:, None]
        x, y, z = way.places_m.T
        offset = np.stack(
            [
                cosine * x - sine * y,
                sine * x + cosine * y,
                np.broadcast_to(z, (len(cosine), len(z))),
            ],
            axis=2,
        )
        places = those.place_m[:, None] + offset
        chord = np.diff(places, axis=1)
        squared = np.maximum(np.sum(chord**2, axis=2), 1e-12)
        to = goal[:3] - places[:, :-1]
        foot = np.sum(to * chord, axis=2) / squared
        inside = goal[3] ** 2 - (np.sum(to**2, axis=2) - foot**2 * squared)
        share = foot - np.sqrt(np.maximum(inside, 0.0) / squared)
        enters = (inside >= 0.0) & (share >= 0.0) & (share <= 1.0)
        length = those.flown_m[:, None] + way.flown_m[:-1] + share * np.diff(way.flown_m)
        yaw, flown = those.yaw_rad + way.turn_rad, those.flown_m + way.flown_m[-1]
        least = self.bound_m(places[:, -1], yaw, goal)
        ends = Open(places[:, -1], yaw, np.full(len(yaw), way.pitch), flown, least)
        return float(np.min(length, where=enters, initial=np.inf)), ends

    def _fresh(self, ends: Open, seen: dict[bytes, float]) -> Open:
        """Those at which no chain that was as short has ended yet."""
        turned = np.mod(ends.yaw_rad, 2.0 * np.pi)[:, None]
        cell_m = CELL * self._automaton.step_m
        keys = np.concatenate(
            [np.round(ends.place_m / cell_m), np.round(1e3 * turned), ends.pitch[:, None]], axis=1
        ).astype(np.int64)
        fresh = []
        for n, (key, flown) in enumerate(zip(keys, ends.flown_m.tolist(), strict=True)):
            if flown < seen.get(key.tobytes(), np.inf) - 1e-9:
                seen[key.tobytes()] = flown
                fresh.append(n)
        return ends.some(np.array(fresh, dtype=np.int64))
