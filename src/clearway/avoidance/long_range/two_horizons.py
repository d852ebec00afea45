"""Two horizons in one decision: short trajectories, and where each leads in the next minute.

What LiDAR, map and near traffic leave clear ends on some course, at some speed, climbing or not.
Each such end gets what the long range says of flying on like that: the nested volumes that it leads
into forbid it, the outermost least of all, and its risk is a cost. So metres and kilometres decide
together: round a tree on the side on which an aircraft is passed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from clearway.avoidance.long_range.profiles import Motion, Profiles, Wanted, profiles
from clearway.avoidance.long_range.rating import Other, RatedProfiles, rate_profiles
from clearway.avoidance.long_range.resolve import (
    SMALL_TURN_RAD,
    LongRangeChoice,
    PassingSide,
    RiskPrices,
    Sense,
    describe_pair,
)
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.goal import Goal
from clearway.avoidance.rules.rule import Rule, RuleView, Verdict
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import BoolArray, IntArray
from clearway.reach.tree import ReachSet
from clearway.traffic import Intruder
from clearway.traffic.growth import LIGHT_AIRCRAFT
from clearway.traffic.tracking.smooth import CLIMBS_MPS, TURNS_RPS
from clearway.traffic.volumes.volume import VolumeSet
from clearway.vehicle.performance import Performance

RISK = "long-range risk"
BEGUN = "side and sense begun"
LEVEL_MPS = 0.1
"""Slower climbs are none."""
WAVERS_S = 3.0
"""Volumes a minute ahead come and go with single reports; what stays longer is so."""
MOST_TIERS = 100
"""More than any list of volumes."""
LEAST_RISK = 0.01
"""Differences of risk below this change no course."""


@dataclass(frozen=True, eq=False)
class LongRange:
    """What the long range says of a decision's trajectories."""

    ways: Profiles
    found: RatedProfiles
    wanted: Wanted
    volumes: VolumeSet
    level: IntArray
    """[nodes] the level profile that the way to a node leads on to."""
    climb: IntArray
    """[nodes] likewise of climbs."""
    before: LongRangeChoice | None
    prices: RiskPrices
    now_s: float = 0.0

    def rules(self, unit_m: float) -> tuple[Rule, ...]:
        """A rule for each nested volume, the innermost the most important, and the cost of risk.

        unit_m: what turning right round costs.
        """
        tier = self.found.tier[self.level, self.climb]
        names = [f"{self.volumes.outermost.name}, with its buffer"]
        names += [volume.name for volume in self.volumes.volumes]
        rules = [
            Rule(names[depth - 1], partial(_forbids, tier, depth))
            for depth in range(len(names), 0, -1)
        ]
        # What was begun is left at once for not entering the innermost volume, for another one less
        # when that has been so for a while, and never for a little of a buffer.
        rules.insert(-1 if self._has_been_worse else 1, Rule(BEGUN, partial(_leaves, self._leaves)))
        return (*rules, Rule(RISK, partial(_prices, unit_m * self._risk_price())))

    def describe_node(self, node: int) -> LongRangeChoice:
        """What flying to a node comes to at long range."""
        level, climb = int(self.level[node]), int(self.climb[node])
        choice = describe_pair(self.ways, self.found, self.wanted, level, climb)
        side, sense = choice.side, choice.sense
        since = None if self._leaves[node] else self._worse_since_s
        if self.before is not None and choice.wanted_tier:
            side = self.before.begun_side if side is PassingSide.AHEAD else side
            sense = self.before.begun_sense if sense is Sense.LEVEL else sense
        return replace(choice, begun_side=side, begun_sense=sense, worse_since_s=since)

    @property
    def _has_been_worse(self) -> bool:
        """Whether what was begun has led into more volumes than it must for longer than reports
        waver."""
        since = self._worse_since_s
        return since is not None and self.now_s - since >= WAVERS_S

    @cached_property
    def _worse_since_s(self) -> float | None:
        """Since when it does."""
        tier, leaves = self.found.tier[self.level, self.climb], self._leaves
        if not leaves.any() or tier.min() >= np.min(tier[~leaves], initial=MOST_TIERS):
            return None
        before = self.before
        since = None if before is None else before.worse_since_s
        return self.now_s if since is None else since

    def _risk_price(self) -> FloatArray:
        """[nodes] of risk."""
        outer = self.found.probability[0][self.level, self.climb]
        inner = self.found.probability[-1][self.level, self.climb]
        price: FloatArray = self.prices.outer * outer + self.prices.inner * inner
        return np.where(price < LEAST_RISK * self.prices.outer, 0.0, price)

    @cached_property
    def _leaves(self) -> BoolArray:
        """[nodes] whether the course lies on the other side than the one begun, or the height goes
        the other way."""
        leaves = np.zeros(len(self.level), dtype=np.bool_)
        before = self.before
        # With nobody ahead any more there is no side to keep.
        if before is None or not self.found.tier[0, 0]:
            return leaves
        off = wrap_angle(self.ways.course_rad[self.level] - self.wanted.course_rad)
        if before.begun_side is not PassingSide.AHEAD:
            sign = 1.0 if before.begun_side is PassingSide.LEFT else -1.0
            leaves |= sign * off < -SMALL_TURN_RAD
        if before.begun_sense is not Sense.LEVEL:
            sign = 1.0 if before.begun_sense is Sense.UP else -1.0
            leaves |= sign * self.ways.climb_mps[self.climb] < -LEVEL_MPS
        return leaves


def long_range(
    volumes: VolumeSet,
    performance: Performance,
    situation: Situation,
    reach_set: ReachSet,
    goal: Goal,
    before: LongRangeChoice | None,
    prices: RiskPrices | None = None,
    heights_m: tuple[float, float] = (-math.inf, math.inf),
) -> LongRange | None:
    """The long range of a decision; None where nothing is reported.

    heights_m: lowest and highest that are flown at.
    """
    if not situation.intruders:
        return None
    prices = prices or RiskPrices()
    state = situation.state
    course = float(state.attitude_rad[2])
    pitch = float(state.attitude_rad[1])
    off = float(np.arctan2(goal.target_m[1], goal.target_m[0]))
    speed = performance.speed_mps
    motion = Motion(state.position_m, course, speed, -speed * math.sin(pitch))
    height = float(situation.target_m[2])
    wanted = Wanted(course + off, speed, height)
    others = [_other(intruder, state.time_s) for intruder in situation.intruders]
    # Movements begin at once, and the next one comes within a second or so.
    able = replace(performance, reaction_s=0.0)
    lowest_m = float(max(heights_m[0], situation.floor_m))
    ways = profiles(motion, wanted, able, lowest_m, heights_m[1])
    found = rate_profiles(ways, others, volumes)
    level, climb = _ends(reach_set, ways, course, performance)
    return LongRange(ways, found, wanted, volumes, level, climb, before, prices, state.time_s)


def _ends(
    reach_set: ReachSet, ways: Profiles, course_rad: float, performance: Performance
) -> tuple[IntArray, IntArray]:
    """[nodes] level profile and climb that the way to each node leads on to: the nearest."""
    heading = course_rad + reach_set.states[:, 5]
    cos, sin = math.cos(reach_set.start_pitch_rad), math.sin(reach_set.start_pitch_rad)
    height = -sin * reach_set.states[:, 0] + cos * reach_set.states[:, 2]
    parent, parents = reach_set.parent, np.maximum(reach_set.parent, 0)
    rooted = parent < 0
    lasts = reach_set.end_time_s - np.where(rooted, 0.0, reach_set.end_time_s[parents])
    climbed = height - np.where(rooted, 0.0, height[parents])
    flown = reach_set.length_m - np.where(rooted, 0.0, reach_set.length_m[parents])
    rate, speed = climbed / lasts, flown / lasts
    turned = np.abs(wrap_angle(heading[:, None] - ways.course_rad[None, :]))
    slower = np.abs(speed[:, None] - ways.speed_mps[None, :]) / performance.speed_mps
    at_once = np.flatnonzero(ways.begins_s == 0.0)[1:]
    steeper = np.abs(rate[:, None] - ways.climb_mps[at_once][None, :])
    level: IntArray = np.argmin(turned + slower, axis=1)
    climb: IntArray = at_once[np.argmin(steeper, axis=1)]
    return level, climb


def _other(intruder: Intruder, time_s: float) -> Other:
    now = intruder.at(time_s)
    speed = max(float(np.hypot(now.velocity_mps[0], now.velocity_mps[1])), 1e-6)
    turns = intruder.manoeuvre_mps2 / speed > TURNS_RPS
    climbs = abs(float(now.velocity_mps[2])) > CLIMBS_MPS
    return Other(
        now.position_m,
        now.velocity_mps,
        now.position_std_m,
        now.position_std_m,
        intruder.velocity_std_mps,
        intruder.velocity_std_mps,
        LIGHT_AIRCRAFT.of(turns=turns, climbs=climbs),
    )


def _forbids(tier: IntArray, depth: int, view: RuleView) -> Verdict | None:
    """Ways into a volume, where any way keeps out of it."""
    del view
    forbidden = tier >= depth
    if not forbidden.any():
        return None
    return Verdict("entered within a minute if all fly straight on", forbidden)


def _leaves(leaves: BoolArray, view: RuleView) -> Verdict | None:
    """Ways that change the side or the sense begun."""
    del view
    return Verdict("begun about an aircraft ahead", leaves) if leaves.any() else None


def _prices(price_m: FloatArray, view: RuleView) -> Verdict | None:
    del view
    return Verdict("chance of being inside", price_m=price_m) if price_m.any() else None
