"""Live use: readings come in as they come, decisions are asked for when due.

`AvoidanceSystem` is the one object here that changes: it keeps the latest reading of every sensor,
what is remembered of earlier ones, the mission's progress and the commitment to a side. Data that
cannot be used are counted by reason in `counts`, never silently lost.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance import Decision, decide
from clearway.decision import Basis, Commitment, Side
from clearway.detour import known_way
from clearway.errors import ClearwayError
from clearway.explain import explanation
from clearway.frames import FloatArray, world_from_body, wrap_angle
from clearway.hazards import PointHazards, no_points
from clearway.intruders import Intruder, Ownship, Report, TrackerSettings, Tracks, track_reports
from clearway.mission import Detour, Mission, Mode, Progress, advanced, detoured, stuck
from clearway.movement_buffer import MovementBuffer
from clearway.movers import Following, MoverSettings, follow, forget_movers, unreported
from clearway.obstacle_map import ObstacleMap
from clearway.obstacles import Obstacle
from clearway.planner import Planner
from clearway.sensors import (
    AnySensor,
    Court,
    Detection,
    Ground,
    Lidar,
    LidarSensor,
    PointMemory,
    Scan,
    heard,
    range_sensors,
    remembered_after,
    unseen,
)
from clearway.sensors.detection import Rule
from clearway.situation import Situation, grid_frame
from clearway.state import State

Reading = State | Scan | Intruder

MEMORY_REACH = 1.5
"""How far away returns are remembered, in ranges of the grid."""
MEMORY_VOXEL = 0.2
"""Voxels in which returns are merged, as a share of the safety margin."""


@dataclass(frozen=True, slots=True)
class DataLimits:
    """How old data may be, and how long things are kept."""

    state_s: float = 1.5
    """Own state; an older one is used, counted, and widens the margin."""
    scan_s: float = 3.0
    """Scans; without a fresh one the sensor's columns count as unseen."""
    intruder_s: float = 10.0
    """Intruder reports."""
    history_s: float = 10.0
    """Own states kept, to place late scans."""
    memory_s: float = 120.0
    """Points remembered after they were last seen."""
    patience_turns: float = 1.5
    """Full circles' worth of time without progress before a detour."""


@dataclass(frozen=True, eq=False)
class FlightDecision:
    """A decision with the mission's mode and an explanation in words."""

    time_s: float
    mode: Mode
    goal: int
    """Index of the goal flown to."""
    decision: Decision
    explanation: str
    scan_age_s: float
    """Age of the oldest scan used; NaN without any."""
    counts: dict[str, int]
    """Data left out since the last decision, by reason."""

    @property
    def state(self) -> State:
        """Own state that was decided for."""
        return self.decision.state

    @property
    def movements(self) -> tuple[str, ...]:
        """The movement buffer to execute."""
        return self.decision.movements


class AvoidanceSystem:
    """Feed it with `update`, ask it with `due` and `decide`; call `warm_up` before take-off.

    detection_rule: how hits become P_OD. ground_m: height of the world below which returns come
    from the ground and are no obstacles; whoever sets it keeps the aircraft above by other means.
    tracker: reports of intruders are made into tracks first; None believes each as it comes, save
    own, repeated, late and stale ones.
    address: the own transponder's, by which the tracker knows own echoes; by place where empty.
    follow_movers: what moves and is seen by LiDAR alone counts as intruders too.
    lidars: LiDARs, and whatever else is a `sensors.RangeSensor`; with several of them, those that
    the others contradict are no longer believed (see `sensors.trust`).
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
        self.progress = Progress()
        self.counts: Counter[str] = Counter()
        self._sensors = range_sensors(lidars)
        self._detour = detour
        self._detection_rule = detection_rule
        self._ground_m = ground_m
        self._states: deque[State] = deque()
        self._scans: dict[str, Scan] = {}
        self._intruders: dict[str, Intruder] = {}
        self._anonymous = 0
        self._tracks = None if tracker is None else Tracks(settings=tracker)
        self._heard: list[Report] = []
        self._address = address
        settings = MoverSettings.of(planner.settings.safety_margin_m, planner.speed_mps)
        self._following = Following(settings) if follow_movers else None
        empty = PointMemory.empty(
            MEMORY_VOXEL * planner.settings.safety_margin_m,
            self.limits.memory_s,
            reach_m=MEMORY_REACH * planner.grid.range_m,
        )
        # One each: no sensor wipes out what another has seen.
        self._memories = dict.fromkeys(self._sensors, empty)
        # Alone, a sensor has nobody to contradict it.
        margin = planner.settings.safety_margin_m
        court = Court.of(self._sensors, margin, planner.grid.range_m, planner.speed_mps)
        self._court = court if len(self._sensors) > 1 else None
        self._buffer = MovementBuffer()
        self._side = Side.STRAIGHT
        self._decide_by_s = -np.inf
        self._news = ""
        self._goal = -1
        self._reported: Counter[str] = Counter()

    # --- readings -------------------------------------------------------------------------

    def update(self, reading: Reading) -> None:
        """Take one reading; what cannot be used is counted by reason."""
        if isinstance(reading, State):
            self._take_state(reading)
        elif isinstance(reading, Scan):
            self._take_scan(reading)
        else:
            self._take_intruder(reading)

    def _take_state(self, state: State) -> None:
        if not np.all(np.isfinite(state.vector)) or not np.isfinite(state.time_s):
            self.counts["state: not finite"] += 1
            return
        if self._states and state.time_s <= self._states[-1].time_s:
            self.counts["state: late or repeated"] += 1
            return
        self._states.append(state)
        while self._states[0].time_s < state.time_s - self.limits.history_s:
            self._states.popleft()
        self.progress = advanced(self.mission, self.progress, state.position_m, state.time_s)

    def _take_scan(self, scan: Scan) -> None:
        if scan.sensor not in self._sensors:
            self.counts["scan: unknown sensor"] += 1
        elif scan.sensor in self._scans and scan.time_s <= self._scans[scan.sensor].time_s:
            self.counts["scan: late or repeated"] += 1
        elif not self._states or scan.time_s < self._states[0].time_s - 1e-6:
            self.counts["scan: no own state of its time"] += 1
        else:
            self._scans[scan.sensor] = scan
            state = self._state_at(scan.time_s)
            sensor, sigmas = self._sensors[scan.sensor], self.planner.settings.sigmas
            self._memories[scan.sensor] = remembered_after(
                self._memories[scan.sensor],
                sensor,
                scan,
                state,
                tolerance_m=sigmas * state.position_std_m,
                ground_m=self._ground_m,
            )
            if self._court is not None:
                self._court = heard(
                    self._court,
                    self._sensors,
                    scan,
                    state,
                    sigmas=sigmas,
                    ground_m=self._ground_m,
                )
            if len(scan.points_m):
                self._news = "new returns"
            if not self._believes(scan.sensor):
                self.counts[f"scan: {scan.sensor} is contradicted by others"] += 1
            elif isinstance(sensor, LidarSensor):
                self._follow(sensor.lidar, scan, state)

    def _believes(self, name: str) -> bool:
        return self._court is None or self._court.believes(name)

    @property
    def trust(self) -> dict[str, float]:
        """Present trust by sensor; what is not believed at all is at 0."""
        if self._court is None:
            return {name: sensor.standing.trust for name, sensor in self._sensors.items()}
        return {
            name: record.trust if record.believed else 0.0
            for name, record in self._court.records.items()
        }

    def _follow(self, lidar: Lidar, scan: Scan, state: State) -> None:
        """Find what moves, and leave no ghost of it behind."""
        if self._following is not None:
            following = follow(
                self._following,
                lidar,
                scan,
                state,
                sigmas=self.planner.settings.sigmas,
                ground_m=self._ground_m,
            )
            self._following = following
            self._memories = {
                name: forget_movers(memory, following) for name, memory in self._memories.items()
            }

    def _take_intruder(self, intruder: Intruder) -> None:
        if self._tracks is not None:
            self._heard.append(Report.of(intruder))
            self._news = self._news or "new reports of traffic"
            return
        if self._address and self._address in (intruder.address, intruder.name):
            self.counts["intruder: ownship"] += 1
            return
        # Reports of nobody in particular cannot replace each other: each counts until it is stale.
        self._anonymous += 1
        name = intruder.address or intruder.name or f"anonymous {self._anonymous}"
        known = self._intruders.get(name)
        if known is not None and intruder.time_s < known.time_s:
            self.counts["intruder: late report"] += 1
        elif known is not None and _same_report(intruder, known):
            self.counts["intruder: duplicate"] += 1
        else:
            self._intruders[name] = intruder if intruder.name else replace(intruder, name=name)
            self._news = self._news or "new reports of traffic"

    # --- decisions ------------------------------------------------------------------------

    def due(self, now_s: float) -> str | None:
        """Why a decision is due now, or None while the plan may be flown on."""
        if not self._buffer.entries or now_s >= self._buffer.end_s - 1e-9:
            return "the buffer is empty"
        if self.progress.goal != self._goal:
            return "a new goal"
        if now_s >= self._decide_by_s - 1e-9:
            return "the plan has to be renewed while the vehicle can still turn away"
        return self._news or None

    def warm_up(self) -> None:
        """Compile and load all that a decision runs, on made-up data; nothing is kept of it."""
        trial = AvoidanceSystem(
            self.planner,
            self.mission,
            tuple(self._sensors.values()),
            self._map_with_something_near(),
            self.limits,
            follow_movers=self._following is not None,
            tracker=None if self._tracks is None else self._tracks.settings,
            address=self._address,
        )
        start = self.mission.start
        # Nothing about; an intruder ahead; one so near that only the emergency rule is left.
        for step, ahead in enumerate((None, 0.5, 0.0)):
            time_s = start.time_s + step
            trial.update(replace(start, time_s=time_s))
            for name in self._sensors:
                trial.update(Scan(0.4 * self.planner.grid.range_m * _fan(), time_s, name))
            if ahead is not None:
                passing = Intruder(
                    start.position_m + ahead * self.planner.grid.range_m,
                    np.array([0.0, -self.planner.speed_mps, 0.0]),
                    np.array([0.1, 0.1]),
                    self.planner.settings.safety_margin_m,
                    "passing",
                    time_s,
                )
                trial.update(passing)
            trial.decide(time_s)
        trial._known_way(start.position_m, self.mission.goals_m[0])

    def _map_with_something_near(self) -> ObstacleMap | None:
        """The map, if there is one, with a ball where the first decision has to look at it."""
        if not self.obstacle_map:
            return None
        start = self.mission.start
        ahead = np.array([0.5 * self.planner.grid.range_m, 0.0, 0.0])
        place = start.position_m + world_from_body(start.attitude_rad) @ ahead
        ball = Obstacle.ball(place, self.planner.settings.safety_margin_m)
        return ObstacleMap([*self.obstacle_map.obstacles, ball])

    def decide(self, now_s: float) -> FlightDecision:
        """Decide for the present moment; the buffer returned is to be flown from `now_s` on.

        Raises ClearwayError if no own state has come yet.
        """
        situation, scan_age = self.situation(now_s)
        held = self._buffer.at(now_s + 1e-6)
        commitment = Commitment(self._side, held.name if held else "")
        decision = decide(self.planner, situation, commitment)
        return self._adopt(decision, now_s, scan_age)

    def situation(self, now_s: float) -> tuple[Situation, float]:
        """All that is known at a moment, and the age of the oldest scan used (NaN without any).

        Raises ClearwayError if no own state has come yet.
        """
        state = self._expected_state(now_s)
        self._leave_dead_end(state, now_s)
        detections, scan_age = self._detections(state, now_s)
        sigma = min((sensor.sigma_m for sensor in self._sensors.values()), default=0.0)
        situation = Situation(
            state=state,
            target_m=self.progress.target(self.mission),
            next_m=self.progress.following(self.mission),
            from_m=self.progress.left(self.mission),
            reach_radius_m=self.mission.reach_radius_m,
            detections=detections,
            remembered=self._remembered_near(state),
            obstacle_map=self.obstacle_map,
            intruders=self._traffic(state, now_s),
            state_age_s=now_s - self._states[-1].time_s,
            range_sigma_m=sigma,
        )
        return situation, scan_age

    def _adopt(self, decision: Decision, now_s: float, scan_age: float) -> FlightDecision:
        automaton = self.planner.automaton
        self._buffer = MovementBuffer.of(automaton.chain(decision.movements), now_s)
        self._decide_by_s = now_s + decision.decide_within_s
        self._news = ""
        self._goal = self.progress.goal
        choice = decision.choice
        if choice.forced:
            self._side = choice.side
        elif choice.side is not self._side and not choice.ruled_out:
            self._side = Side.STRAIGHT
        mode = self._mode(decision)
        fresh = self.counts - self._reported
        self._reported = Counter(self.counts)
        return FlightDecision(
            now_s,
            mode,
            self.progress.goal,
            decision,
            explanation(decision, mode, self.obstacle_map),
            scan_age,
            dict(fresh),
        )

    def _mode(self, decision: Decision) -> Mode:
        if decision.choice.basis is Basis.EMERGENCY:
            return Mode.EMERGENCY
        if self.progress.landing(self.mission):
            return Mode.LANDING
        if decision.choice.ruled_out or decision.choice.below_threshold:
            return Mode.AVOIDANCE
        return Mode.NAVIGATION

    @property
    def buffer(self) -> MovementBuffer:
        """The movements decided last, with their times; what is past of them is flown (6.2)."""
        return self._buffer

    # --- what is known now ----------------------------------------------------------------

    def _expected_state(self, now_s: float) -> State:
        """Latest own state, carried to the decision time along the buffer being flown (4.16)."""
        if not self._states:
            raise ClearwayError("no own state yet: update the system with one before deciding")
        latest = self._states[-1]
        age = now_s - latest.time_s
        if age > self.limits.state_s:
            self.counts["state: stale"] += 1
        if age <= 1e-9:
            return latest
        _, ahead = self._buffer.split(latest.time_s)
        flown, _ = ahead.split(now_s)
        vector = flown.rollout(self.planner.automaton, latest.vector, np.inf).states[-1]
        return replace(latest, position_m=vector[:3], attitude_rad=vector[3:], time_s=now_s)

    def _state_at(self, time_s: float) -> State:
        """Own state at a past time, interpolated between the kept ones."""
        later = next((s for s in self._states if s.time_s >= time_s), self._states[-1])
        earlier = next((s for s in reversed(self._states) if s.time_s <= time_s), later)
        span = later.time_s - earlier.time_s
        if span <= 0.0:
            return earlier
        share = (time_s - earlier.time_s) / span
        turned = wrap_angle(later.attitude_rad - earlier.attitude_rad)
        return replace(
            earlier,
            position_m=earlier.position_m + share * (later.position_m - earlier.position_m),
            attitude_rad=earlier.attitude_rad + share * turned,
            time_s=time_s,
        )

    def _detections(self, state: State, now_s: float) -> tuple[list[Detection], float]:
        """Latest scan of every sensor in the grid frame of the decision, and the greatest age."""
        position, world_from_grid = grid_frame(state)
        detections, ages = [], []
        for name, sensor in self._sensors.items():
            scan = self._scans.get(name)
            fresh = scan is not None and now_s - scan.time_s <= self.limits.scan_s
            if not fresh:
                self.counts[f"scan: none fresh of {name}"] += 1
            if scan is None or not fresh or not self._believes(name):
                detections.append(unseen(self.planner.grid, sensor))
                continue
            ages.append(now_s - scan.time_s)
            pose = self._state_at(scan.time_s)
            rotation = world_from_grid.T @ pose.world_from_body
            offset = world_from_grid.T @ (pose.position_m - position)
            still = pose.time_s == state.time_s and pose.attitude_rad[0] == 0.0
            detection = sensor.detect(
                self.planner.grid,
                scan,
                grid_from_body=None if still else (rotation, offset),
                rule=self._detection_rule,
                ground=self._ground(state),
            )
            if self._court is not None:
                detection = replace(detection, weight=self._court.records[name].weight)
            detections.append(detection)
        return detections, max(ages, default=float("nan"))

    def _remembered_near(self, state: State) -> PointHazards:
        """Points of this and earlier scans that a trajectory could come near to.

        Those of sensors that measure worse than the best are grown by the difference here, since a
        decision grows all alike.
        """
        settings = self.planner.settings
        reach = self.planner.grid.range_m + 2.0 * settings.safety_margin_m
        best = min((sensor.sigma_m for sensor in self._sensors.values()), default=0.0)
        near = []
        for name, memory in self._memories.items():
            if self._believes(name):
                place, radius = memory.near(state.position_m, reach)
                worse = self._sensors[name].sigma_m - best
                near.append((place, radius + settings.point_sigmas * worse if worse else radius))
        return _together(near)

    def _ground(self, state: State) -> Ground | None:
        """Ground that is no obstacle, as the grid of a decision sees it."""
        if self._ground_m == -np.inf:
            return None
        level = replace(state, attitude_rad=state.attitude_rad * np.array([0.0, 1.0, 1.0]))
        return Ground.at_height(level, self._ground_m, 0.0)

    def _traffic(self, state: State, now_s: float) -> list[Intruder]:
        """Reported intruders, and those that LiDAR alone sees."""
        reported = self._present_intruders(state, now_s)
        if self._following is None:
            return reported
        return reported + unreported(self._following.intruders(), reported)

    def _present_intruders(self, state: State, now_s: float) -> list[Intruder]:
        if self._tracks is not None:
            self._tracks = self._tracked(self._tracks, state, now_s)
            return self._tracks.intruders()
        present = {}
        for name, intruder in self._intruders.items():
            if now_s - intruder.time_s > self.limits.intruder_s:
                self.counts["intruder: stale"] += 1
            else:
                present[name] = intruder
        self._intruders = present
        return list(present.values())

    def _tracked(self, tracks: Tracks, state: State, now_s: float) -> Tracks:
        """The tracks after what was heard since the last decision; what is left out is counted."""
        velocity = self.planner.speed_mps * state.world_from_body[:, 0]
        own = Ownship(state.position_m, velocity, self._address)
        fresh = track_reports(tracks, self._heard, now_s, own)
        self._heard.clear()
        for reason, count in fresh.left_out.items():
            self.counts[f"report: {reason}"] += count - tracks.left_out[reason]
        self.counts = +self.counts
        return fresh

    def _leave_dead_end(self, state: State, now_s: float) -> None:
        """The no-progress rule: fly a detour when the goal has not come nearer for long."""
        automaton = self.planner.automaton
        radius = automaton.turning_radius_m
        if not np.isfinite(radius) or self.progress.done(self.mission):
            return
        speed = max(movement.speed_mps for movement in automaton.movements)
        patience = self.limits.patience_turns * 2.0 * np.pi * radius / speed
        if stuck(self.progress, now_s, patience):
            self.progress = detoured(
                self.mission, self.progress, state, now_s, radius, self._detour or self._known_way
            )

    def _known_way(self, position_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
        """Round what the map and the memory show, with room to turn if there is any."""
        margin = self.planner.settings.safety_margin_m
        wide = margin + 0.5 * self.planner.automaton.turning_radius_m
        remembered = _together(
            [
                (memory.position_m, memory.radius_m)
                for name, memory in self._memories.items()
                if self._believes(name)
            ]
        )
        return known_way(self.obstacle_map, remembered, position_m, target_m, (wide, margin))


def _same_report(one: Intruder, other: Intruder) -> bool:
    """Whether two reports of one intruder say the same of the same moment."""
    return one.time_s == other.time_s and bool(
        np.array_equal(one.position_m, other.position_m)
        and np.array_equal(one.velocity_mps, other.velocity_mps)
    )


def _together(balls: Sequence[tuple[FloatArray, FloatArray]]) -> PointHazards:
    """Balls of several sensors as one."""
    if len(balls) == 1:
        return PointHazards(*balls[0])
    if not balls:
        return no_points()
    return PointHazards(
        np.concatenate([place for place, _ in balls]),
        np.concatenate([radius for _, radius in balls]),
    )


def _fan() -> FloatArray:
    """[49, 3] directions ahead."""
    steps = np.linspace(-0.5, 0.5, 7)
    y, z = np.meshgrid(steps, steps, indexing="ij")
    ahead = np.stack([np.ones(49), y.ravel(), z.ravel()], axis=1)
    return np.asarray(ahead / np.linalg.norm(ahead, axis=1)[:, None])
