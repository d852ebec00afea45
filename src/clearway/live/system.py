"""The system that a vehicle runs: takes readings, and decides when asked.

`AvoidanceSystem` is the one object that changes, with what it is made of. Data that cannot be used
are counted by reason in `counts`, never silently lost.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from clearway.avoidance.decide import Decision, decide
from clearway.avoidance.planner import Planner
from clearway.avoidance.situation import Situation, widest_margin_m
from clearway.base.brief import in_brief, one_line
from clearway.base.checks import time_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.positional import keywords_beyond_two
from clearway.base.state import State
from clearway.live.clock import Clock
from clearway.live.danger import endangered
from clearway.live.detour import known_way
from clearway.live.dynamic_objects import unreported
from clearway.live.explain import explanation
from clearway.live.flight_decision import FlightDecision, mode_of
from clearway.live.mission import Detour, Mission, Progress, advanced, detoured, stuck
from clearway.live.own_states import Flown, OwnStates
from clearway.live.plan import Plan
from clearway.live.range_sensing import RangeSensing
from clearway.live.readings import DataLimits, Reading, reading_of
from clearway.live.reports import reports_for
from clearway.live.waiting import Waiting
from clearway.live.warm_up import warm_up_moments, with_something_near
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import AnySensor, Scan, range_sensors
from clearway.sensors.detection import Rule
from clearway.traffic import Intruder, TrackerSettings
from clearway.vehicle.automaton import Movement
from clearway.vehicle.buffer import MovementBuffer

GROWN = 0.01
"""Share of the safety margin by which the margin must have grown to be news."""


@keywords_beyond_two
class AvoidanceSystem:
    """Feed it with `update`, ask it with `due` and `decide`; call `warm_up` before take-off.

    Whoever asks tells the time, and readings are held against it: they wait for the next question.
    A clock that is set, either way, is counted and told; see `live.clock`.

    detection_rule: how hits become P_OD. ground_m: height of the world below which returns come
    from the ground and are no obstacles; whoever sets it keeps the aircraft above by other means.
    tracker: reports of intruders are made into tracks first; None believes each as it comes, save
    own, repeated, late and stale ones.
    address: the own transponder's, by which the tracker knows own echoes; by place where empty.
    follow_movers: what moves and is seen by LiDAR alone counts as intruders too.
    lidars: LiDARs, and whatever else is a `sensors.RangeSensor`; with several of them, those that
    the others contradict are no longer believed (see `sensors.trust`).

    >>> import numpy as np
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> mission = cw.Mission("out", cw.State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    >>> system = cw.AvoidanceSystem(cw.Planner.of(library), mission)
    >>> system.update(cw.State(np.zeros(3)))
    >>> system.due(0.0), system.decide(0.0).mode.value, system.movement_at(0.5).name
    ('the buffer is empty', 'navigation', 'Straight')
    """

    def __init__(
        self,
        planner: Planner,
        mission: Mission,
        lidars: Sequence[AnySensor] = (),
        obstacle_map: ObstacleMap | None = None,
        limits: DataLimits | None = None,
        detour: Detour | None = None,
        detection_rule: Rule = "ratio",
        ground_m: float = -np.inf,
        tracker: TrackerSettings | None = None,
        address: str = "",
        follow_movers: bool = False,
    ) -> None:
        self.planner = planner
        self.mission = mission
        self.obstacle_map = obstacle_map
        self.limits = limits or DataLimits()
        self.floor_m = -np.inf
        """Height of the world that no decision leads below; whoever flies may set it."""
        self.progress = Progress()
        self.counts: Counter[str] = Counter()
        self._detour = detour
        self._tracker = tracker
        self._address = address
        self._follow_dynamic_objects = follow_movers
        self._clock = Clock(self.limits.state_s)
        self._waiting = Waiting(self.limits.ahead_s)
        self._flown = Flown(planner.automaton, self.limits.history_s)
        self._own_states = OwnStates(self.limits.history_s, self._flown)
        self._sensing = RangeSensing(
            planner,
            range_sensors(lidars),
            self.limits,
            detection_rule=detection_rule,
            ground_m=ground_m,
            follow_movers=follow_movers,
        )
        self._reports = reports_for(tracker, self.limits.intruder_s, planner.speed_mps, address)
        self._plan = Plan(planner.automaton)
        self._news = ""
        self._unchecked = False  # Whether the plan has not been held against the news.
        self._kept_m = np.inf  # The margin that it was last held against, at its widest.
        self._told: Counter[str] = Counter()

    def __repr__(self) -> str:
        sensors = ", ".join(self._sensing.sensors) or "no sensor"
        left_out = f"{self.counts.total()} data left out"
        return one_line(
            "AvoidanceSystem",
            (in_brief(self.mission.name), f"goal {self.progress.goal}", sensors, left_out),
        )

    # --- readings -------------------------------------------------------------------------

    def receive(self, kind: type[Reading], *values: Any, **named: Any) -> bool:
        """Make a reading of raw values and take it, as `update` does; returns whether it could be.

        For values that nobody has looked at: what a State, Scan or Intruder refuses to be made of
        is counted by what is wrong with it, where making it oneself would raise.
        """
        reading = reading_of(kind, *values, **named)
        if isinstance(reading, str):
            self.counts[reading] += 1
            return False
        self.update(reading)
        return True

    def update(self, reading: Reading) -> None:
        """Take one reading; what cannot be used is counted by reason.

        What no time makes right is counted at once, the rest when the next question tells the time.
        Raises ClearwayError for what is no reading at all.
        """
        if not isinstance(reading, State | Scan | Intruder):
            raise ClearwayError(
                f"update: takes a State, a Scan or an Intruder, got {type(reading).__name__}"
            )
        flaw = self._flaw_at_any_time(reading)
        if flaw:
            self.counts[flaw] += 1
            return
        self._waiting.put(reading)
        overdue = self._waiting.overdue_s
        if overdue is not None:
            self._take(self._clock.own(overdue), asked=False)

    def _flaw_at_any_time(self, reading: Reading) -> str | None:
        if isinstance(reading, Scan) and reading.sensor not in self._sensing.sensors:
            return "scan: unknown sensor"
        return None

    def catch_up(self, now_s: float) -> None:
        """Take in what has come, held against the time; `due` and `decide` do so themselves."""
        self._catch_up(now_s)

    def _catch_up(self, told_s: float) -> float:
        """Own time of a question, with all taken in that has come; ClearwayError for no time."""
        problem = time_problem("time", told_s)
        if problem:
            raise ClearwayError(f"question: {problem}")
        now, jumped = self._clock.ask(told_s)
        if jumped:
            self.counts[jumped] += 1
        self._take(now)
        return now

    def _take(self, now: float, *, asked: bool = True) -> None:
        unsure_mps = self.planner.speed_mps / max(self.planner.settings.sigmas, 1.0)
        ready = self._waiting.ready(now, self._clock.own, unsure_mps, asked=asked)
        self.counts.update(ready.flaws)
        for reading in ready.readings:
            if isinstance(reading, State):
                self._take_state(reading)
            elif isinstance(reading, Scan):
                self._take_scan(reading)
            else:
                self._take_report(reading)

    def _take_state(self, state: State) -> None:
        flaw = self._own_states.take(state)
        if flaw:
            self.counts[flaw] += 1
            return
        self._clock.settle(state.time_s)
        self.progress = advanced(
            self.mission,
            self.progress,
            state.position_m,
            state.time_s,
            stays_level=self.planner.automaton.stays_level,
        )

    def _take_scan(self, scan: Scan) -> None:
        flaw = self._sensing.flaw_of(scan)
        if flaw:
            self.counts[flaw] += 1
        elif not self._own_states.reach_back_to(scan.time_s):
            self.counts["scan: no own state of its time"] += 1
        else:
            self.counts.update(self._sensing.take(scan, self._own_states.at(scan.time_s)))
            if len(scan.points_m):
                self._news, self._unchecked = "new returns", True
            if not self._sensing.believes(scan.sensor):
                self.counts[f"scan: {scan.sensor} is contradicted by others"] += 1

    def _take_report(self, report: Intruder) -> None:
        flaw = self._reports.take(report)
        if flaw:
            self.counts[flaw] += 1
        else:
            self._news, self._unchecked = self._news or "new reports of traffic", True

    @property
    def trust(self) -> dict[str, float]:
        """Present trust by sensor; what is not believed at all is at 0."""
        return self._sensing.trust

    # --- decisions ------------------------------------------------------------------------

    def due(self, now_s: float) -> str | None:
        """Why a decision is due now, or None while the plan may be flown on.

        In the middle of the plan's first movement news counts only if it endangers the plan:
        decided anew with every scan, from between two movements, it would waver for ever.
        """
        now = self._catch_up(now_s)
        due = self._plan.due(now, self.progress.goal)
        if due or not (self._news or self._margin_has_grown(now)):
            return due
        verified = self.planner.settings.verify
        if self._news and not (verified and self._plan.in_first_movement(now)):
            return self._news
        if not self._unchecked:
            return None
        danger = self._endangered_at(now)
        self._unchecked = danger is not None
        return danger

    def _margin_has_grown(self, now: float) -> bool:
        """Whether more must be kept now than the plan has been held against; it then is anew."""
        if self._plan.decision is None:
            return False
        needed_m = widest_margin_m(self.planner, self._here(self._own_states.latest, now))
        if needed_m <= self._kept_m + GROWN * self.planner.settings.safety_margin_m:
            return False
        self._kept_m, self._unchecked = needed_m, True
        return True

    def _endangered_at(self, now: float) -> str | None:
        """By what the plan being flown lacks the margin, as far as is known now."""
        state = self._own_states.at(now)
        return endangered(self._plan, self.planner, self._known(state, now), now)

    def warm_up(self) -> None:
        """Compile and load all that a decision runs, on made-up data; nothing is kept of it."""
        planner, start = self.planner, self.mission.start
        sensors = self._sensing.sensors
        trial = AvoidanceSystem(
            planner,
            self.mission,
            tuple(sensors.values()),
            with_something_near(self.obstacle_map, planner, start),
            self.limits,
            follow_movers=self._follow_dynamic_objects,
            tracker=self._tracker,
            address=self._address,
        )
        for time_s, readings in warm_up_moments(planner, start, sensors):
            for reading in readings:
                trial.update(reading)
            trial.decide(time_s)
            trial._endangered_at(time_s)
            for scan in (reading for reading in readings if isinstance(reading, Scan)):
                trial._sensing.warm_up_following(scan, trial._own_states.at(time_s))
        trial._known_way(start.position_m, self.mission.goals_m[0])

    def decide(self, now_s: float) -> FlightDecision:
        """Decide for the present moment; `movement_at` and `state_at` tell what is flown then.

        Raises ClearwayError if no own state has come yet.
        """
        now = self._catch_up(now_s)
        situation, scan_age = self._situation(now)
        decision = decide(self.planner, situation, self._plan.commitment(now))
        self._kept_m = widest_margin_m(self.planner, situation)
        return self._adopt(decision, now, now_s, scan_age)

    def _adopt(
        self, decision: Decision, now: float, told_s: float, scan_age: float
    ) -> FlightDecision:
        goal = self.progress.goal
        self._plan = self._plan.after(decision, now, goal)
        self._flown.then(self._plan.buffer)
        self._news, self._unchecked = "", False
        mode = mode_of(decision, landing=self.progress.landing(self.mission))
        fresh = self.counts - self._told
        self._told = Counter(self.counts)
        if self._clock.shifted:
            decision = replace(decision, state=replace(decision.state, time_s=told_s))
        words = explanation(decision, mode, self.obstacle_map)
        if self._clock.in_doubt:
            words += "; the clock jumped, and the own place is in doubt until its next own state"
        return FlightDecision(
            told_s,
            mode,
            goal,
            decision,
            words,
            scan_age,
            dict(fresh),
        )

    def leave_plan(self) -> None:
        """Nobody flies the plan any more: the next question asks for a decision."""
        self._plan = Plan(self.planner.automaton)

    def fly_to(self, place_m: FloatArray, now_s: float) -> None:
        """A goal [3] in place of the mission, from here; a decision is due then."""
        here = self._own_states.latest
        radius = self.mission.reach_radius_m
        self.mission = Mission(f"to {in_brief(place_m)}", here, place_m[None], radius)
        self.progress = Progress(nearest_s=self._clock.own(now_s))
        self.leave_plan()

    # --- what to fly ----------------------------------------------------------------------

    @property
    def buffer(self) -> MovementBuffer:
        """The movements decided last, with their times; what is past of them is flown (6.2)."""
        buffer = self._plan.buffer
        return buffer.shifted(self._clock.told) if self._clock.shifted else buffer

    @property
    def holds_until_s(self) -> float:
        """Until when the plan may be flown without a new decision; -inf before the first one."""
        return self._clock.told(self._plan.holds_until_s)

    def movement_at(self, time_s: float) -> Movement | None:
        """What to fly at a time: of the plan decided last, from that decision to the plan's end.

        Where one movement ends, the next is flown. None before the first decision, at times before
        the last one, and past the plan's end, where `due` has long asked for the next one.
        """
        return self._plan.movement_at(self._clock.own(time_s))

    def state_at(self, time_s: float) -> State | None:
        """Where the plan has the vehicle at a time, world frame; None when `movement_at` is.

        Flown from the state that was decided for: a set-point, not an estimate of the own state.
        """
        state = self._plan.state_at(self._clock.own(time_s))
        return replace(state, time_s=time_s) if state and self._clock.shifted else state

    # --- what is known now ----------------------------------------------------------------

    def situation(self, now_s: float) -> tuple[Situation, float]:
        """All that is known at a moment, and the age of the oldest scan used (NaN without any).

        Raises ClearwayError if no own state has come yet.
        """
        situation, scan_age = self._situation(self._catch_up(now_s))
        if self._clock.shifted:
            told = self._clock.told
            situation = replace(
                situation,
                state=replace(situation.state, time_s=told(situation.state.time_s)),
                intruders=[replace(i, time_s=told(i.time_s)) for i in situation.intruders],
            )
        return situation, scan_age

    def _situation(self, now: float) -> tuple[Situation, float]:
        state = self._expected_state(now)
        self._leave_dead_end(state, now)
        for name in self._sensing.silent(now):
            self.counts[f"scan: none fresh of {name}"] += 1
        scans = self._sensing.usable_scans(now)
        detections = self._sensing.detections(scans, state, self._own_states.at)
        situation = replace(self._known(state, now), detections=detections)
        return situation, max((now - scan.time_s for scan in scans.values()), default=np.nan)

    def _here(self, state: State, now: float) -> Situation:
        """Where we are and want to go, and how sure that is; nothing of what is around."""
        latest_s = self._own_states.latest.time_s
        unknown_s = self._flown.unknown_s(latest_s, now) if now > latest_s else 0.0
        return Situation(
            state=state,
            target_m=self.progress.target(self.mission),
            next_m=self.progress.following(self.mission),
            from_m=self.progress.left(self.mission),
            reach_radius_m=self.mission.reach_radius_m,
            state_age_s=max(0.0, now - latest_s),
            unsure_m=self.planner.speed_mps * (self._clock.doubt_s + unknown_s),
            floor_m=self.floor_m,
        )

    def _known(self, state: State, now: float) -> Situation:
        """All that is known but for the cells that sensors see."""
        here = self._here(state, now)
        return replace(
            here,
            remembered=self._sensing.remembered_near(
                state.position_m, widest_margin_m(self.planner, here)
            ),
            obstacle_map=self.obstacle_map,
            intruders=self._traffic(state, now),
            range_sigma_m=self._sensing.sigma_m,
        )

    def _expected_state(self, now: float) -> State:
        """The latest own state carried to the decision time."""
        latest = self._own_states.latest
        if now - latest.time_s > self.limits.state_s or self._clock.in_doubt:
            self.counts["state: stale"] += 1
        return self._flown.carry(latest, now)

    def _traffic(self, state: State, now_s: float) -> list[Intruder]:
        """Reported intruders, and those that LiDAR alone sees."""
        reported, left_out = self._reports.intruders(state, now_s)
        self.counts.update(left_out)
        return reported + unreported(self._sensing.dynamic_objects, reported)

    def _leave_dead_end(self, state: State, now_s: float) -> None:
        """The no-progress rule: fly a detour when the goal has not come nearer for long."""
        radius = self.planner.automaton.turning_radius_m
        if not np.isfinite(radius) or self.progress.done(self.mission):
            return
        patience = self.limits.patience_turns * 2.0 * np.pi * radius / self.planner.speed_mps
        if stuck(self.progress, now_s, patience):
            self.progress = detoured(
                self.mission, self.progress, state, now_s, radius, self._detour or self._known_way
            )

    def _known_way(self, position_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
        """Round what the map and the memory show, with room to turn if there is any."""
        margin = self.planner.settings.safety_margin_m
        wide = margin + 0.5 * self.planner.automaton.turning_radius_m
        remembered = self._sensing.remembered
        return known_way(self.obstacle_map, remembered, position_m, target_m, (wide, margin))
