"""Reports of one aircraft as a kind of surveillance has them: seeded, and whatever we fly.

All errors of an encounter are drawn before it begins, so that two planners that meet the same
aircraft hear the same of it as long as they are as far away.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.traffic.surveillance.quality import Surveillance

Truth = Callable[[float], tuple[FloatArray, FloatArray]]
"""(time) -> true position and velocity [3] of the aircraft."""


class HeardOf(NamedTuple):
    """One report as it is heard."""

    time_s: float
    """That it says it is of."""
    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray | None
    position_std_m: float
    """Horizontal, per axis."""
    height_std_m: float
    velocity_std_mps: float
    climb_std_mps: float


class Watch:
    """What is reported of one aircraft in one encounter."""

    def __init__(
        self, kind: Surveillance, truth: Truth, lasts_s: float, seed: tuple[int, ...]
    ) -> None:
        self._kind, self._truth = kind, truth
        rng = np.random.default_rng(seed)
        count = int(lasts_s / kind.report_s) + 2
        self._of_s = kind.report_s * (np.arange(count) + rng.random() - 1.0)
        self._level = _wandering(kind.bias_m, kind.drift_m, kind, count, rng)
        self._noise = rng.normal(size=(count, 3))
        self._velocity = _wandering(0.0, kind.velocity_mps, kind, count, rng)
        self._climb = kind.climb_mps * rng.normal(size=count)
        self._height_m = kind.altitude_bias_m * rng.normal()
        self._lost = _draw_lost(kind, count, rng)
        self._next = 0
        self._waits: list[tuple[float, HeardOf]] = []

    def until(self, time_s: float, own_m: FloatArray) -> list[HeardOf]:
        """What is heard up to a time, of reports sent since the last call while we were at a place
        [3]: times ascend from call to call."""
        kind = self._kind
        while self._next < len(self._of_s) and self._of_s[self._next] <= time_s:
            at, self._next = self._next, self._next + 1
            sent_s = float(self._of_s[at])
            position, velocity = self._truth(max(sent_s, 0.0))
            range_m = float(np.linalg.norm(position - own_m))
            if range_m <= kind.range_m and not self._lost[at]:
                heard = self._report(at, sent_s, position, velocity, own_m, range_m)
                self._waits.append((sent_s + kind.latency_s, heard))
        here = [heard for arrives_s, heard in self._waits if arrives_s <= time_s]
        self._waits = [wait for wait in self._waits if wait[0] > time_s]
        return here

    def _report(
        self,
        at: int,
        sent_s: float,
        position: FloatArray,
        velocity: FloatArray,
        own_m: FloatArray,
        range_m: float,
    ) -> HeardOf:
        kind, told = self._kind, position.copy()
        off = self._level[at] + kind.noise_m * self._noise[at, :2]
        beyond = float(np.hypot(off[0], off[1])) / kind.contained_m
        told[:2] += off if beyond <= 1.0 else off / beyond
        if kind.bearing_rad:
            away = position - own_m
            level = max(float(np.hypot(away[0], away[1])), 1.0)
            across = np.array([-away[1], away[0]]) / level
            told[:2] += kind.bearing_rad * range_m * self._noise[at, 0] * across
            told[2] += kind.elevation_rad * range_m * self._noise[at, 1]
        told[2] += self._height_m + kind.altitude_noise_m * self._noise[at, 2]
        if kind.altitude_step_m:
            told[2] = kind.altitude_step_m * np.round(told[2] / kind.altitude_step_m)
        moves = None
        if kind.tells_velocity:
            wrong = np.array([*self._velocity[at], self._climb[at]])
            moves = velocity + wrong
        return HeardOf(
            sent_s + kind.untold_s,
            told,
            moves,
            kind.find_stated_m(range_m),
            kind.find_stated_height_m(range_m),
            kind.stated_mps,
            kind.stated_climb_mps,
        )


def _wandering(
    bias: float, drift: float, kind: Surveillance, count: int, rng: np.random.Generator
) -> FloatArray:
    """[count, 2] a constant and a Gauss-Markov error."""
    constant = bias * rng.normal(size=2)
    drawn = rng.normal(size=(count, 2))
    keep = float(np.exp(-kind.report_s / kind.drift_s))
    errors = np.empty((count, 2))
    now = drift * drawn[0]
    for n in range(count):
        if n:
            now = keep * now + drift * np.sqrt(1.0 - keep**2) * drawn[n]
        errors[n] = constant + now
    return errors


def _draw_lost(kind: Surveillance, count: int, rng: np.random.Generator) -> BoolArray:
    """[count] which reports are lost: a chain of two states with the share and length asked for."""
    ends = min(1.0, kind.report_s / kind.burst_s)
    begins = min(1.0, ends * kind.lost / (1.0 - kind.lost))
    share = rng.random(count)
    lost = np.zeros(count, dtype=np.bool_)
    now = bool(rng.random() < kind.lost)
    for n in range(count):
        lost[n] = now
        now = share[n] >= ends if now else share[n] < begins
    return lost
