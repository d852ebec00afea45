"""What to fly in view of aircraft kilometres away: a course, a speed and a climb.

The pair of profiles is flown that costs least: nested volumes that it leads into, the risk of
being inside, the detour, and leaving the side or the sense begun. So it changes its mind only for a
volume less or a large difference of risk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from clearway.avoidance.long_range.profiles import Motion, Profiles, Wanted, profiles
from clearway.avoidance.long_range.rating import Other, RatedProfiles, rate_profiles
from clearway.base.frames import FloatArray, wrap_angle
from clearway.traffic.volumes.volume import VolumeSet
from clearway.vehicle.performance import Performance


class PassingSide(StrEnum):
    """Where the course lies from the one wanted."""

    LEFT = "left"
    RIGHT = "right"
    AHEAD = "ahead"


class Sense(StrEnum):
    """Which way the height goes."""

    UP = "up"
    DOWN = "down"
    LEVEL = "level"


@dataclass(frozen=True, slots=True)
class RiskPrices:
    """What risk and detours cost, beside each other; tuned on encounters of seed 77, copter and
    wing, that no comparison flies."""

    inner: float = 30.0
    """Per chance of being inside the innermost volume."""
    outer: float = 12.0
    """Per chance of being inside the outermost one."""
    tier: tuple[float, ...] = (1.2, 4.5, 18.0)
    """For entering the outermost volume with its buffer, itself, and all further ones, if nobody
    manoeuvres."""
    fades_s: float = 60.0
    """Time constant with which that weighs less for what is entered later."""
    turn: float = 0.2
    """For a course right opposed to the one wanted."""
    slow: float = 0.05
    """For the slower speed."""
    climb: float = 0.05
    """For the steepest climb or descent."""
    off_height: float = 0.03
    """For being as far off the height wanted as the outermost volume is high."""
    other_side: float = 3.0
    """For leaving the side begun."""
    other_sense: float = 3.0
    """For leaving the sense begun."""
    rerouted: float = 0.15
    """For any other course or climb than the last one."""


@dataclass(frozen=True, slots=True)
class LongRangeChoice:
    """What is flown in view of traffic."""

    course_rad: float
    speed_mps: float
    climb_mps: float
    """0 with `begins_s` above 0: it begins later."""
    side: PassingSide
    sense: Sense
    tier: int
    """Nested volumes that it enters if all fly straight on."""
    within_s: float
    risk: tuple[float, ...]
    """Chance of being inside each volume at the worst moment, the outermost first."""
    wanted_tier: int
    """Of what would be flown without traffic."""
    off_rad: float
    """From the course wanted."""
    slower: bool
    """Than what is wanted."""
    steep_mps: float
    """Of the climb or descent, whether it begins at once or later."""
    begins_s: float
    """When that begins."""
    begun_side: PassingSide = PassingSide.AHEAD
    """The side that was begun about an aircraft that is ahead yet, even where this choice is on
    none."""
    begun_sense: Sense = Sense.LEVEL
    """Likewise of the height."""
    worse_since_s: float | None = None
    """Since when all that keeps to what was begun has led into more volumes than something else;
    None while it does not."""

    @property
    def avoids(self) -> bool:
        """Whether it is anything but what is wanted."""
        return self.side is not PassingSide.AHEAD or self.sense is not Sense.LEVEL

    @property
    def gives_way(self) -> bool:
        """Whether a side or a sense is begun about an aircraft that is ahead yet."""
        begun = self.begun_side is not PassingSide.AHEAD or self.begun_sense is not Sense.LEVEL
        return self.avoids or begun

    @property
    def reason(self) -> str:
        """What it is, in words."""
        words = []
        if self.side is not PassingSide.AHEAD:
            words.append(f"{math.degrees(self.off_rad):.0f} deg {self.side} of the way")
        if self.slower:
            words.append(f"at {self.speed_mps:.0f} m/s")
        if self.sense is not Sense.LEVEL:
            later = f" in {self.begins_s:.0f} s" if self.begins_s else ""
            words.append(f"{self.sense} at {self.steep_mps:.1f} m/s{later}")
        words = words or ["as wanted"]
        words.append(
            f"{self.tier} volumes ahead ({self.wanted_tier} as wanted), risk "
            + " / ".join(f"{one:.3f}" for one in self.risk)
        )
        return ", ".join(words)


QUIET = 0.005
"""Nobody weighs a detour against less risk."""
SMALL_TURN_RAD = math.radians(5.0)
SLOW_CLIMB_MPS = 0.01
"""Slower is level."""


def resolve(
    motion: Motion,
    wanted: Wanted,
    others: Sequence[Other],
    performance: Performance,
    volumes: VolumeSet,
    before: LongRangeChoice | None = None,
    *,
    floor_m: float = -math.inf,
    ceiling_m: float = math.inf,
    prices: RiskPrices | None = None,
) -> LongRangeChoice:
    """The best pair of profiles against others, committed to what was chosen before."""
    prices = prices or RiskPrices()
    if before is None or not before.avoids:
        ways = profiles(motion, wanted, performance, floor_m, ceiling_m, only_wanted=True)
        found = rate_profiles(ways, others, volumes)
        if not found.tier[0, 0] and float(found.probability[0, 0, 0]) < QUIET:
            return describe_pair(ways, found, wanted, 0, 0)
    ways = profiles(motion, wanted, performance, floor_m, ceiling_m)
    found = rate_profiles(ways, others, volumes)
    cost = _cost(ways, found, wanted, performance, volumes, before, prices)
    best = int(np.argmin(cost))
    level, climb = divmod(best, cost.shape[1])
    return describe_pair(ways, found, wanted, level, climb)


def _cost(
    ways: Profiles,
    found: RatedProfiles,
    wanted: Wanted,
    performance: Performance,
    volumes: VolumeSet,
    before: LongRangeChoice | None,
    prices: RiskPrices,
) -> FloatArray:
    """[level, climbs]"""
    off = np.abs(wrap_angle(ways.course_rad - wanted.course_rad))
    level = prices.turn * off / math.pi + prices.slow * (ways.speed_mps < wanted.speed_mps)
    steep = np.where(ways.climb_mps > 0.0, performance.climb_mps, performance.sink_mps)
    climb = prices.climb * np.abs(ways.climb_mps) / steep
    climb[0] = 0.0
    high = volumes.outermost.half_height_m
    climb += prices.off_height * np.abs(ways.height_m[:, -1] - wanted.height_m) / high
    if before is not None:
        if before.side is not PassingSide.AHEAD:
            sign = 1.0 if before.side is PassingSide.LEFT else -1.0
            opposite = sign * wrap_angle(ways.course_rad - wanted.course_rad) < -SMALL_TURN_RAD
            level = level + prices.other_side * opposite
        if before.sense is not Sense.LEVEL:
            sign = 1.0 if before.sense is Sense.UP else -1.0
            opposite = sign * ways.climb_mps <= -SLOW_CLIMB_MPS
            opposite[0] = False
            climb = climb + prices.other_sense * opposite
        apart = np.abs(wrap_angle(ways.course_rad - before.course_rad)) > SMALL_TURN_RAD
        level = level + prices.rerouted * apart
        climb = climb + prices.rerouted * (np.abs(ways.climb_mps - before.climb_mps) > 0.01)
    cost: FloatArray = level[:, None] + climb[None, :]
    cost += prices.outer * found.probability[0] + prices.inner * found.probability[-1]
    forbids = np.array([0.0, *prices.tier])[np.minimum(found.tier, len(prices.tier))]
    soon = np.where(found.tier > 0, np.exp(-found.within_s / prices.fades_s), 0.0)
    cost += forbids * soon
    return cost


def describe_pair(
    ways: Profiles, found: RatedProfiles, wanted: Wanted, level: int, climb: int
) -> LongRangeChoice:
    """What a pair of profiles is, in numbers and words."""
    course = float(ways.course_rad[level])
    side, sense = _side(course, wanted), _sense(ways, climb)
    tier = int(found.tier[level, climb])
    wanted_tier = int(found.tier[0, 0])
    begins = float(ways.begins_s[climb])
    risk = tuple(float(one[level, climb]) for one in found.probability)
    return LongRangeChoice(
        course,
        float(ways.speed_mps[level]),
        0.0 if begins else float(ways.climb_mps[climb]),
        side,
        sense,
        tier,
        float(found.within_s[level, climb]),
        risk,
        wanted_tier,
        off_rad=abs(float(wrap_angle(course - wanted.course_rad))),
        slower=bool(ways.speed_mps[level] < wanted.speed_mps),
        steep_mps=abs(float(ways.climb_mps[climb])),
        begins_s=begins,
    )


def _side(course_rad: float, wanted: Wanted) -> PassingSide:
    off = float(wrap_angle(course_rad - wanted.course_rad))
    if abs(off) <= SMALL_TURN_RAD:
        return PassingSide.AHEAD
    return PassingSide.LEFT if off > 0.0 else PassingSide.RIGHT


def _sense(ways: Profiles, climb: int) -> Sense:
    if climb == 0 or abs(ways.climb_mps[climb]) < SLOW_CLIMB_MPS:
        return Sense.LEVEL
    return Sense.UP if ways.climb_mps[climb] > 0.0 else Sense.DOWN
