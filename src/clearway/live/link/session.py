"""One flight over a link, whatever the link is: readings in, decisions when due, set-points out.

A link tells what it hears by the `hear_` methods, in the world frame and by the vehicle's clock,
and asks `tick` at a set rate. Both are told the time of our monotonic clock, so that a session can
be run through anything in a test, and faster than real time.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.flight_decision import FlightDecision
from clearway.live.link.aircraft import AircraftHeard, AircraftReport, TrafficTerms
from clearway.live.link.approach import PredictedApproach, approaches
from clearway.live.link.floor import FloorRule
from clearway.live.link.following import SetPointsFollowed
from clearway.live.link.link_state import LinkFacts, LinkLimits, LinkState, link_state
from clearway.live.link.own_motion import OwnMotion, turned_onto
from clearway.live.link.placed_scans import PlacedScans, ScanMaker
from clearway.live.link.set_point import SetPoint
from clearway.live.link.status import VehicleStatus
from clearway.live.link.vehicle_clock import Tick, VehicleClock
from clearway.live.system import AvoidanceSystem
from clearway.sensors import Lidar
from clearway.traffic import Intruder

SLOWEST = 0.3
"""Share of the speed of a movement below which the heading stands for the direction of flight."""
MOST_LEAD_S, OFF_PLAN_S = 0.3, 1.0
"""At the own speed: how far ahead of the vehicle set-points are at most, and how far off its plan a
new one is decided."""
FARTHEST_GOAL_M = 1e6
"""From the vehicle: beyond it a goal is a mistake."""
HOLDS = 3
"""How often a last set-point to hold is sent: one may get lost."""


@dataclass(frozen=True, slots=True)
class SessionTerms:
    """How a session is run."""

    act: bool = False
    """Lead the vehicle; otherwise only decide."""
    lead_s: float = 0.05
    """How far ahead on the plan set-points are: half a tick, since each counts for one."""
    limits: LinkLimits = field(default_factory=LinkLimits)
    speedup: float | None = 1.0
    """Of the vehicle's clock against ours; None for lock-step."""
    traffic: TrafficTerms = field(default_factory=TrafficTerms)
    floor: FloorRule = field(default_factory=lambda: FloorRule(0.0, -math.inf))


@dataclass(frozen=True, slots=True, eq=False)
class TickOutcome:
    """What a tick came to."""

    time_s: float
    """The vehicle's time."""
    state: LinkState
    flight: FlightDecision | None
    """The decision, if one was due."""
    why_now: str
    elapsed_s: float
    """That the decision took."""
    set_point: SetPoint | None
    """What is sent, or would be."""
    approaches: tuple[PredictedApproach, ...]
    why_state: str = ""
    """More on the state, where there is more to say."""
    messages: tuple[object, ...] = ()
    """What the link sends for it, in this order."""
    notes: tuple[str, ...] = ()
    """What whoever watches is told now."""


class Link(Protocol):
    """A way to a vehicle, as the loop runs it: MAVLink, ROS 2, a recording."""

    def hear(self, wall_s: float) -> None:
        """Tell the session all that has come; never waits."""
        ...

    def tick(self, wall_s: float) -> TickOutcome:
        """Ask the session, and send what it says."""
        ...

    def wait(self, seconds: float) -> None:
        """Until something comes, but no longer."""
        ...

    def end(self) -> None:
        """Say what is said last: to hold, where the vehicle was led."""
        ...

    def close(self) -> None: ...


class Session:
    """Feed it with the `hear_` methods, and ask it with `tick` at a set rate.

    system: warmed up, with `sensor` as its only LiDAR (None where the mission has none). counts
    grows by data that are left out, by reason.
    """

    def __init__(
        self,
        system: AvoidanceSystem,
        sensor: Lidar | None,
        terms: SessionTerms,
        counts: Counter[str],
    ) -> None:
        self.system, self.terms, self.counts = system, terms, counts
        self.status: VehicleStatus | None = None
        self.state = LinkState.WAITING
        self.clock = VehicleClock(terms.speedup)
        self.motion: OwnMotion | None = None
        self._sensor = sensor
        self._traffic = AircraftHeard(terms.traffic, counts)
        self._intruders: dict[str, Intruder] = {}
        self._reports: dict[str, Intruder] = {}
        self._own: State | None = None
        self._scans = PlacedScans(sensor is not None, counts)
        self._pulse_s = -math.inf
        self._ground_m: float | None = None
        self._held_height_m: float | None = None  # Of a vehicle that stays level, at the last goal.
        self._restarted = False
        self._following = SetPointsFollowed(system.planner.speed_mps)
        self._led = False  # Whether the last tick would have had the vehicle follow.
        self._last: SetPoint | None = None  # The last one sent that moves.
        self._holds = 0

    @property
    def own_s(self) -> float | None:
        """Time of the newest own position; None before any."""
        return None if self._own is None else self._own.time_s

    # --- in -------------------------------------------------------------------------------

    def hear_status(self, status: VehicleStatus, wall_s: float) -> None:
        """The vehicle's pulse, and what it says of itself."""
        self._pulse_s, self.status = wall_s, status

    def hear_time(self, time_s: float, wall_s: float) -> bool:
        """A time by the vehicle's clock; whether what was told with it may be used."""
        tick = self.clock.take(time_s, wall_s)
        if tick is not Tick.GOOD:
            self.counts[str(tick)] += 1
        if tick is Tick.RESTARTED:
            self._restarted = True
        return tick not in (Tick.STRAY, Tick.RESTARTED)

    def hear_motion(self, motion: OwnMotion) -> None:
        """Where the vehicle is and how it moves, at a time that was heard."""
        state = motion.state(SLOWEST * self.system.planner.speed_mps)
        planned = self._planned(state.time_s) if self._is_led and not self._flaw else None
        if planned is not None and motion.attitude_rad is None:
            state = turned_onto(planned, state, self.counts)
        if self._own is None or state.time_s > self._own.time_s:
            self.motion, self._own = motion, state
            self._scans.move(state, motion.heading_rad)
        self.system.update(state)

    def hear_scan(self, told_s: float | None, scan_at: ScanMaker, wall_s: float) -> None:
        """A scan, to be made for the own state of its time; told_s: None where nothing is told."""
        arrived_s = self.clock.arrived(wall_s)
        self._scans.take(told_s, arrived_s, self.clock.now(wall_s), scan_at)

    def hear_aircraft(self, report: AircraftReport, wall_s: float) -> None:
        """Another aircraft; nothing can be made of it before the own place is known."""
        assert self.motion is not None
        now = self.clock.now(wall_s)
        intruder = self._traffic.take(report, now, self.motion)
        if intruder is not None:
            oldest = now - self.terms.traffic.oldest_s
            self._intruders = {k: i for k, i in self._intruders.items() if i.time_s >= oldest}
            self._intruders[intruder.name] = self._reports[intruder.name] = intruder

    def hear_ground(self, height_m: float) -> None:
        """Height of the home in the world frame."""
        if math.isfinite(height_m):
            self._ground_m = height_m
            self.system.floor_m = self.floor_m

    def hear_target(self, place_m: FloatArray) -> None:
        """Where the vehicle says that it flies to, world frame."""
        if self._is_led:
            self._following.hear_target(place_m)

    def hear_goal(self, place_m: FloatArray, wall_s: float) -> str | None:
        """A goal [3], or several [n, 3], in place of the mission; why it is refused, or None."""
        goals = np.asarray(place_m, dtype=np.float64).reshape(-1, 3)
        radius = self.system.mission.reach_radius_m
        if self._own is None:
            return "the own place is not known"
        if not np.all(np.isfinite(goals)):
            return "it is no place"
        if np.linalg.norm(goals[0] - self._own.position_m) > FARTHEST_GOAL_M:
            return f"it is more than {FARTHEST_GOAL_M / 1000.0:,.0f} km away"
        refusal = self.terms.floor.refusal(self._ground_m, goals, radius)
        if refusal is None:
            self._held_height_m = None
            self.system.fly_to(goals, self.clock.now(wall_s))
        return refusal

    # --- out ------------------------------------------------------------------------------

    @property
    def floor_m(self) -> float:
        """How low the vehicle is led at most, world frame; -inf without a floor."""
        return self.terms.floor.height_m(self._ground_m)

    @property
    def refusal(self) -> str | None:
        """Why the vehicle may not be led on this mission; None if it may."""
        mission = self.system.mission
        return self.terms.floor.refusal(self._ground_m, mission.goals_m, mission.reach_radius_m)

    @property
    def _is_led(self) -> bool:
        """Whether the vehicle should do what we say."""
        status = self.status
        return (
            self.terms.act
            and status is not None
            and status.armed
            and status.follows
            and status.airborne is True
        )

    @property
    def _flaw(self) -> str | None:
        return self._following.flaw if self._is_led else None

    def tick(self, wall_s: float) -> TickOutcome:
        """Decide if it is due and allowed, and say what is to be flown."""
        now = self.clock.now(wall_s)
        self.system.floor_m = self.floor_m
        for scan in self._scans.placed():
            self.system.update(scan)
        self.system.catch_up(now)
        if self._is_led and not self._led:
            # What was planned before, nobody flew.
            self.system.leave_plan()
            self._following.begin()
        self._led = self._is_led
        self.state = self._state_at(now, wall_s)
        flight, why, elapsed = self._decide(now)
        close: list[PredictedApproach] = []
        if flight is not None and self.motion is not None:
            close = approaches(flight, self.motion, self._intruders.values())
        set_point = self._set_point(now)
        return TickOutcome(
            now, self.state, flight, why, elapsed, set_point, tuple(close), self._why_state()
        )

    def farewell(self) -> SetPoint | None:
        """The last set-point, when the session ends: to hold where the vehicle was led to."""
        last, self._last = self._last, None
        return last.held() if last is not None and self.state.may_hold else None

    def _why_state(self) -> str:
        if self.state is LinkState.REFUSED:
            return self.refusal or ""
        if self.state is LinkState.NOT_FOLLOWED:
            return self._flaw or ""
        status = self.status
        silent = status is not None and status.armed and status.airborne is None
        if self.state is LinkState.ON_GROUND and silent:
            return "nothing says that the vehicle is in the air"
        return ""

    def _state_at(self, now: float, wall_s: float) -> LinkState:
        status, act = self.status, self.terms.act
        if status is None or not (status.armed and status.follows):
            # Patience with a goal that does not come nearer begins when we are followed.
            self.system.progress = replace(self.system.progress, nearest_s=now)
        flies = status is not None and status.armed and status.airborne is True
        facts = LinkFacts(
            heartbeat_age_s=wall_s - self._pulse_s,
            position_age_s=math.inf if self._own is None else now - self._own.time_s,
            distances_age_s=None if self._sensor is None else now - self._scans.newest_s,
            restarted=self._restarted,
            arrived=self.system.progress.done(self.system.mission),
            airborne=flies or not act,
            refused=act and self.refusal is not None,
            mode_follows=status is None or status.follows,
            followed=self._flaw is None,
        )
        return link_state(facts, self.terms.limits)

    def _decide(self, now: float) -> tuple[FlightDecision | None, str, float]:
        if not self.state.decides:
            return None, "", 0.0
        for report in self._reports.values():
            self.system.update(report)
        self._reports.clear()
        why = self.system.due(now) or self._off_plan()
        if why is None:
            return None, "", 0.0
        started = time.perf_counter()
        flight = self.system.decide(now)
        return flight, why, time.perf_counter() - started

    def _off_plan(self) -> str | None:
        """Why the plan is not what is flown: then it shows nothing that keeps clear."""
        planned = self._planned(self._own.time_s) if self._own is not None else None
        if planned is None or self._own is None:
            return None
        off = float(np.linalg.norm(planned.position_m - self._own.position_m))
        if off <= OFF_PLAN_S * self.system.planner.speed_mps:
            return None
        return f"the vehicle is {off:.1f} m off its plan"

    def _set_point(self, now: float) -> SetPoint | None:
        """What to send; where set-points end, the last one to hold, a few times."""
        found = self._leading(now)
        if found is not None and self._own is not None:
            found = found.above(self.floor_m)
            if found.velocity_mps is None:
                self._last, self._holds = None, 0
            else:
                self._last, self._holds = found, HOLDS
                if self._is_led:
                    place = self._own.position_m
                    self._following.tell(now, found.position_m, found.velocity_mps, place)
            return found
        self._following.begin()
        if self._last is None or self._holds == 0 or not self.state.may_hold:
            self._last = None
            return None
        self._holds -= 1
        return self._last.held()

    def _leading(self, now: float) -> SetPoint | None:
        if not self.state.steers or self._own is None:
            return None
        if self.state is LinkState.ARRIVED:
            return self._holding()
        if self.state is LinkState.STALE and now > self.system.holds_until_s:
            return None
        ahead = self._planned(now + self.terms.lead_s)
        movement = None if ahead is None else self.system.movement_at(ahead.time_s)
        if ahead is None or movement is None:
            return None
        speed = self.system.planner.speed_mps
        age_s = max(0.0, now + self.terms.lead_s - self._own.time_s)
        lead_m = speed * (MOST_LEAD_S + age_s)
        following = SetPoint.following(ahead, movement.speed_mps, movement.climb_mps or 0.0)
        return following.led_by_at_most(self._own.position_m, lead_m)

    def _planned(self, time_s: float) -> State | None:
        """Where the plan has the vehicle; it begins with a decision, which news may be older than.

        None before the first decision and past the plan's end.
        """
        return self.system.state_at(max(time_s, self.system.buffer.start_s))

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
