"""Why a vehicle with inertia is as fast as it is, and how far it sees: for those who ask.

Nothing here decides anything. A decision is looked at afterwards: which faster first movements
there were, and what became of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from clearway.avoidance.choose.chosen import Choice
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.time_cost import ARRIVAL_MPS, speed_abilities
from clearway.avoidance.rate.goal import Goal
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray, State
from clearway.sensors.observed.sight import measure_sight
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.class_table import ClassTable

DIRECTIONS = 72
"""In which sight is measured, all round."""
STEP_M = 0.5
"""Between the places that are looked up along a direction."""
AHEAD_RAD = np.radians(7.5)
"""How far off the course a direction counts as ahead."""
FASTER_MPS = 1e-6
"""Difference of two speeds that is more than rounding."""


class SpeedLimit(StrEnum):
    """What keeps a vehicle from being faster after its next movement."""

    GREATEST = "the mission's greatest speed"
    GAINING = "gaining speed as fast as it can"
    SIGHT = "limited by sight: faster, it could not brake within observed free space"
    CLEARANCE = "limited by clearance: faster, it would come too near to what stands there"
    GOAL = "limited by the goal: faster, it could not stop there"
    WAY = "limited by the turns: faster, they would take longer"
    ESCAPE = "flying the escape held, since nothing else leaves one"


@dataclass(frozen=True, slots=True)
class SpeedChoice:
    """The speeds of a decision, and what limits them."""

    now_mps: float
    next_mps: float
    """After the first movement."""
    plan_mps: tuple[float, ...]
    """At the end of each movement of the plan."""
    greatest_mps: float
    """Of the mission."""
    limit: SpeedLimit

    @property
    def in_words(self) -> str:
        """One line: from which speed to which one, of how much, and why no faster."""
        speeds = f"{self.now_mps:.1f} to {self.next_mps:.1f}"
        if abs(self.next_mps - self.now_mps) <= FASTER_MPS:
            speeds = f"stays {self.now_mps:.1f}"
        return f"speed {speeds} of {self.greatest_mps:.3g} m/s, {self.limit}"


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """How far observed free space reached at a decision, level and all round."""

    free_m: FloatArray
    """[n] from the vehicle's place on, counter-clockwise from the world's x axis."""
    ahead_m: float
    """The farthest of those near the course."""
    cap_mps: float
    """The greatest speed from which the vehicle stops within `ahead_m`."""

    @property
    def azimuths_rad(self) -> FloatArray:
        """[n] directions of `free_m`, world frame."""
        return _azimuths(len(self.free_m))


class SpeedTerms(NamedTuple):
    """What a decision's speed is explained by."""

    automaton: MovementAutomaton
    state: State
    movements: tuple[str, ...]
    choice: Choice
    flies_escape: bool
    ways: WaysOut
    no_way_out: tuple[str, ...]
    """First movements after which no escape was found."""
    goal: Goal


def explain_speed(terms: SpeedTerms) -> SpeedChoice | None:
    """Return the speeds of a decision and what limits them; None without inertia."""
    classes = terms.automaton.classes
    if classes is None:
        return None
    at = classes.class_at(float(terms.state.attitude_rad[0]))
    if terms.flies_escape:
        ends = _find_flown_classes(classes, at, terms.movements)
    else:
        reach_set = terms.choice.grounds.prepared.reach_set
        ends = classes.classes_at(reach_set.states[reach_set.path(terms.choice.node), 3])
    speeds = classes.speed_mps
    plan = tuple(float(speeds[end]) for end in ends)
    limit = _limit_of(terms, classes, at, plan[0])
    return SpeedChoice(float(speeds[at]), plan[0], plan, float(speeds.max()), limit)


def _find_flown_classes(classes: ClassTable, at: int, movements: tuple[str, ...]) -> IntArray:
    """[n] classes at the ends of movements."""
    ends = []
    for name in movements:
        at = classes.after(at, classes.names.index(name))
        ends.append(at)
    return np.array(ends)


def _limit_of(terms: SpeedTerms, classes: ClassTable, at: int, next_mps: float) -> SpeedLimit:
    """What became of the first movements that end faster."""
    if terms.flies_escape:
        return SpeedLimit.ESCAPE
    ends = classes.following[at]
    faster = np.flatnonzero((ends >= 0) & (classes.speed_mps[ends] > next_mps + FASTER_MPS))
    if not len(faster):
        greatest = next_mps > float(classes.speed_mps.max()) - FASTER_MPS
        return SpeedLimit.GREATEST if greatest else SpeedLimit.GAINING
    banned = (classes.names.index(name) for name in terms.no_way_out)
    without = [movement for movement in banned if movement in faster]
    if without:
        # An escape that only sight forbids is found by those who need not see.
        blind = any(terms.ways.after(movement, strict=False) is not None for movement in without)
        return SpeedLimit.SIGHT if blind else SpeedLimit.CLEARANCE
    if any(movement in faster for movement in terms.ways.shunned):
        return SpeedLimit.SIGHT
    first = terms.choice.grounds.prepared.first_movement
    if any(int(first[other.node]) in faster for other in terms.choice.ruled_out):
        return SpeedLimit.CLEARANCE
    if _nears_goal(terms, float(classes.speed_mps[ends[faster]].max())):
        return SpeedLimit.GOAL
    return SpeedLimit.WAY


def _nears_goal(terms: SpeedTerms, faster_mps: float) -> bool:
    """Whether a faster vehicle could no longer stop at its last goal."""
    if not terms.goal.final:
        return False
    able = speed_abilities(terms.automaton)
    away_m = float(np.hypot(terms.goal.target_m[0], terms.goal.target_m[1]))
    return float(np.sqrt(2.0 * able.acceleration_mps2 * away_m)) + ARRIVAL_MPS < faster_mps


def measure_sight_from(planner: Planner, state: State, ways: WaysOut | None) -> Sight | None:
    """Return what was seen to be free around a decision, asked before later scans change it; None
    without inertia or where escapes need not be seen."""
    automaton = planner.automaton
    if ways is None or not ways.strict or automaton.classes is None:
        return None
    able, lasts_s = speed_abilities(automaton), automaton.movements[0].duration_s
    radius, farthest = planner.settings.body_radius_m, planner.grid.range_m
    azimuths, place = _azimuths(DIRECTIONS), np.ascontiguousarray(state.position_m)
    free_m = measure_sight(ways.seen, place, azimuths, radius, STEP_M, farthest)
    course = float(state.attitude_rad[2])
    off = np.abs((azimuths - course + np.pi) % (2.0 * np.pi) - np.pi)
    ahead_m = float(free_m[off <= AHEAD_RAD].max())
    most = able.acceleration_mps2
    cap = float(np.sqrt((most * lasts_s) ** 2 + 2.0 * most * ahead_m) - most * lasts_s)
    return Sight(free_m, ahead_m, min(cap, able.fastest_mps))


def _azimuths(count: int) -> FloatArray:
    return 2.0 * np.pi * np.arange(count) / count
