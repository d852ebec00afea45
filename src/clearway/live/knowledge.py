"""What readings have told up to now: the own position, what sensors saw, who reported, how far we
are.

Times here are the system's own; `live.inputs.clock` makes them of what the caller tells.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from clearway.avoidance.escape.terms import limit_carried_m
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Here, Situation, widest_margin_m
from clearway.avoidance.rate.route_field import RouteField
from clearway.base.checks import time_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, measure_length
from clearway.base.grid_frame import GridFrame
from clearway.base.state import State
from clearway.live.dynamic_objects import find_unreported
from clearway.live.inputs.clock import Clock
from clearway.live.inputs.own_scatter import OwnScatter
from clearway.live.inputs.own_states import Flown, OwnStates, carry_state_on, split_velocity
from clearway.live.inputs.range_sensing import RangeSensing
from clearway.live.inputs.readings import Reading, reading_of
from clearway.live.inputs.reports import reports_for
from clearway.live.inputs.tracking import Tracking
from clearway.live.inputs.waiting import Waiting
from clearway.live.inputs.wind import WindEstimate
from clearway.live.mission import Mission, Progress, advance_progress
from clearway.live.routing.no_way import note_whether_closed
from clearway.live.routing.route_planner import RoutePlanner
from clearway.live.routing.seen_planner import SeenPlanner
from clearway.live.routing.timed_route import (
    find_known_clearance,
    make_seen_planner,
    route_planner_for,
    suits,
)
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import AnySensor, Detection, Scan, range_sensors
from clearway.traffic import Intruder

JUMPS = 4.0
"""Margins by which an own position lies off what was flown, from which on it has jumped for
once."""
HARDEST_MPS2 = 10.0
"""At which a vehicle with inertia may change its velocity while nobody knows what it flies."""


class Knowledge:
    """Takes readings, and tells what is known at a moment; arguments as of `AvoidanceSystem`.

    What cannot be used is counted by reason in `counts`.
    """

    def __init__(
        self,
        planner: Planner,
        mission: Mission,
        lidars: Sequence[AnySensor],
        obstacle_map: ObstacleMap | None,
    ) -> None:
        settings = planner.settings
        self.planner, self.mission, self.obstacle_map = planner, mission, obstacle_map
        self.progress = Progress()
        self.followed = True
        """Whether the vehicle flies what is decided."""
        self.floor_m = -np.inf
        """Height of the world that no decision leads below."""
        self.counts: Counter[str] = Counter()
        self.news = ""
        """What has come since a plan last took account of all."""
        self.unchecked = False
        """Whether a plan has not been checked against the news."""
        self.clock = Clock(settings.state_s)
        self.waiting = Waiting(settings.ahead_s)
        self.flown = Flown(planner.automaton, settings.history_s)
        told_mps = (0.0, 0.0, 0.0) if planner.automaton.has_inertia else settings.wind_mps
        self.wind = WindEstimate(planner.speed_mps, told_mps)
        self.flown.wind_mps = self.wind.wind_mps
        self.scatter = OwnScatter(JUMPS * settings.safety_margin_m)
        self.own_states = OwnStates(settings.history_s, self.flown)
        self.tracking = Tracking()
        self.sensing = RangeSensing(
            planner,
            range_sensors(lidars),
            start_m=mission.start.position_m,
            complete_m=None if obstacle_map is None else obstacle_map.complete_m,
        )
        self.route_planner: RoutePlanner | None = None
        """The time to go round what is known, for a vehicle with inertia."""
        self.seen_routes: SeenPlanner | None = None
        """Ways through seen space, for others that keep it."""
        if planner.automaton.has_inertia:
            self.route_planner = route_planner_for(planner, mission, obstacle_map)
        elif self.sensing.free_space is not None:
            self.seen_routes = make_seen_planner(planner, mission, obstacle_map)
        self._asked_first_s: float | None = None
        self._reports = reports_for(settings, planner.speed_mps)

    @cached_property
    def known_routes(self) -> RoutePlanner:
        """Ways round what the map and the memory show."""
        if self.route_planner is not None:
            return self.route_planner
        return route_planner_for(self.planner, self.mission, self.obstacle_map)

    def fly(self, mission: Mission, now_s: float) -> None:
        """Take another mission, begun now by the own clock."""
        self.mission, self.progress = mission, Progress(nearest_s=now_s)
        if self.route_planner is not None or "known_routes" in self.__dict__:
            besides = find_known_clearance(self.planner, mission, self.obstacle_map)
            self.known_routes.begin_anew(besides)
        if self.seen_routes is not None:
            if suits(self.seen_routes, self.planner, mission):
                besides = find_known_clearance(self.planner, mission, self.obstacle_map)
                self.seen_routes.begin_anew(besides)
            else:
                self.seen_routes = make_seen_planner(self.planner, mission, self.obstacle_map)

    # --- readings -------------------------------------------------------------------------

    def put(self, reading: Reading) -> None:
        """Keep a reading for the next question; what no time makes right is counted at once.

        Raises ClearwayError for what is no reading at all.
        """
        if not isinstance(reading, State | Scan | Intruder):
            raise ClearwayError(
                f"update: takes a State, a Scan or an Intruder, got {type(reading).__name__}"
            )
        if isinstance(reading, Scan) and reading.sensor not in self.sensing.sensors:
            self.counts["scan: unknown sensor"] += 1
            return
        self.waiting.put(reading)
        overdue = self.waiting.overdue_s
        if overdue is not None:
            self._take(self.clock.own(overdue), asked=False)

    def receive(self, kind: type[Reading], *values: Any, **named: Any) -> bool:
        """Make a reading of raw values and keep it; what cannot be made is counted by reason."""
        reading = reading_of(kind, *values, **named)
        if isinstance(reading, str):
            self.counts[reading] += 1
            return False
        self.put(reading)
        return True

    def catch_up(self, told_s: float) -> float:
        """Own time of a question, with all taken in that has come; ClearwayError for no time."""
        problem = time_problem("time", told_s)
        if problem:
            raise ClearwayError(f"question: {problem}")
        now, jumped = self.clock.ask(told_s)
        if jumped:
            self.counts[jumped] += 1
        if self._asked_first_s is None:
            self._asked_first_s = now
        self._take(now, asked=True)
        return now

    def _take(self, now: float, *, asked: bool) -> None:
        unsure_mps = self.planner.speed_mps / max(self.planner.settings.sigmas, 1.0)
        ready = self.waiting.ready(now, self.clock.own, unsure_mps, asked=asked)
        if ready.flaws:
            self.counts.update(ready.flaws)
        for reading in ready.readings:
            if isinstance(reading, State):
                self._take_state(reading)
            elif isinstance(reading, Scan):
                self._take_scan(reading)
            else:
                self._take_report(reading)

    def _take_state(self, state: State) -> None:
        before = self.own_states.latest if self.own_states.reach_back_to(state.time_s) else None
        flown_m = None
        if before is not None and self.followed:  # Else nothing is held against it.
            flown_m = self.flown.place_in_calm_m(before, state.time_s)
        jumped = self._has_jumped(before, state, flown_m)
        flaw = self.own_states.take(state)
        if flaw:
            self.counts[flaw] += 1
            return
        if before is not None and self.flown.unknown_s(before.time_s, state.time_s) > 0.0:
            flown_m = None
        self.scatter.take(None if flown_m is None else state.position_m - flown_m)
        self._tell_wind(before, state, flown_m, jumped=jumped)
        if jumped and self.sensing.free_space is not None:
            self.sensing.free_space.forget()
            self.counts["state: the own position jumped; observed free space is forgotten"] += 1
        self.clock.settle(state.time_s)
        self.progress = advance_progress(
            self.mission,
            self.progress,
            state.position_m,
            state.time_s,
            stays_level=self.planner.automaton.stays_level,
        )

    def _tell_wind(
        self, before: State | None, state: State, flown_m: FloatArray | None, *, jumped: bool
    ) -> None:
        """Compare an own state estimate with where what was flown since the one before would have
        led."""
        if self.planner.automaton.has_inertia:
            return  # It holds its way over the ground: what is left over is `tracking`.
        if before is None or flown_m is None:
            self.wind.forget()
            return
        self.wind.take(before, state, flown_m, jumped=jumped)
        self.flown.wind_mps = self.wind.wind_mps

    def _has_jumped(self, latest: State | None, state: State, flown_m: FloatArray | None) -> bool:
        """Whether an own state estimate lies farther off what was flown, which leads to `flown_m`,
        than margin and deviations cover; where others fly, than the vehicle gets in that time."""
        if latest is None:
            return False
        settings = self.planner.settings
        if flown_m is not None:
            off_m = self.wind.measure_unexplained_m(latest, state, flown_m)
        else:
            moved_m = measure_length(state.position_m - latest.position_m)
            off_m = moved_m - self.planner.speed_mps * (state.time_s - latest.time_s)
        unknown_s = self.flown.unknown_s(latest.time_s, max(state.time_s, latest.time_s))
        unsure_m = settings.sigmas * (state.position_std_m + latest.position_std_m)
        return off_m > settings.safety_margin_m + unsure_m + self.planner.speed_mps * unknown_s

    def _take_scan(self, scan: Scan) -> None:
        flaw = self.sensing.flaw_of(scan)
        if flaw:
            self.counts[flaw] += 1
        elif not self.own_states.reach_back_to(scan.time_s):
            self.counts["scan: no state estimate of its time"] += 1
        else:
            left_out = self.sensing.take(scan, self.own_states.at(scan.time_s))
            if left_out:
                self.counts.update(left_out)
            if len(scan.points_m):
                self.news, self.unchecked = "new returns", True
            if not self.sensing.believes(scan.sensor):
                self.counts[f"scan: {scan.sensor} is contradicted by others"] += 1

    def _take_report(self, report: Intruder) -> None:
        flaw = self._reports.take(report)
        if flaw:
            self.counts[flaw] += 1
        else:
            self.news, self.unchecked = self.news or "new reports of traffic", True

    # --- what is known at a moment --------------------------------------------------------

    def own_state(self, now: float) -> State:
        """The latest own state estimate carried to a moment; ClearwayError if none has come yet."""
        latest = self.own_states.latest
        if now - latest.time_s > self.planner.settings.state_s or self.clock.in_doubt:
            self.counts["state: stale"] += 1
        automaton, classes = self.planner.automaton, self.planner.automaton.classes
        if classes is None or not classes.has_speeds:
            carried = self.flown.carry(latest, now)
            return automaton.in_class(carried, self.flown.class_at(now))
        velocity = latest.velocity_mps
        if velocity is None:
            carried, motion = self.flown.carry(latest, now), self.flown.motion_at(now)
        else:
            carried, motion = carry_state_on(latest, velocity, now), split_velocity(velocity)
        return automaton.in_class(carried, None if motion is None else classes.class_near(*motion))

    def blind_s(self, now: float) -> float | None:
        """For how long no range sensor has told anything, since the first question where none ever
        did; None while one does, and where there is none."""
        since_s = self.sensing.last_scan_s
        if since_s is None:
            since_s = self._asked_first_s
        fresh_s = self.planner.settings.scan_s
        if not self.sensing.sensors or since_s is None or now - since_s <= fresh_s:
            return None
        return now - since_s

    def with_detections(self, state: State, now: float) -> tuple[Situation, float]:
        """All that is known from an own state estimate, and the age of the oldest scan used, or
        NaN."""
        for name in self.sensing.silent(now):
            self.counts[f"scan: none fresh of {name}"] += 1
        scans = self.sensing.usable_scans(now)
        frame = GridFrame.of(state)
        detections = self.sensing.detections(scans, frame, self.own_states.at)
        situation = self.around(state, now, detections, frame, self._route_from(state))
        return situation, max((now - scan.time_s for scan in scans.values()), default=np.nan)

    def around(
        self,
        state: State,
        now: float,
        detections: Sequence[Detection] = (),
        frame: GridFrame | None = None,
        route: RouteField | None = None,
    ) -> Situation:
        """All that is known; of the cells that sensors see, what `detections` say.

        frame: of the grid at the state, where it is at hand. route: for decisions alone.
        """
        here = self.here(state, now)
        known = here._asdict() | {
            "detections": detections,
            "remembered": self.sensing.list_remembered_near(
                state.position_m,
                widest_margin_m(self.planner, here) + limit_carried_m(self.planner, here),
            ),
            "obstacle_map": self.obstacle_map,
            "intruders": self._traffic(state, now),
            "range_sigma_m": self.sensing.sigma_m,
            "seen": None if self.sensing.free_space is None else self.sensing.free_space.seen,
            "route": route,
        }
        # What came was checked when it came; only sensors of someone else's may tell anything.
        if all(type(each) is Detection for each in detections):
            return Situation.trust(frame=frame or GridFrame.of(state), **known)
        return Situation(**known)

    def _route_from(self, state: State) -> RouteField | None:
        """The time to go to the waypoint; None where no way there is known."""
        routes = self.route_planner
        if routes is None or self.progress.is_done(self.mission):
            return None
        place_m, known = state.position_m, self.sensing.remembered
        routes.take(place_m, known.position_m, self.sensing.memory_reach_m)
        asked_m = float(self.planner.prepare_at(state).away_m.max())
        target_m = self.progress.target(self.mission)
        field, is_known = routes.field(place_m, target_m, asked_m)
        if self.followed:
            progress = note_whether_closed(self.progress, state.time_s, is_known=is_known)
            closes = progress.closed and not self.progress.closed
            if closes and routes.look_closer(place_m, target_m):
                field, is_known = routes.field(place_m, target_m, asked_m)
                progress = note_whether_closed(self.progress, state.time_s, is_known=is_known)
            self.progress = progress
            if is_known:
                routes.in_vain.note(place_m, state.time_s, field)
        return field if is_known else None

    def here(self, state: State, now: float) -> Here:
        """Where we are and want to go, and how sure that is; nothing of what is around."""
        latest_s = self.own_states.latest.time_s
        unknown_s = self.flown.unknown_s(latest_s, now) if now > latest_s else 0.0
        return Here(
            state=state,
            target_m=self.progress.target(self.mission),
            next_m=self.progress.following(self.mission),
            from_m=self.progress.find_left(self.mission),
            reach_radius_m=self.mission.reach_radius_m,
            state_age_s=max(0.0, now - latest_s),
            unsure_m=self.planner.speed_mps * self.clock.doubt_s
            + self._unknown_m(unknown_s)
            + self.tracking.excess_m(now),
            floor_m=self.floor_m,
            wind_mps=self.wind.wind_mps,
            wind_sigma_mps=self.wind.sigma_mps if any(self.wind.wind_mps.tolist()) else 0.0,
        )

    def _unknown_m(self, unknown_s: float) -> float:
        """How far a vehicle may be off of which it is not known for a while what it flew; one with
        inertia goes on nearly as fast as was reported."""
        reported = self.own_states.latest.velocity_mps is not None
        if self.planner.automaton.has_inertia and reported:
            return 0.5 * HARDEST_MPS2 * unknown_s**2
        return self.planner.speed_mps * unknown_s

    def _traffic(self, state: State, now_s: float) -> list[Intruder]:
        """Reported intruders, and those that LiDAR alone sees."""
        reported, left_out = self._reports.intruders(state, now_s)
        if left_out:
            self.counts.update(left_out)
        return reported + find_unreported(self.sensing.dynamic_objects, reported)
