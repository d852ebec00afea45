"""One encounter in the true world: a vehicle that takes time, surveillance as it is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from time import perf_counter

import numpy as np

from clearway.avoidance.long_range.profiles import Motion, Wanted
from clearway.avoidance.long_range.rating import Other
from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M
from clearway.studies.risk.dynamics import advance
from clearway.studies.risk.encounter import ModelEncounter
from clearway.studies.risk.long_choice import long_planner
from clearway.studies.risk.long_planners import LongPlanner, LongView, Steer
from clearway.studies.risk.settings import RiskSettings
from clearway.traffic.growth import LIGHT_AIRCRAFT
from clearway.traffic.surveillance import SURVEILLANCES, Surveillance, Watch
from clearway.traffic.tracking.smooth import TRACK_COAST_S, SmoothTrack, follow_report
from clearway.traffic.volumes import VOLUME_SETS, VolumeSet
from clearway.vehicle.performance import PERFORMANCES, Performance

STEPS_PER_S = 4
KEPT_IN_S = 12.0
"""Aircraft whose reports are older count no more."""


@dataclass(frozen=True, eq=False)
class LongFlight:
    """What was flown."""

    time_s: FloatArray
    """[n] every quarter of a second."""
    own_m: FloatArray
    """[n, 3]"""
    other_m: FloatArray
    """[n, 3]"""
    steered: tuple[tuple[float, Steer], ...]
    """What was commanded when, each second."""
    heard: int
    """Reports."""
    decision_s: tuple[float, ...] = ()
    """What each decision took to compute."""

    @property
    def side_reversals(self) -> int:
        """How often the side changed to the other one."""
        return _reversals([steer.side for _, steer in self.steered])

    @property
    def sense_reversals(self) -> int:
        return _reversals([steer.sense for _, steer in self.steered])


def _reversals(signs: list[int]) -> int:
    taken = [sign for sign in signs if sign]
    return sum(one != other for one, other in pairwise(taken))


def surveillance_of(settings: RiskSettings) -> Surveillance:
    """The kind that the settings name, with their range where they say one."""
    kind = SURVEILLANCES.find(settings.surveillance)
    return replace(kind, range_m=settings.range_m) if settings.range_m else kind


def choose_performance(settings: RiskSettings) -> Performance:
    """The airframe that the settings name, with their reaction time where they say one."""
    able = PERFORMANCES.find(settings.vehicle)
    if settings.reaction_s is None:
        return able
    return replace(able, reaction_s=settings.reaction_s)


def fly_long(
    encounter: ModelEncounter,
    planner: str | LongPlanner,
    settings: RiskSettings,
    volumes: VolumeSet | None = None,
) -> LongFlight:
    """The encounter flown; it depends on its number and the settings alone."""
    steers = long_planner(planner) if isinstance(planner, str) else planner
    able, kind = choose_performance(settings), surveillance_of(settings)
    watch = Watch(
        kind, encounter.at, encounter.lasts_s, (settings.surveillance_seed, encounter.number, 72)
    )
    count = int(encounter.lasts_s * STEPS_PER_S) + 1
    own = np.zeros((count, 3))
    wanted = Wanted(0.0, able.speed_mps, 0.0)
    state = np.array([0.0, 0.0, 0.0, 0.0, able.speed_mps, 0.0, 0.0])
    view = LongView(
        _motion(state), wanted, (), able, volumes or VOLUME_SETS["f3442"],
        floor_m=settings.floor_ft * FOOT_M - encounter.own_height_m,
        ceiling_m=settings.ceiling_ft * FOOT_M - encounter.own_height_m,
    )  # fmt: skip
    track: SmoothTrack | None = None
    steered: list[tuple[float, Steer]] = []
    took: list[float] = []
    heard = 0
    flown = Steer(0.0, able.speed_mps, 0.0, 0, 0)
    for k in range(count):
        own[k] = state[:3]
        time_s = k / STEPS_PER_S
        if k % STEPS_PER_S == 0:
            for report in watch.until(time_s, state[:3]):
                heard += 1
                track = follow_report(track, report)
            view.motion = _motion(state)
            view.others = _others(track, time_s)
            began = perf_counter()
            steer = steers(view) if view.others else fly_home(view)
            if view.others:
                took.append(perf_counter() - began)
            view.before = steer
            steered.append((time_s, steer))
        due = time_s - able.reaction_s
        flown = steered[max(0, math.floor(due))][1] if due >= 0.0 else flown
        advance(state, flown.course_rad, flown.speed_mps, flown.climb_mps, able.turn_mps2,
                able.acceleration_mps2, able.turn_onset_s, able.climb_onset_s, 1.0 / STEPS_PER_S,
                view.floor_m, view.ceiling_m)  # fmt: skip
    time = np.arange(count) / STEPS_PER_S
    return LongFlight(time, own, encounter.at_all(time), tuple(steered), heard, tuple(took))


def fly_home(view: LongView) -> Steer:
    """What is wanted: the course, and back to the height."""
    view.choice = None
    off = view.wanted.height_m - float(view.motion.position_m[2])
    climb = max(-view.performance.sink_mps, min(view.performance.climb_mps, 0.2 * off))
    return Steer(view.wanted.course_rad, view.wanted.speed_mps, climb, 0, 0)


def _motion(state: FloatArray) -> Motion:
    return Motion(state[:3].copy(), float(state[3]), float(state[4]), float(state[5]))


def _others(track: SmoothTrack | None, time_s: float) -> tuple[Other, ...]:
    if track is None or time_s - track.time_s > min(TRACK_COAST_S, KEPT_IN_S):
        return ()
    now = track.at(time_s)
    growth = LIGHT_AIRCRAFT.of(turns=track.turns, climbs=track.climbs)
    return (
        Other(
            now.mean[:3],
            now.mean[3:],
            now.position_std_m,
            now.height_std_m,
            math.sqrt(float(track.level[2])),
            math.sqrt(float(track.height[2])),
            growth,
            track.turn_rps if track.turns else 0.0,
        ),
    )
