"""What could be avoided at all, by an ownship that knew the future from the first report on.

Thousands of manoeuvres are flown against the true track, each with the vehicle's own limits and
reaction: a course, a speed and a climb, and from some moment on another course and climb. Where all
of them lose well clear, no planner could have kept it by any of these; and none that hears the same
later or worse does better than this one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.units import FOOT_M
from clearway.studies.risk.cylinder import Cylinder
from clearway.studies.risk.dynamics import advance
from clearway.studies.risk.encounter import ModelEncounter
from clearway.studies.risk.long_flight import STEPS_PER_S, choose_performance, surveillance_of
from clearway.studies.risk.settings import NEAR_COLLISION, WELL_CLEAR, RiskSettings
from clearway.traffic.surveillance import Watch

COURSES = 36
LATER_COURSES = 12
LATER_S = np.array([6.0, 12.0, 20.0, 30.0])
"""When the second half of a manoeuvre begins."""


class Foreseen(NamedTuple):
    """Whether any manoeuvre would have done."""

    heard_s: float
    """When the first report is heard; inf for never."""
    well_clear: bool
    """Whether one keeps well clear."""
    near_collision: bool
    """Whether one avoids a near collision."""


def foreseen(encounter: ModelEncounter, settings: RiskSettings) -> Foreseen:
    """What the best of all manoeuvres comes to, begun when the first report of straight flight is
    heard, a reaction time later."""
    able = choose_performance(settings)
    heard_s = _find_first_report_s(encounter, settings)
    begins_s = math.ceil(min(heard_s, encounter.lasts_s)) + able.reaction_s
    times = np.arange(0.0, encounter.lasts_s + 1e-9, 1.0 / STEPS_PER_S)
    other = encounter.at_all(times)
    straight = np.zeros((len(times), 3))
    straight[:, 0] = able.speed_mps * times
    begins = min(int(begins_s * STEPS_PER_S), len(times) - 1)
    limits = np.array(
        [
            able.turn_mps2, able.acceleration_mps2, able.turn_onset_s, able.climb_onset_s,
            settings.floor_ft * FOOT_M - encounter.own_height_m,
            settings.ceiling_ft * FOOT_M - encounter.own_height_m,
        ]
    )  # fmt: skip
    speeds = np.array([able.speed_mps, max(able.slowest_mps, 0.5 * able.speed_mps)])
    climbs = np.array([able.climb_mps, -able.sink_mps, 0.0])

    def one_keeps(volume: Cylinder) -> bool:
        off = other[: begins + 1] - straight[: begins + 1]
        level = np.hypot(off[:, 0], off[:, 1])
        if np.any((level < volume.radius_m) & (np.abs(off[:, 2]) < volume.half_height_m)):
            return False
        state, work = np.zeros(7), np.zeros(7)
        state[0], state[4] = straight[begins, 0], able.speed_mps
        radius, half = volume.radius_m, volume.half_height_m
        return bool(
            _any_keeps(state, work, other[begins:], speeds, climbs, LATER_S, limits, radius, half)
        )

    return Foreseen(heard_s, one_keeps(WELL_CLEAR), one_keeps(NEAR_COLLISION))


def _find_first_report_s(encounter: ModelEncounter, settings: RiskSettings) -> float:
    """When straight flight hears the first report."""
    seed = (settings.surveillance_seed, encounter.number, 72)
    watch = Watch(surveillance_of(settings), encounter.at, encounter.lasts_s, seed)
    for second in range(int(encounter.lasts_s) + 1):
        own = np.array([settings.own_mps * second, 0.0, 0.0])
        if watch.until(float(second), own):
            return float(second)
    return math.inf


@compiled
def _any_keeps(
    start: Floats,
    state: Floats,
    other: Floats2,
    speeds: Floats,
    climbs: Floats,
    later: Floats,
    limits: Floats,
    radius: float,
    half: float,
) -> bool:
    """Whether a manoeuvre of one part or two stays outside of a cylinder about other [n, 3]."""
    never = len(other)
    for parts in range(2):
        for n in range(COURSES):
            course = 2.0 * np.pi * n / COURSES
            for speed in speeds:
                for climb in climbs:
                    if parts == 0:
                        if _keeps(start, state, other, course, speed, climb, never, course, climb,
                                  limits, radius, half):  # fmt: skip
                            return True
                        continue
                    for after in later:
                        switch = int(after * STEPS_PER_S)
                        for m in range(LATER_COURSES):
                            other_course = 2.0 * np.pi * m / LATER_COURSES
                            for other_climb in climbs:
                                if _keeps(start, state, other, course, speed, climb, switch,
                                          other_course, other_climb, limits, radius,
                                          half):  # fmt: skip
                                    return True
    return False


@compiled
def _keeps(
    start: Floats,
    state: Floats,
    other: Floats2,
    course: float,
    speed: float,
    climb: float,
    switch: int,
    later_course: float,
    later_climb: float,
    limits: Floats,
    radius: float,
    half: float,
) -> bool:
    for axis in range(7):
        state[axis] = start[axis]
    for k in range(len(other)):
        x, y = other[k, 0] - state[0], other[k, 1] - state[1]
        if x * x + y * y < radius * radius and abs(other[k, 2] - state[2]) < half:
            return False
        if k >= switch:
            course, climb = later_course, later_climb
        advance(state, course, speed, climb, limits[0], limits[1], limits[2], limits[3],
                1.0 / STEPS_PER_S, limits[4], limits[5])  # fmt: skip
    return True
