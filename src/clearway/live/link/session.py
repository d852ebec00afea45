"""One flight over a link, whatever the link is: readings in, decisions when due, set-points out.

A link tells what it hears by the `hear_` methods, in the world frame and by the vehicle's clock,
and asks `tick` at a set rate. Both are told the time of our monotonic clock, so that a session can
be run through anything in a test, and faster than real time.
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import replace

import numpy as np

from clearway.base.checks import check_points
from clearway.base.frames import LEVEL, FloatArray
from clearway.base.state import State
from clearway.live.link.approach import PredictedApproach, predict_approaches
from clearway.live.link.hearing import Hearing, SessionTerms
from clearway.live.link.lead import LeadTime, OwnSpeed
from clearway.live.link.link_state import LinkState, link_state
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.own_motion import OwnMotion, turn_onto
from clearway.live.link.set_point import SetPoint
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.live.preflight.doubts import is_kept_level, over_own_level
from clearway.live.system import AvoidanceSystem
from clearway.sensors import Lidar

OFF_PLAN_S = 1.0
"""At the own speed: how far off its plan a new one is decided."""
AHEAD_TICKS = 1.5
"""How long before a movement ends a vehicle with inertia decides on the next one."""
BACK_RADII = 2.0
"""Farther from the last goal, in reach radii, it is flown to anew where a pilot hands back."""
FARTHEST_GOAL_M = 1e6
"""From the vehicle: beyond it a goal is a mistake."""


class Session(Hearing):
    """Feed it with the `hear_` methods, and ask it with `tick` at a set rate.

    system: with `sensor` as its only LiDAR (None where the mission has none). counts
    grows by data that are left out, by reason.
    """

    def __init__(
        self,
        system: AvoidanceSystem,
        sensor: Lidar | None,
        terms: SessionTerms,
        counts: Counter[str],
    ) -> None:
        super().__init__(system, sensor, terms, counts)
        self.system = system
        self._has_inertia = system.planner.automaton.has_inertia
        self._lead = LeadTime(terms.lead_s)
        self._own_speed = OwnSpeed(system.planner.speed_mps)
        self._held_height_m: float | None = None  # Of a vehicle that stays level, at the last goal.
        self._told_s = 0.0  # The vehicle's time of the last tick, as its messages tell it.
        self._unreached: str | None = None  # Why goals are not, from where it was handed over.

    # --- in -------------------------------------------------------------------------------

    def _state_of(self, motion: OwnMotion) -> State:
        state = super()._state_of(motion)
        if self._has_inertia:
            asked = self.system.reference_at(state.time_s) if self._led and self._is_led else None
            if asked is not None and not self._flaw:
                self._lead.take(state.time_s, state.position_m, asked)
            return state  # Its velocity says more than the direction of its plan.
        planned = self._find_planned(state.time_s) if self._is_led and not self._flaw else None
        if planned is not None and motion.attitude_rad is None:
            state = turn_onto(planned, state, self.counts)
        return state

    def hear_goal(self, place_m: FloatArray, wall_s: float) -> str | None:
        """A goal [3], or several [n, 3], in place of the mission; why it is refused, or None."""
        goals = check_points("goal", place_m)
        radius = self.system.mission.reach_radius_m
        if self._own is None:
            return "the own position is not known"
        if not np.all(np.isfinite(goals)):
            return "it is no place"
        if np.linalg.norm(goals[0] - self._own.position_m) > FARTHEST_GOAL_M:
            return f"it is more than {FARTHEST_GOAL_M / 1000.0:,.0f} km away"
        refusal = self.terms.floor.refusal(self._ground_m, goals, radius) or self._beyond(goals)
        if refusal is None:
            self._held_height_m = self._unreached = None
            self.system.fly_to(goals, self.clock.now(wall_s))
        return refusal

    # --- out ------------------------------------------------------------------------------

    @property
    def refusal(self) -> str | None:
        """Why the vehicle may not be led on this mission; None if it may."""
        mission = self.system.mission
        floor = self.terms.floor.refusal(self._ground_m, mission.goals_m, mission.reach_radius_m)
        return floor or self._unreached

    def tick(self, wall_s: float) -> TickOutcome:
        """Decide if it is due and allowed, and say what is to be flown."""
        now = self.clock.now(wall_s)
        self.system.floor_m = self.floor_m
        self._note_hand_over()
        self._take_scans()
        self.system.followed = self._led and self._is_led
        if self._own is not None:  # Before, nobody has told the time.
            self.system.catch_up(now)
        if self._is_led and not self._led:
            # What was planned before, nobody flew.
            self.system.leave_plan()
            self._following.begin()
            self._return_if_carried_off(now)
        if not (self._led and self._is_led):
            first = self.system.progress.goal
            self._unreached = self._beyond(self.system.mission.goals_m[first:], first + 1)
        self._led = self._is_led
        self.state = self._state_at(now, wall_s)
        # A movement ends between two ticks, and is left early by a vehicle that answers late: the
        # next one is decided on before, with time to spare.
        self.system.ahead_s = max(AHEAD_TICKS * 2.0 * self.terms.lead_s, self._lead.seconds)
        flight, why, elapsed = self._decide(now)
        if flight is None and self.state.decides:
            self.system.keep_up(now)
        close: list[PredictedApproach] = []
        if flight is not None and self.motion is not None:
            close = predict_approaches(flight, self.motion, self._intruders.values())
        why_state = self._why_state(self.refusal)
        self._told_s = min(now, self.clock.estimate_arrival(wall_s))
        set_point = self._pick_set_point(now, self._leading(now, self._told_s))
        return TickOutcome(
            now, self.state, flight, why, elapsed, set_point, tuple(close), why_state
        )

    def _beyond(self, goals_m: FloatArray, first: int = 1) -> str | None:
        """Why goals [n, 3] are not reached from the own height; None where they are."""
        sensors = () if self._sensor is None else (self._sensor,)
        if self._own is None or not is_kept_level(self.system.planner.automaton, sensors):
            return None
        radius_m = self.system.mission.reach_radius_m
        return over_own_level(goals_m, float(self._own.position_m[2]), radius_m, first)

    def _state_at(self, now: float, wall_s: float) -> LinkState:
        status = self.status
        if status is None or not (status.armed and status.follows):
            # Time without progress towards a goal counts from when we are followed.
            self.system.progress = replace(self.system.progress, nearest_s=now)
        arrived = self.system.progress.is_done(self.system.mission)
        facts = self._facts(now, wall_s, arrived=arrived, refused=self.refusal is not None)
        return link_state(facts, self.terms.limits)

    def _decide(self, now: float) -> tuple[FlightDecision | None, str, float]:
        if not self.state.decides:
            return None, "", 0.0
        self._take_reports()
        why = self.system.due(now) or self._off_plan()
        if why is None:
            return None, "", 0.0
        started = time.perf_counter()
        flight = self.system.decide(now)
        return flight, why, time.perf_counter() - started

    def _return_if_carried_off(self, now: float) -> None:
        """Led again far from the last goal, the vehicle is led back: told to hold it, it would fly
        straight there."""
        mission = self.system.mission
        if self._own is None or not self.system.progress.is_done(mission):
            return
        counts = LEVEL if self.system.planner.automaton.stays_level else np.ones(3)
        away_m = float(np.linalg.norm((self._own.position_m - mission.goals_m[-1]) * counts))
        if away_m > BACK_RADII * mission.reach_radius_m:
            self._held_height_m = None
            self.system.fly_to(mission.goals_m[-1:], now)

    def _off_plan(self) -> str | None:
        """Why the plan is not what is flown: then it shows nothing that keeps clear."""
        planned = self._find_planned(self._own.time_s) if self._own is not None else None
        if planned is None or self._own is None or self._has_inertia:
            return None  # With inertia, what leaves the tube is reason enough.
        off = float(np.linalg.norm(planned.position_m - self._own.position_m))
        if off <= OFF_PLAN_S * self.system.planner.speed_mps:
            return None
        return f"the vehicle is {off:.1f} m off its plan"

    def _leading(self, now: float, told_s: float) -> SetPoint | None:
        """What to send; told_s: the vehicle's time as its latest messages tell it. After a stall it
        is earlier than ours for a while: the vehicle would chase what lies ahead."""
        if not self.state.steers or self._own is None or self.motion is None:
            return None
        arrived = self.state is LinkState.ARRIVED
        if self.state is LinkState.STALE and now > self.system.holds_until_s:
            return None
        point = self._holding() if arrived else self._on_plan(told_s)
        if point is None:
            return None
        counts_s = told_s + self.terms.lead_s
        return self._own_speed.limit(point, self._own, self.motion.velocity_mps, counts_s)

    def _on_plan(self, told_s: float) -> SetPoint | None:
        """What the plan asks for at the vehicle's time, ahead by what it is late."""
        ahead = self._find_planned(told_s + self._lead.seconds)
        movement = None if ahead is None else self.system.movement_at(ahead.time_s)
        if ahead is None or movement is None:
            return None
        asked = self.system.reference_at(ahead.time_s) if self._has_inertia else None
        if asked is not None:
            following = SetPoint.of_reference(asked)
        else:
            climb = movement.climb_mps or 0.0
            following = SetPoint.following(ahead, movement.speed_mps, climb, movement.yaw_rate_rps)
        # A plan may begin later than the vehicle's time: it is told the way there.
        return following.earlier_by(max(0.0, ahead.time_s - told_s - self._lead.seconds))

    def _escape_lasts_s(self) -> float | None:
        begins_s = self._told_s + self._lead.seconds
        ends_s = self.system.escape_ends_s(begins_s)
        return None if ends_s is None else ends_s - begins_s

    def _on_escape(self, later_s: float) -> SetPoint | None:
        return self._on_plan(self._told_s + later_s)

    def _find_planned(self, time_s: float) -> State | None:
        """Where the plan has the vehicle; it begins with a decision, which news may be older than.

        None before the first decision and past the plan's end.
        """
        planned = self.system.state_at(time_s)
        return planned or self.system.state_at(max(time_s, self.system.buffer.start_s))

    def _holding(self) -> SetPoint:
        """At the last goal, pointing as the plan left it; a vehicle that stays level, above or
        below it: on the way up or down nothing has been looked at."""
        assert self._own is not None
        yaw = float(self._own.attitude_rad[2])
        goal = self.system.mission.goals_m[-1]
        if self.system.planner.automaton.stays_level:
            if self._held_height_m is None:
                self._held_height_m = float(self._own.position_m[2])
            goal = np.array([goal[0], goal[1], self._held_height_m])
        return SetPoint.holding(goal, yaw)
