"""The system that a vehicle runs: takes readings, and decides when asked.

`AvoidanceSystem` is the one object that changes, with what it is made of. Data that cannot be used
are counted by reason in `counts`, never silently lost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from clearway.avoidance.choose.candidates import STANDING_IS_WANTED
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import BY_SIGHT, Escape
from clearway.avoidance.plan.planner import Planner, prepare_next
from clearway.avoidance.plan.situation import Situation
from clearway.base.brief import in_brief, one_line
from clearway.base.checks import LARGEST, check_points, kind_of, number_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.inputs.readings import TIME_TOLERANCE_S, Reading
from clearway.live.knowledge import Knowledge
from clearway.live.mission import Detour, Mission, Mode, Progress
from clearway.live.outputs.alarms import AlarmFacts, AlarmWatch
from clearway.live.outputs.alerting import TrafficPicture, coverings_after, traffic_picture
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.live.outputs.kept_clearance import KeptClearance, bound_clearance, view_of
from clearway.live.outputs.modes import ModeFacts, ModeState, mode_after
from clearway.live.plan import Plan
from clearway.live.preflight.escape_plan import escape_plan
from clearway.live.recovery.dead_end import keep_up, out_of_dead_end
from clearway.live.recovery.risk_level import Insistence
from clearway.live.watch import PlanWatch
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import AnySensor
from clearway.sensors.range_sensor import range_sensors
from clearway.traffic.covering import Covering
from clearway.traffic.volumes import Alerts
from clearway.vehicle.automaton import Movement
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.reference import Reference


class AvoidanceSystem:
    """Feed it with `update`, ask it with `due` and `decide`.

    The caller tells the time, and readings are checked against it: they wait for the next
    question. A clock that is set, either way, is counted and told; see `live.inputs.clock`.

    Parameters
    ----------
    planner
        Its settings say how readings are taken too.
    mission
        What to fly, world frame.
    lidars
        LiDARs, and whatever else is a `sensors.RangeSensor`. Of several, those that the others
        contradict are no longer believed (see `sensors.several.trust`).
    obstacle_map
        What was known before take-off, world frame.
    detour
        Finds a way round what blocks the goal, world frame; None goes by what is known.

    Raises
    ------
    ClearwayError
        For a planner or a mission that is none.

    Examples
    --------
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
        *,
        lidars: Sequence[AnySensor] = (),
        obstacle_map: ObstacleMap | None = None,
        detour: Detour | None = None,
    ) -> None:
        kind_of("avoidance system: planner", planner, Planner)
        kind_of("avoidance system: mission", mission, Mission)
        if obstacle_map is not None:
            kind_of("avoidance system: obstacle_map", obstacle_map, ObstacleMap)
        range_sensors(lidars)  # Refuses what are none, and twins.
        self.escape = escape_plan(planner, lidars, obstacle_map, mission.start)
        """Which escapes this flight holds, and why."""
        self.planner = planner = self.escape.adapt_planner(planner)
        self.obstacle_map = obstacle_map
        self._known = Knowledge(planner, mission, lidars, obstacle_map)
        self.counts = self._known.counts
        self._insistence = Insistence(planner) if self.escape.insists else None
        self._detour = detour
        self._plan = Plan(planner.automaton)
        self._alerts = Alerts()
        self._coverings: dict[str, Covering] = {}
        self._mode: ModeState | None = None
        promised = self.escape.within if self.escape.flown in BY_SIGHT else None
        self._alarm_watch = AlarmWatch(planner, tuple(lidars), promised)
        self._watch = PlanWatch(planner, self._known)
        self._view = view_of(self._known.sensing.sensors.values())
        self._kept: KeptClearance | None = None
        self._told: dict[str, int] = {}

    def __repr__(self) -> str:
        sensors = ", ".join(self._known.sensing.sensors) or "no sensor"
        left_out = f"{self.counts.total()} data left out"
        return one_line(
            "AvoidanceSystem",
            (in_brief(self.mission.name), f"goal {self.progress.goal}", sensors, left_out),
        )

    @property
    def progress(self) -> Progress:
        """How far along the mission own state estimates have come."""
        return self._known.progress

    @progress.setter
    def progress(self, progress: Progress) -> None:
        self._known.progress = progress

    @property
    def mission(self) -> Mission:
        """What is flown; `fly_to` puts another in its place."""
        return self._known.mission

    @property
    def followed(self) -> bool:
        """Whether the vehicle flies what is decided; a caller that knows sets it. Where a pilot
        flies, going elsewhere than decided tells nothing of the wind."""
        return self._known.followed

    @followed.setter
    def followed(self, is_so: bool) -> None:
        self._known.followed = is_so

    @property
    def floor_m(self) -> float:
        """Height of the world that no decision leads below; the caller may set it, -inf for
        none. Raises ClearwayError for what is no height."""
        return self._known.floor_m

    @floor_m.setter
    def floor_m(self, height_m: float) -> None:
        self._known.floor_m = _height_or_none("floor_m", height_m)

    @property
    def ahead_s(self) -> float:
        """How long before a movement of a vehicle with inertia ends the next one is decided; a
        caller that asks at a set rate sets it, so that a question comes in time."""
        return self._watch.ahead_s

    @ahead_s.setter
    def ahead_s(self, seconds: float) -> None:
        self._watch.ahead_s = seconds if self.planner.automaton.has_inertia else 0.0

    # --- readings -------------------------------------------------------------------------

    def receive(self, kind: type[Reading], *values: Any, **named: Any) -> bool:
        """Make a reading of raw values and take it, as `update` does.

        For values that are not checked yet: what a State, Scan or Intruder refuses to be made of
        is counted by what is wrong with it, where making it oneself would raise.

        Parameters
        ----------
        kind
            What to make: `State`, `Scan` or `Intruder`.
        *values
            Its arguments by place.
        **named
            Its arguments by name.

        Returns
        -------
        bool
            Whether the reading could be made.
        """
        return self._known.receive(kind, *values, **named)

    def update(self, reading: Reading) -> None:
        """Take one reading; what cannot be used is counted by reason.

        What no time makes right is counted at once, the rest when the next question tells the time.

        Parameters
        ----------
        reading
            Own state estimate, scan or intruder, as reported.

        Raises
        ------
        ClearwayError
            For what is no reading at all.
        """
        self._known.put(reading)

    def catch_up(self, now_s: float) -> None:
        """Take in what has come, checked against the time; `due` and `decide` do so themselves.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Raises
        ------
        ClearwayError
            For what is no time.
        """
        self._known.catch_up(now_s)

    @property
    def trust(self) -> dict[str, float]:
        """Present trust by sensor; what is not believed at all is at 0."""
        return self._known.sensing.trust

    # --- decisions ------------------------------------------------------------------------

    def due(self, now_s: float) -> str | None:
        """Return why a decision is due now.

        In the middle of the plan's first movement news counts only if it endangers the plan:
        decided anew with every scan, from between two movements, it would waver for ever.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Returns
        -------
        str or None
            The reason in words; None while the plan may be flown on.

        Raises
        ------
        ClearwayError
            For what is no time.
        """
        return self._watch.due(self._plan, self._known.catch_up(now_s))

    def warm_up(self) -> None:
        """Prepare every reach set, so that no decision has to; a second for a fast copter."""
        list(self.planner.prepared_sets)

    def decide(self, now_s: float) -> FlightDecision:
        """Decide for the present moment; `movement_at` and `state_at` tell what is flown then.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Returns
        -------
        FlightDecision
            What to fly from now on, in which mode, and why.

        Raises
        ------
        ClearwayError
            If no own state estimate has come yet, and for what is no time.
        """
        now = self._known.catch_up(now_s)
        insistence = self._insistence
        blind = self._blind_s(now) is not None
        planner = insistence.decides(self._known, now, blind=blind) if insistence else self.planner
        situation, scan_age = self._situation(now)
        begins_s = situation.state.time_s if self.planner.automaton.has_inertia else now
        commitment = self._plan.in_force(now).commitment(begins_s, self.escape.within, blind=blind)
        if self.planner.automaton.has_inertia and commitment.under_way is not None:
            # Begun anew in the middle of a movement: what was held began elsewhere.
            commitment = replace(commitment, way_out=None, under_way=None)
        if self.progress.closed:
            # Where nothing leads on.
            commitment = replace(commitment, stood=STANDING_IS_WANTED, stays=True)
        decision = decide(planner, situation, commitment=commitment)
        self._kept = bound_clearance(decision, self._view, self._plan.decision, self._kept)
        self._watch.note_decision(situation)
        picture = self._look_at_traffic(situation)
        self._follow(decision, now, begins_s)
        return self._describe_flight(decision, now, now_s, scan_age, picture)

    def keep_up(self, now_s: float) -> None:
        """Do what is soon due beside decisions; for callers with time between them.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Raises
        ------
        ClearwayError
            If no own state estimate has come yet, and for what is no time.
        """
        now = self._known.catch_up(now_s)
        if self.planner.automaton.has_inertia:
            prepare_next(self.planner, self._known.flown.class_at(now))
            return
        self.progress = keep_up(self._known, self._known.own_states.latest, now)

    def _blind_s(self, now: float) -> float | None:
        """For how long no sensor has told anything, where escapes rest on what they tell."""
        rests = self.escape.flown in (*BY_SIGHT, Escape.KNOWN)
        return self._known.blind_s(now) if rests else None

    def _look_at_traffic(self, situation: Situation) -> TrafficPicture | None:
        """Alerts and bands, where volumes are asked for."""
        volumes = self.planner.settings.alert_volumes
        if volumes is None:
            return None
        self._coverings = coverings_after(self._coverings, situation.intruders)
        able = self.planner.performance
        picture = traffic_picture(self._alerts, volumes, able, situation, self._coverings)
        self._alerts = picture.alerts
        return picture

    def _follow(self, decision: Decision, now: float, begins_s: float) -> None:
        """From a time on what was decided is flown, and until then what is flown now."""
        plan, classes = self._plan.in_force(now), self.planner.automaton.classes
        ahead = begins_s > now + TIME_TOLERANCE_S
        self._plan = plan.after(decision, begins_s, self.progress.goal, ahead=ahead)
        at = None
        if classes is not None and classes.has_speeds:
            at = classes.class_at(float(decision.state.attitude_rad[0]))
        self._known.flown.then(self._plan.buffer, at)
        self._known.news, self._known.unchecked = "", False

    def _describe_flight(
        self,
        decision: Decision,
        now: float,
        told_s: float,
        scan_age: float,
        picture: TrafficPicture | None,
    ) -> FlightDecision:
        goal = self.progress.goal
        blind_s = self._blind_s(now)
        bold = self._insistence is not None and self._insistence.bold and blind_s is None
        routes = self._known.route_planner if self.progress.closed else None
        searched = "" if routes is None else routes.searched
        facts = ModeFacts(decision, self.progress, self.mission, blind_s, bold, searched)
        self._mode = mode_after(self._mode, facts)
        had_escape, alarm_watch = self._plan.had_certain, self._alarm_watch
        false_share = self._known.sensing.false_share
        scatter_m = self._known.scatter.std_m
        wrong = AlarmFacts(
            decision, self._mode, self.progress, self.mission, had_escape, false_share, scatter_m
        )
        self._alarm_watch = alarm_watch.after(wrong) if self.followed else alarm_watch.afresh()
        told = self._told  # By hand: to subtract counters takes five times as long.
        fresh = {
            why: n - told.get(why, 0) for why, n in self.counts.items() if n > told.get(why, 0)
        }
        if fresh:
            self._told = dict(self.counts)
        if self._known.clock.shifted:
            later_s = decision.state.time_s - now
            decision = replace(decision, state=replace(decision.state, time_s=told_s + later_s))
        return FlightDecision(
            told_s,
            self._mode,
            goal,
            decision,
            self.obstacle_map,
            self._known.clock.in_doubt,
            scan_age,
            fresh,
            picture,
            self._known.blind_s(now),
            self._alarm_watch.alarms,
            false_share,
            self._kept,
        )

    def leave_plan(self) -> None:
        """Nobody flies the plan any more: the next question asks for a decision."""
        self._plan = Plan(self.planner.automaton, had_certain=self._plan.had_certain)

    def begin_at(self, place_m: FloatArray) -> None:
        """Take a place for the start, where the vehicle is handed over elsewhere.

        The ball about it counts as seen to be free, as far as nothing was seen to stand in it.

        Parameters
        ----------
        place_m
            [3] world frame.

        Raises
        ------
        ClearwayError
            For what is no such place.
        """
        self._known.sensing.begin_at(place_m)

    def forget_free_space(self) -> None:
        """Count nothing as seen to be free any more: the own position has jumped."""
        self._known.sensing.forget_free_space()

    def fly_to(self, place_m: npt.ArrayLike, now_s: float) -> None:
        """Fly to one or several goals in place of the mission, from here; a decision is due.

        Parameters
        ----------
        place_m
            [3], or several [n, 3] in their order, world frame.
        now_s
            The present time, on the clock of the readings.

        Raises
        ------
        ClearwayError
            For what are no such places, and before an own state estimate has come.
        """
        known = self._known
        radius = self.mission.reach_radius_m
        mission = Mission(
            "a new goal",
            known.own_states.latest,
            waypoints_m=check_points("fly_to", place_m),
            reach_radius_m=radius,
        )
        known.fly(mission, known.clock.own(now_s))
        self._insistence = Insistence(self.planner) if self.escape.insists else None
        self.leave_plan()

    # --- what to fly ----------------------------------------------------------------------

    @property
    def buffer(self) -> MovementBuffer:
        """The movements decided last, with their times; what is past of them is flown (6.2)."""
        buffer, clock = self._plan.buffer, self._known.clock
        return buffer.shift(clock.to_stated) if clock.shifted else buffer

    @property
    def holds_until_s(self) -> float:
        """Until when the plan may be flown without a new decision; -inf before the first one."""
        return self._known.clock.to_stated(self._plan.holds_until_s)

    def escape_ends_s(self, time_s: float) -> float | None:
        """Return when the escape held at a time has been flown.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        float or None
            As `Plan.escape_ends_s`, on the same clock.
        """
        ends_s = self._plan.escape_ends_s(self._known.clock.own(time_s))
        return None if ends_s is None else self._known.clock.to_stated(ends_s)

    def movement_at(self, time_s: float) -> Movement | None:
        """Return what to fly at a time, of the plan decided last.

        Where one movement ends, the next is flown.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        Movement or None
            None before the first decision, at times before the last one, and past the plan's end,
            where `due` has long asked for the next one.
        """
        return self._plan.movement_at(self._known.clock.own(time_s))

    def state_at(self, time_s: float) -> State | None:
        """Return where the plan has the vehicle at a time.

        Flown from the state that was decided for: a set-point, not an estimate of the own state.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        State or None
            World frame; None when `movement_at` is.
        """
        state = self._plan.state_at(self._known.clock.own(time_s))
        return replace(state, time_s=time_s) if state and self._known.clock.shifted else state

    def reference_at(self, time_s: float) -> Reference | None:
        """Return what the plan asks of the vehicle at a time.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        Reference or None
            Where to be, how fast, and how that changes, world frame; None when `movement_at` is.
        """
        return self._plan.reference_at(self._known.clock.own(time_s))

    # --- what is known now ----------------------------------------------------------------

    def situation(self, now_s: float) -> tuple[Situation, float]:
        """Return all that is known at a moment.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Returns
        -------
        tuple of Situation and float
            What is known, world frame, and the age of the oldest scan used in seconds (NaN without
            any).

        Raises
        ------
        ClearwayError
            If no own state estimate has come yet, and for what is no time.
        """
        situation, scan_age = self._situation(self._known.catch_up(now_s))
        if self._known.clock.shifted:
            told = self._known.clock.to_stated
            situation = replace(
                situation,
                state=replace(situation.state, time_s=told(situation.state.time_s)),
                intruders=[replace(i, time_s=told(i.time_s)) for i in situation.intruders],
            )
        return situation, scan_age

    @property
    def _escapes_on(self) -> bool:
        """Whether the escape has been flown twice in a row: once is but a step to the side, from
        which the goal may lie open. Before there was a certain one, nothing had been seen yet."""
        mode = self._mode
        return mode is not None and mode.mode is Mode.ESCAPE is mode.before

    def _start(self, now: float) -> State:
        """The own state estimate that a decision is taken for.

        A vehicle with inertia that follows its plan: where the plan has it at the end of the
        movement under way. Else where it is now, as far as is known.
        """
        state, plan = self._known.own_state(now), self._plan.in_force(now)
        if not self._watch.keeps_to(self._plan):
            return state
        planned = plan.state_at(plan.next_s(now))
        if planned is None:
            return state
        return replace(
            planned,
            position_std_m=state.position_std_m,
            attitude_std_rad=state.attitude_std_rad,
        )

    def _situation(self, now: float) -> tuple[Situation, float]:
        state = self._start(now)
        if self._known.route_planner is not None:
            return self._known.with_detections(state, now)
        last = self._plan.decision
        afar = None if last is None else last.long_range
        self.progress = out_of_dead_end(
            self._known,
            state,
            now,
            self._detour,
            escaped=self._escapes_on and self._plan.had_certain,
            gives_way=afar is not None and afar.gives_way,
        )
        return self._known.with_detections(state, now)


def _height_or_none(name: str, height_m: float) -> float:
    """A height of the world, or -inf for none; raises ClearwayError for anything else."""
    if number_problem(name, height_m, -math.inf):
        raise ClearwayError(
            f"{name}: must be a number up to {LARGEST:g}, or -inf for none, got {height_m}"
        )
    return float(height_m)
