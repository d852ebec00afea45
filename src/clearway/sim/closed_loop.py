"""Truth and a pilot in a loop: what is sensed goes in, what is decided is flown.

The vehicle flies movement by movement, as a movement automaton does: a decision takes effect when
a movement ends.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Generic

import numpy as np

from clearway.avoidance.speed_choice import measure_sight_from
from clearway.base.checks import kind_of
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live import AvoidanceSystem, FlightDecision, Reading
from clearway.live.mission import Progress, advance_progress, news_in_m
from clearway.live.preflight.escape_plan import EscapePlan
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld, World
from clearway.sensors import Lidar, Scan, Scanner, scan_world
from clearway.sim.adversary import Adversary, list_planned_ways
from clearway.sim.faults import NO_FAULTS
from clearway.sim.guide import Guide
from clearway.sim.logbook import Logbook
from clearway.sim.metrics import intruder_distances, measure_flight, straight_distances
from clearway.sim.motion import TrueMotion
from clearway.sim.pilot import CLEARWAY, D, Pilot
from clearway.sim.plants.air import Air
from clearway.sim.plants.kinematic import KinematicPlant
from clearway.sim.plants.plant import Plant, PlantKind
from clearway.sim.run import LoggedDecision, OnDecision, Run
from clearway.sim.scripted import AirTraffic
from clearway.sim.settings import SimulationSettings
from clearway.sim.swept import touches
from clearway.vehicle.automaton import Movement

ROUNDING_M = 1e-4
"""More than rounding adds up to over the steps of a flight."""


def simulate(
    system: Pilot[D],
    world: World,
    *,
    lidars: Sequence[Lidar | Scanner],
    settings: SimulationSettings | None = None,
    on_decision: OnDecision[D] | None = None,
    traffic: AirTraffic | None = None,
    plant: PlantKind | None = None,
) -> Run[D]:
    """Fly the pilot's mission through a true world; the same seed gives the same run.

    Parameters
    ----------
    system
        Who decides: an `AvoidanceSystem`, or another pilot.
    world
        What is truly there, world frame.
    lidars
        What looks at it.
    settings
        What the simulated truth is like; by default without noise and wind.
    on_decision
        Called with every decision and the progress of the mission.
    traffic
        Aircraft, fresh for every flight, since they fly along.
    plant
        What truly moves; None for what does as the automaton predicts.

    Returns
    -------
    Run
        The flight, with its decisions.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> trees = cw.ObstacleMap([cw.Obstacle.ball([6.0, 0.2, 0.0], 1.0)])
    >>> mission = cw.Mission("by", cw.State(np.zeros(3)), waypoints_m=np.array([[12.0, 0.0, 0.0]]))
    >>> system = cw.AvoidanceSystem(cw.Planner.of(library), mission, obstacle_map=trees)
    >>> run = cw.simulate(system, trees, lidars=[])
    >>> run.safe, run.planner
    (True, 'clearway')
    """
    settings = SimulationSettings() if settings is None else settings
    kind_of("simulate: settings", settings, SimulationSettings)
    for name, given, asked in (("system", system, "decide"), ("world", world, "distance_m")):
        if not hasattr(given, asked):
            kind = type(given).__name__
            raise ClearwayError(f"simulate: {name} must have a method {asked}, got {kind}")
    flight = _Flight(system, world, lidars, settings, traffic, plant)
    return flight.run(on_decision)


class _Flight(Generic[D]):
    """One flight under way."""

    def __init__(
        self,
        system: Pilot[D],
        world: World,
        lidars: Sequence[Lidar | Scanner],
        settings: SimulationSettings,
        traffic: AirTraffic | None,
        kind: PlantKind | None,
    ) -> None:
        self.system, self.world, self.lidars, self.settings = system, world, lidars, settings
        self.traffic = traffic
        self.mission = system.mission
        self.automaton = system.planner.automaton
        self.margin_m = system.planner.settings.safety_margin_m
        self.scan_rng, self.state_rng, noise_rng, self.fault_rng = (
            np.random.default_rng([settings.seed, stream]) for stream in range(4)
        )
        start = self.mission.start
        plant: Plant
        if kind is None:
            plant = KinematicPlant(self.automaton, start, settings, noise_rng, self.margin_m)
        else:
            air = Air(settings.wind_mps, settings.gusts_mps, settings.seed)
            plant = kind.make(start.vector, self.automaton.start_mps, air)
        self.motion = TrueMotion(plant, start.time_s, settings.step_s)
        self.guide = Guide(system, plant)
        self.progress = Progress()
        self.crashed = False
        self.adversary: Adversary | None = None
        if settings.adversary_m > 0.0:
            self.adversary = Adversary.of(world, settings, system.planner, system.mission)
            self.lidars = [self.adversary.watch(sensor) for sensor in lidars]
        rate_hz = settings.scan_rate_hz
        self.scan_period_s = None if rate_hz is None else 1.0 / rate_hz
        self.next_scan_s = start.time_s
        self.free_m = 0.0
        """How far it may fly before it can touch anything."""
        self.same_m = 0.0
        """How far it may fly before there can be progress."""

    def run(self, on_decision: OnDecision[D] | None) -> Run[D]:
        limit = self._time_limit()
        self._move_traffic()
        decisions: Logbook[D] = Logbook()
        while not self._over and self.motion.now_s < limit:
            entry = self._decide(self._sense())
            if entry is not None:
                decisions.add(entry)
                if on_decision is not None:
                    on_decision(entry, self.progress)
                self._oppose(entry)
            self._fly_on(self._movement())
        return self._finish(decisions.entries)

    def _oppose(self, entry: LoggedDecision[D]) -> None:
        """Let the adversary put a ball in the way of what was decided."""
        if self.adversary is None:
            return
        ways = list(list_planned_ways(entry.flight, self.motion.state))
        if self.adversary.oppose(ways, np.array(self.motion.states)[:, :3]):
            self.world, self.free_m = self.adversary.world, 0.0

    @property
    def _over(self) -> bool:
        return self.crashed or self.progress.is_done(self.mission)

    def _sense(self) -> list[Reading]:
        """What arrives at this moment: the own state estimate, and scans as old as the latency."""
        now = self.motion.now_s
        settings = self.settings
        sigma = settings.position_sigma_m
        state = self.motion.state
        error = self.state_rng.normal(0.0, 1.0, 3) * sigma
        measured = State(
            state.position_m + error,
            state.attitude_rad,
            time_s=state.time_s,
            position_std_m=sigma,
            velocity_mps=self.motion.velocity_mps if self.automaton.has_inertia else None,
        )
        if settings.attitude_sigma_rad > 0.0:
            turned = self.state_rng.normal(0.0, 1.0, 2) * settings.attitude_sigma_rad
            measured = replace(
                measured,
                attitude_rad=state.attitude_rad + np.concatenate([[0.0], turned]),
                attitude_std_rad=settings.attitude_sigma_rad,
            )
        scans = self._scan(now, state) if self._scan_is_due(now) else []
        reports = self.traffic.reports(now) if self.traffic is not None else []
        if settings.faults == NO_FAULTS:
            return [measured, *scans, *reports]
        measured = settings.faults.own_state(measured, self.fault_rng)
        faulty = [settings.faults.scan(scan, now) for scan in scans]
        heard = [settings.faults.report(report, self.fault_rng) for report in reports]
        return [measured, *(one for one in (*faulty, *heard) if one is not None)]

    def _scan_is_due(self, now: float) -> bool:
        """Whether sensors scan now; if so, the next scan is put off by their period."""
        if self.scan_period_s is None:
            return True
        if now < self.next_scan_s - 1e-9:
            return False
        while self.next_scan_s <= now + 1e-9:
            self.next_scan_s += self.scan_period_s
        return True

    def _scan(self, now: float, state: State) -> list[Scan]:
        """One scan of every sensor, as old as the latency."""
        taken = max(self.mission.start.time_s, now - self.settings.scan_latency_s)
        seen_from = state if taken >= now else self.motion.at(taken)
        world = self._world_at(seen_from.time_s)
        return [scan_world(sensor, world, seen_from, self.scan_rng) for sensor in self.lidars]

    def _decide(self, readings: Sequence[Reading]) -> LoggedDecision[D] | None:
        """What the pilot makes of readings, if a decision is due."""
        now = self.motion.now_s
        started = time.perf_counter()
        for reading in readings:
            self.system.update(reading)
        why = self.system.due(now)
        if why is None or (self.settings.faults.silent_at(now) and self._can_fly_on()):
            return None
        flight = self.system.decide(now)
        elapsed_s = time.perf_counter() - started
        if not isinstance(flight, FlightDecision):
            return LoggedDecision(flight, why, elapsed_s)
        # Asked now, since later scans change it.
        ways = flight.decision.ways
        sight = measure_sight_from(self.system.planner, flight.state, ways)
        return LoggedDecision(flight, why, elapsed_s, sight)

    def _can_fly_on(self) -> bool:
        """Whether there is something to fly without a decision."""
        return self.system.movement_at(self.motion.now_s) is not None

    def _movement(self) -> Movement:
        """What the pilot flies now."""
        now = self.motion.now_s
        movement = self.system.movement_at(now)
        if movement is None:
            raise ClearwayError(f"pilot: nothing to fly at {now:g} s, and no decision is due")
        return movement

    def _world_at(self, time_s: float) -> World:
        """What stands still, and visible traffic where it was at a time."""
        bodies = self.traffic.bodies(time_s) if self.traffic is not None else []
        return CombinedWorld([self.world, ObstacleMap(bodies)]) if bodies else self.world

    def _move_traffic(self) -> None:
        if self.traffic is not None:
            self.traffic.step(self.motion.state)

    def _fly_on(self, movement: Movement) -> None:
        """One movement; of a vehicle with inertia a part of one, until it senses again."""
        if not self.automaton.has_inertia:
            self._fly(self.motion.fly(movement), movement.duration_s)
            return
        now = self.motion.now_s
        self.guide.movement_at(now, movement, self.motion.movements)
        part_s = self.guide.part_s
        self._fly(self.motion.follow(self.guide.ask_from(now), part_s), part_s)

    def _fly(self, steps: Iterator[None], lasts_s: float) -> None:
        """Take steps that last so long; stops early at the last goal, or in an obstacle."""
        ends_s = self.motion.now_s + lasts_s
        states = self.motion.states
        x, y, z, *_ = states[-1].tolist()
        for _ in steps:
            self._move_traffic()
            (from_x, from_y, from_z), (x, y, z, *_) = (x, y, z), states[-1].tolist()
            dx, dy, dz = x - from_x, y - from_y, z - from_z
            flown_m = math.sqrt(dx * dx + dy * dy + dz * dz)
            # Both are looked up only where they can have changed, and where this is no number.
            self.free_m -= flown_m
            if not self.free_m > 0.0:
                self.crashed = self._hit()
                if self.crashed:
                    return
            self.same_m -= flown_m
            if not self.same_m > 0.0:
                self._advance(states[-1][:3])
                if self.progress.is_done(self.mission):
                    return
            if self.scan_period_s is not None and self.next_scan_s < ends_s - 1e-9:
                self._look_about()

    def _look_about(self) -> None:
        """Tell the pilot what a scan shows in the middle of a movement, if one is due."""
        now = self.motion.now_s
        if now < self.next_scan_s - 1e-9:
            return
        for reading in self._sense():
            self.system.update(reading)
        system: object = self.system
        if isinstance(system, AvoidanceSystem):
            system.catch_up(now)
            if self.automaton.has_inertia:
                system.keep_up(now)  # As whoever flies has time to, between decisions.

    def _advance(self, place: FloatArray) -> None:
        """Progress up to a place [3]."""
        mission, level = self.mission, self.automaton.stays_level
        self.same_m = news_in_m(mission, self.progress, place, stays_level=level) - ROUNDING_M
        if not self.same_m > 0.0:
            now = self.motion.now_s
            self.progress = advance_progress(mission, self.progress, place, now, stays_level=level)

    def _hit(self) -> bool:
        """Whether the last step went through an obstacle."""
        step = np.array([self.motion.states[-2][:3], self.motion.states[-1][:3]])
        hit, self.free_m = touches(self.world, step, self.margin_m)
        return hit

    def _time_limit(self) -> float:
        if self.settings.time_limit_s is not None:
            return self.mission.start.time_s + self.settings.time_limit_s
        straight = self.mission.straight_length_m / max(self.system.planner.speed_mps, 1e-9)
        return self.mission.start.time_s + 6.0 * straight + 60.0

    @property
    def _planner(self) -> str:
        system: object = self.system
        return CLEARWAY if isinstance(system, AvoidanceSystem) else type(system).__name__

    @property
    def _ways_out(self) -> EscapePlan | None:
        system: object = self.system
        return system.escape if isinstance(system, AvoidanceSystem) else None

    def _finish(self, decisions: tuple[LoggedDecision[D], ...]) -> Run[D]:
        times, states = np.array(self.motion.times), np.array(self.motion.states)
        margin = self.margin_m
        tracks = self.traffic.tracks if self.traffic is not None else {}
        radii = self.traffic.radii_m() if self.traffic is not None else {}
        margins = {name: margin + radius for name, radius in radii.items()}
        intruders = intruder_distances(times, states[:, :3], tracks, margins)
        nominal = np.concatenate([self.mission.start.position_m[None], self.mission.waypoints_m])
        speed = self.system.planner.speed_mps
        straight = straight_distances(times, nominal, speed, tracks, margins)
        return Run(
            mission=self.mission,
            time_s=times,
            states=states,
            decisions=decisions,
            movements=tuple(self.motion.movements),
            progress=self.progress,
            metrics=measure_flight(times, states, self.world, nominal, margin, intruders, straight),
            safety_margin_m=margin,
            body_radius_m=self.system.planner.settings.body_radius_m,
            seed=self.settings.seed,
            intruder_tracks={
                name: np.array([[time, *place] for time, place in track])
                for name, track in tracks.items()
            },
            corrections=self.motion.corrections,
            counts=dict(self.system.counts),
            world=self.world,
            planner=self._planner,
            ways_out=self._ways_out,
        )
