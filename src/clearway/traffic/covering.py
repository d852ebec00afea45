"""Where an aircraft will be with 95 %: straight on, within a radius that its own past corrects.

`growth` tells how far light aircraft stray. An airliner strays less; who hovers or circles strays
otherwise. So each aircraft has factors of its own, by how it moves now: a prediction that fails
widens the next ones, one that holds narrows them a little, and in the long run as many hold as are
claimed, however it flies (quantile tracking: Angelopoulos, Candes and Tibshirani 2023).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.conformal import SHARE
from clearway.base.frames import FloatArray, wrap_angle
from clearway.traffic.growth import LIGHT_AIRCRAFT, TwoKinds
from clearway.traffic.tracking.smooth import CLIMBS_MPS, TURNS_RPS

AHEAD_S = (10.0, 20.0, 30.0)
"""How far ahead places are predicted."""
STEP = 0.3
"""By which one prediction that fails changes the logarithm of its factor."""
FASTEST_LIGHT_MPS = 100.0
"""Faster aircraft are airliners."""
HOVERS_MPS = 20.0
"""Slower ones hover, land or taxi: they may go off any way."""
UNSURE_M = 15.0
"""Deviation of a place that is reported, per axis."""
UNSURE_MPS = 1.5
"""Deviation of a velocity that is reported, per axis."""
LATE_S = 2.0
"""By how much a report may miss the time that was predicted for, and still judge it."""
TURN_S = 4.0
"""Over which a turn is told, or a little longer."""


class MovesAs(IntEnum):
    """How an aircraft moves now."""

    AIRLINER = 0
    STRAIGHT = 1
    CIRCLING = 2
    HOVERING = 3


class PlaceReport(NamedTuple):
    """What is known of an aircraft at a time, level frame."""

    time_s: float
    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""

    @property
    def speed_mps(self) -> float:
        """Over ground."""
        return math.hypot(*self.velocity_mps[:2].tolist())

    @property
    def course_rad(self) -> float:
        """Over ground."""
        return math.atan2(float(self.velocity_mps[1]), float(self.velocity_mps[0]))

    def motion(self, *, turns: bool) -> MovesAs:
        """By its speed, and whether it turns."""
        if self.speed_mps > FASTEST_LIGHT_MPS:
            return MovesAs.AIRLINER
        if self.speed_mps < HOVERS_MPS:
            return MovesAs.HOVERING
        return MovesAs.CIRCLING if turns else MovesAs.STRAIGHT


class Region(NamedTuple):
    """Where an aircraft is claimed to be with 95 %, about the place straight on: both hold so."""

    motion: MovesAs
    """How it moves when this is claimed."""
    ahead_s: float
    level_m: float
    """Radius of the circle."""
    height_m: float
    """Above and below."""


class Covered(NamedTuple):
    """What came of one prediction."""

    motion: MovesAs
    ahead_s: float
    level: bool
    """Whether the aircraft was within the circle."""
    height: bool
    """Whether its height was."""


@lru_cache(maxsize=4096)
def claim_radius_m(kinds: TwoKinds, ahead_s: float, scale: float, plane: bool) -> float:
    """Return the distance within which a share SHARE of errors is, by what is declared.

    plane: of two axes, else of one.
    """
    share, steady, strays = (float(one[0]) for one in kinds.at(np.array([ahead_s])))
    unsure = math.hypot(UNSURE_M, UNSURE_MPS * ahead_s)
    low, high = 0.0, 10.0 * math.hypot(scale * max(steady, strays), unsure)
    for _ in range(40):
        middle = 0.5 * (low + high)
        inside = 0.0
        for weight, deviation in ((1.0 - share, steady), (share, strays)):
            ratio = middle / math.hypot(scale * deviation, unsure)
            inside += weight * (
                1.0 - math.exp(-0.5 * ratio * ratio) if plane else math.erf(ratio / math.sqrt(2.0))
            )
        low, high = (middle, high) if inside < SHARE else (low, middle)
    return high


Factors = tuple[tuple[float, ...], ...]
"""By motion, then by how far ahead (`AHEAD_S`)."""


class Starts(NamedTuple):
    """Logarithms of the factors that an aircraft begins with."""

    level: Factors
    height: Factors


NO_STARTS = Starts(((0.0, 0.0, 0.0),) * 4, ((0.0, 0.0, 0.0),) * 4)
"""As light aircraft of the encounter model fly."""
STARTS = Starts(
    ((0.15, -0.71, -0.85), (0.91, 0.92, 0.69), (0.34, 0.15, 0.05), (1.51, 1.62, 1.13)),
    ((-0.25, 0.04, 0.17), (-0.33, -0.19, -0.22), (0.13, 0.06, 0.03), (1.54, 1.3, 0.86)),
)
"""What 95 % of the errors of recorded aircraft take: `tools.reliability --of traffic`."""
Key = tuple[MovesAs, float]
"""How an aircraft moves, and the time ahead."""


@dataclass(slots=True)
class Covering:
    """The factors of one aircraft, learned from its own reports; it keeps what it predicted."""

    starts: Starts = STARTS
    step: float = STEP
    level: dict[Key, float] = field(default_factory=dict)
    """Logarithms of factors, once something is learned."""
    height: dict[Key, float] = field(default_factory=dict)
    regions: tuple[Region, ...] = ()
    """Where it will be, by the last report."""
    _last_s: float = -math.inf
    _open: dict[float, deque[tuple[PlaceReport, Region]]] = field(
        default_factory=lambda: {ahead: deque() for ahead in AHEAD_S}
    )

    def take(self, now: PlaceReport) -> list[Covered]:
        """Learn from a report; returns what it judges of earlier predictions.

        A report that is no newer than the last one teaches nothing.
        """
        judged: list[Covered] = []
        if now.time_s <= self._last_s:
            return judged
        self._last_s = now.time_s
        for ahead_s, waiting in self._open.items():
            while waiting and waiting[0][0].time_s + ahead_s <= now.time_s + 1e-9:
                then, region = waiting.popleft()
                if now.time_s - then.time_s - ahead_s <= LATE_S:
                    judged.append(self._judge(then, region, now))
        self.regions = self._regions(now)
        for region in self.regions:
            self._open[region.ahead_s].append((now, region))
        return judged

    def _turns(self, now: PlaceReport) -> bool:
        """Whether its course has changed since the last report that is old enough."""
        old = [then for then, _ in self._open[AHEAD_S[0]] if now.time_s - then.time_s >= TURN_S]
        if not old or now.time_s - old[-1].time_s > TURN_S + LATE_S:
            return False
        turned = float(wrap_angle(now.course_rad - old[-1].course_rad))
        return abs(turned) > float(TURNS_RPS) * (now.time_s - old[-1].time_s)

    def _regions(self, now: PlaceReport) -> tuple[Region, ...]:
        """Where it will be, at each of AHEAD_S."""
        turns = self._turns(now)
        motion = now.motion(turns=turns)
        speed = max(now.speed_mps, HOVERS_MPS)
        climbs = abs(float(now.velocity_mps[2])) > CLIMBS_MPS
        place, height = LIGHT_AIRCRAFT.of(turns=turns, climbs=climbs)
        return tuple(
            Region(
                motion,
                ahead_s,
                claim_radius_m(place, ahead_s, float(round(speed)), True)
                * math.exp(self.level.get((motion, ahead_s), self.starts.level[motion][k])),
                claim_radius_m(height, ahead_s, 1.0, False)
                * math.exp(self.height.get((motion, ahead_s), self.starts.height[motion][k])),
            )
            for k, ahead_s in enumerate(AHEAD_S)
        )

    def _judge(self, then: PlaceReport, region: Region, now: PlaceReport) -> Covered:
        off_m = now.position_m - then.position_m - then.velocity_mps * (now.time_s - then.time_s)
        key = region.motion, region.ahead_s
        held_level = math.hypot(*off_m[:2].tolist()) <= region.level_m
        held_height = abs(float(off_m[2])) <= region.height_m
        self._learn(self.level, key, self.starts.level, held=held_level)
        self._learn(self.height, key, self.starts.height, held=held_height)
        return Covered(*key, held_level, held_height)

    def _learn(self, factors: dict[Key, float], key: Key, starts: Factors, *, held: bool) -> None:
        """Widen the factor after a prediction that failed, or narrow it a little."""
        missed, start = 0.0 if held else 1.0, starts[key[0]][AHEAD_S.index(key[1])]
        factors[key] = factors.get(key, start) + self.step * (missed - (1.0 - SHARE))
