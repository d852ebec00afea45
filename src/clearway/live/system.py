"""The system that a vehicle runs: takes readings, and decides when asked.

`AvoidanceSystem` is the one object that changes, with what it is made of. Data that cannot be used
are counted by reason in `counts`, never silently lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy.typing as npt

from clearway.avoidance.choose.candidates import STANDING_IS_WANTED
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import BY_SIGHT, Escape
from clearway.avoidance.plan.planner import Planner, prepare_next
from clearway.avoidance.plan.situation import Situation
from clearway.base.brief import in_brief, one_line
from clearway.base.checks import check_points, kind_of
from clearway.live.inputs.readings import TIME_TOLERANCE_S
from clearway.live.knowledge import Knowledge
from clearway.live.mission import Detour, Mission
from clearway.live.outputs.alarms import AlarmFacts, AlarmWatch
from clearway.live.outputs.alerting import TrafficPicture, coverings_after, traffic_picture
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.live.outputs.kept_clearance import KeptClearance, bound_clearance, view_of
from clearway.live.outputs.modes import ModeFacts, mode_after
from clearway.live.plan import Plan
from clearway.live.preflight.escape_plan import escape_plan
from clearway.live.questions import Questions
from clearway.live.recovery.dead_end import keep_up
from clearway.live.recovery.risk_level import Insistence
from clearway.live.watch import PlanWatch
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import AnySensor
from clearway.sensors.range_sensor import range_sensors
from clearway.traffic.covering import Covering
from clearway.traffic.volumes import Alerts


class AvoidanceSystem(Questions):
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
        known = Knowledge(planner, mission, lidars, obstacle_map)
        super().__init__(known, Plan(planner.automaton), PlanWatch(planner, known), detour)
        self._insistence = Insistence(planner) if self.escape.insists else None
        self._alerts = Alerts()
        self._coverings: dict[str, Covering] = {}
        promised = self.escape.within if self.escape.flown in BY_SIGHT else None
        self._alarm_watch = AlarmWatch(planner, tuple(lidars), promised)
        self._view = view_of(self._known.sensing.sensors.values())
        self._kept: KeptClearance | None = None

    def __repr__(self) -> str:
        sensors = ", ".join(self._known.sensing.sensors) or "no sensor"
        left_out = f"{self.counts.total()} data left out"
        return one_line(
            "AvoidanceSystem",
            (in_brief(self.mission.name), f"goal {self.progress.goal}", sensors, left_out),
        )

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
        fresh = self._count_fresh()
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
