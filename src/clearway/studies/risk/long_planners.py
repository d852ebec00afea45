"""Who avoids at the scale of kilometres: clearway's resolver, and rivals of the same means.

All hear the same reports through the same tracker, fly the same vehicle and renew their choice
every second. The zones of the rivals were tuned on encounters that no comparison flies (seed 77).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from clearway.avoidance.long_range.profiles import Motion, Wanted
from clearway.avoidance.long_range.rating import Other
from clearway.avoidance.long_range.resolve import (
    LongRangeChoice,
    RiskPrices,
    Sense,
    resolve,
)
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.variants import Variants
from clearway.sim.pilot import CLEARWAY
from clearway.studies.risk.settings import STRAIGHT
from clearway.traffic.volumes.volume import VolumeSet
from clearway.vehicle.performance import Performance


class Steer(NamedTuple):
    """What is commanded until the next second."""

    course_rad: float
    speed_mps: float
    climb_mps: float
    side: int
    """-1 right of the way, 1 left, 0 neither."""
    sense: int
    """-1 down, 1 up, 0 neither."""
    choice: LongRangeChoice | None = None
    """Where it comes from, for those that have one."""
    advisory: int = 0
    """Of HorizontalCAS, which needs the one before; 0 is clear of conflict."""

    @property
    def reason(self) -> str:
        """Why, in words; empty for those that tell none."""
        return "" if self.choice is None else self.choice.reason


@dataclass(slots=True)
class LongView:
    """What a planner sees, and what it remembers from second to second."""

    motion: Motion
    wanted: Wanted
    others: Sequence[Other]
    performance: Performance
    volumes: VolumeSet
    floor_m: float
    ceiling_m: float
    before: Steer | None = None
    choice: LongRangeChoice | None = field(default=None)
    """The last choice, for those that have one."""


LongPlanner = Callable[[LongView], Steer]


def by_resolver(view: LongView, prices: RiskPrices | None = None) -> Steer:
    """Courses, speeds and climbs rated by nested volumes and risk, with commitment."""
    choice = resolve(
        view.motion,
        view.wanted,
        view.others,
        view.performance,
        view.volumes,
        view.choice,
        floor_m=view.floor_m,
        ceiling_m=view.ceiling_m,
        prices=prices,
    )
    view.choice = choice
    side = {"left": 1, "right": -1}.get(str(choice.side), 0)
    sense = {Sense.UP: 1, Sense.DOWN: -1}.get(choice.sense, 0)
    climb = choice.climb_mps
    return Steer(choice.course_rad, choice.speed_mps, climb, side, sense, choice)


def straight_on(view: LongView) -> Steer:
    """What is wanted, whatever is there."""
    return Steer(view.wanted.course_rad, view.wanted.speed_mps, go_back(view), 0, 0)


@dataclass(frozen=True, slots=True)
class LongTuning:
    """What the rivals keep."""

    zone: float
    """Of the outermost volume, buffers included."""
    horizon_s: float
    climb_weight: float = 3.0
    """How much more expensive a metre a second of climb is than one of level velocity."""


MVP_TUNING = LongTuning(1.1, 60.0)
VO_TUNING = LongTuning(1.3, 60.0)


def make_modified_voltage(view: LongView, tuning: LongTuning = MVP_TUNING) -> Steer:
    """Modified voltage potential: the wished velocity, changed by the shortest way out of a
    cylinder."""
    wished = _find_wished(view)
    change = np.zeros(3)
    radius, half = _zone(view, tuning)
    for other in view.others:
        apart = view.motion.position_m - other.position_m
        rush = wished - other.velocity_mps
        speed2 = float(rush[:2] @ rush[:2])
        closest_s = -float(apart[:2] @ rush[:2]) / max(speed2, 1e-9)
        miss = apart + closest_s * rush
        missed = math.hypot(float(miss[0]), float(miss[1]))
        if closest_s <= 0.0 or missed >= radius or abs(float(miss[2])) >= half:
            continue
        enters_s = closest_s - math.sqrt(max(radius**2 - missed**2, 0.0) / max(speed2, 1e-9))
        if enters_s > tuning.horizon_s:
            continue
        away = miss[:2] / missed if missed > 1.0 else np.array([-rush[1], rush[0]])
        away = away / max(float(np.linalg.norm(away)), 1e-9)
        range_m = math.hypot(float(apart[0]), float(apart[1]))
        graze = 1.0
        if range_m > radius:
            graze = math.cos(math.asin(radius / range_m) - math.asin(missed / range_m))
        change[:2] += (radius / graze - missed) / closest_s * away
        up = 1.0 if float(miss[2]) >= 0.0 else -1.0
        change[2] += up * (half - abs(float(miss[2]))) / max(enters_s, 1.0)
    return _steer(view, wished + change, bool(change.any()))


def avoid_velocity_obstacles(view: LongView, tuning: LongTuning = VO_TUNING) -> Steer:
    """Velocity obstacles: of many velocities the nearest to the wished one that meets nobody."""
    wished = _find_wished(view)
    able = view.performance
    courses = view.wanted.course_rad + np.radians(np.arange(-180.0, 180.0, 10.0))
    speeds = np.linspace(max(able.slowest_mps, 0.5 * able.speed_mps), able.speed_mps, 3)
    climbs = np.linspace(-able.sink_mps, able.climb_mps, 9)
    mesh = np.meshgrid(courses, speeds, climbs, indexing="ij")
    course, speed, climb = (axis.ravel() for axis in mesh)
    velocity = np.stack([speed * np.cos(course), speed * np.sin(course), climb], axis=1)
    velocity = np.concatenate([wished[None], velocity])
    radius, half = _zone(view, tuning)
    free = np.ones(len(velocity), dtype=np.bool_)
    enters = np.full(len(velocity), np.inf)
    for other in view.others:
        within = _find_entering_s(
            other.position_m - view.motion.position_m,
            other.velocity_mps - velocity,
            radius,
            half,
            tuning.horizon_s,
        )
        free &= ~np.isfinite(within)
        enters = np.minimum(enters, within)
    away = np.linalg.norm((velocity - wished) * [1.0, 1.0, tuning.climb_weight], axis=1)
    best = int(np.argmin(away + 1e6 * ~free - np.where(free, 0.0, 1e3 * np.minimum(enters, 1e3))))
    return _steer(view, velocity[best], best != 0)


def _find_entering_s(
    apart: FloatArray, rush: FloatArray, radius: float, half: float, horizon_s: float
) -> FloatArray:
    """[n] seconds until a cylinder is entered with velocities [n, 3]; inf for not in time."""
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.einsum("ni,ni->n", rush[:, :2], rush[:, :2])
        linear = rush[:, :2] @ apart[:2]
        off = float(apart[:2] @ apart[:2]) - radius**2
        root = np.sqrt(np.maximum(linear**2 - square * off, 0.0))
        meets = linear**2 - square * off >= 0.0
        enters = np.where(meets, (-linear - root) / square, np.inf)
        leaves = np.where(meets, (-linear + root) / square, -np.inf)
        first, last = (-half - apart[2]) / rush[:, 2], (half - apart[2]) / rush[:, 2]
    low, high = np.minimum(first, last), np.maximum(first, last)
    inside = abs(float(apart[2])) < half
    still = np.abs(rush[:, 2]) < 1e-9
    low = np.where(still, -np.inf if inside else np.inf, low)
    high = np.where(still, np.inf if inside else -np.inf, high)
    begins, ends = np.maximum(np.maximum(enters, low), 0.0), np.minimum(leaves, high)
    return np.where((begins < ends) & (begins <= horizon_s), begins, np.inf)


def _zone(view: LongView, tuning: LongTuning) -> tuple[float, float]:
    kept = view.volumes.outermost.kept
    return tuning.zone * kept.radius_m, tuning.zone * kept.half_height_m


def _find_wished(view: LongView) -> FloatArray:
    wanted = view.wanted
    level = wanted.speed_mps * np.array([math.cos(wanted.course_rad), math.sin(wanted.course_rad)])
    return np.array([*level, go_back(view)])


def go_back(view: LongView) -> float:
    """Climb that leads back to the height wanted."""
    off = view.wanted.height_m - float(view.motion.position_m[2])
    return max(-view.performance.sink_mps, min(view.performance.climb_mps, 0.2 * off))


def _steer(view: LongView, velocity: FloatArray, avoids: bool) -> Steer:
    able = view.performance
    speed = math.hypot(float(velocity[0]), float(velocity[1]))
    course = math.atan2(float(velocity[1]), float(velocity[0]))
    climb = max(-able.sink_mps, min(able.climb_mps, float(velocity[2])))
    height = float(view.motion.position_m[2])
    if (height <= view.floor_m and climb < 0.0) or (height >= view.ceiling_m and climb > 0.0):
        climb = 0.0
    off = float(wrap_angle(course - view.wanted.course_rad))
    side = int(np.sign(off)) if avoids and abs(off) > 0.09 else 0
    sense = int(np.sign(climb)) if avoids and abs(climb) > 0.2 else 0
    speed = max(able.slowest_mps, min(able.fastest_mps, speed))
    return Steer(course, speed, climb, side, sense)


LONG_PLANNERS: Variants[LongPlanner] = Variants(
    "planner",
    {
        CLEARWAY: by_resolver,
        "mvp": make_modified_voltage,
        "velocity-obstacle": avoid_velocity_obstacles,
        STRAIGHT: straight_on,
    },
)
"""Planners of encounters at real scale; the others of `PLANNERS` know the stretched world alone."""
