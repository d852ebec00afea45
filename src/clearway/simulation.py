"""Closed loop: truth in small steps, sensors that see it, a system that decides, and the outcome.

The vehicle flies movement by movement, as a movement automaton does: a decision takes effect when
a movement ends. Bounded disturbances (3.20) act on the state's rates (w) and on the inputs (v).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, TypeGuard

import numpy as np

from clearway.errors import ClearwayError
from clearway.faults import NO_FAULTS, Faults
from clearway.frames import FloatArray
from clearway.metrics import FlightMetrics, intruder_distances, measure, straight_distances
from clearway.mission import Mission, Mode, advanced
from clearway.mission import Progress as MissionProgress
from clearway.movements import Movement
from clearway.obstacle_map import ObstacleMap
from clearway.pilot import D, Pilot, Steering
from clearway.prediction import corrected_movement, needs_correction, prediction_error
from clearway.sensors import Lidar, Scanner, scanned
from clearway.state import State
from clearway.system import FlightDecision, Reading
from clearway.traffic import AirTraffic
from clearway.world import CombinedWorld, World

LARGEST_STEP_S = 0.05
"""Truth is never coarser than this."""


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """What the simulated truth is like."""

    seed: int = 0
    step_s: float = LARGEST_STEP_S
    scan_latency_s: float = 0.0
    """Age of a scan when it reaches the system."""
    state_noise_mps: float = 0.0
    """Bound of w (3.20) on each axis of velocity."""
    input_noise: float = 0.0
    """Bound of v (3.20) as a share of the speed, and of the largest turn rate."""
    wind_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Steady wind that carries the vehicle, world frame."""
    position_sigma_m: float = 0.0
    """Standard deviation of the own position as measured, stated to the system."""
    time_limit_s: float | None = None
    """None allows six times the straight flight and a minute."""
    faults: Faults = NO_FAULTS

    def __post_init__(self) -> None:
        if not 0.0 < self.step_s <= LARGEST_STEP_S:
            raise ClearwayError(f"step_s: must be within (0, {LARGEST_STEP_S}], got {self.step_s}")
        for name in ("scan_latency_s", "state_noise_mps", "input_noise", "position_sigma_m"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ClearwayError(f"{name}: must be a number >= 0, got {getattr(self, name)}")
        if not np.all(np.isfinite(self.wind_mps)):
            raise ClearwayError(f"wind_mps: must be three finite numbers, got {self.wind_mps}")


@dataclass(frozen=True, eq=False)
class LoggedDecision(Generic[D]):
    """A decision as it was taken in flight, and how long it took."""

    flight: D
    why_now: str
    elapsed_s: float
    """From the sensor's arrays in hand to the explained decision."""


@dataclass(frozen=True, eq=False)
class Run(Generic[D]):
    """One simulated flight."""

    mission: Mission
    time_s: FloatArray
    """[n] at most 0.05 s apart."""
    states: FloatArray
    """[n, 6] true states, world frame."""
    decisions: tuple[LoggedDecision[D], ...]
    movements: tuple[str, ...]
    """Movements flown: the chained buffer of (6.3)."""
    progress: MissionProgress
    """By the true position."""
    metrics: FlightMetrics
    safety_margin_m: float
    seed: int
    intruder_tracks: dict[str, FloatArray] = field(default_factory=dict)
    """[n, 4] time and true position of each intruder, from its appearance on."""
    corrections: int = 0
    """Movements flown with corrected turn rates, since the prediction error took more than its
    share of the margin (4.2.2)."""
    counts: dict[str, int] = field(default_factory=dict)
    """Data that the system left out, by reason."""

    @property
    def reached(self) -> bool:
        return self.progress.done(self.mission)

    @property
    def crashed_s(self) -> float | None:
        """Time of the first contact: in an obstacle, which ends a flight, or an intruder's body."""
        contact = self.nearest_surface_m <= 0.0
        return float(self.time_s[np.argmax(contact)]) if contact.any() else None

    @property
    def nearest_surface_m(self) -> FloatArray:
        """[n] distance to the nearest surface at each time, of obstacles and intruders' bodies."""
        traffic = self.metrics.intruders
        if traffic is None:
            return self.metrics.obstacle_distance_m
        radius = traffic.margin_m - self.safety_margin_m
        bodies = (traffic.distance_m - radius[:, None]).min(axis=0)
        return np.asarray(np.minimum(self.metrics.obstacle_distance_m, bodies))

    @property
    def emergencies(self) -> int:
        """Decisions in which nothing kept the margin."""
        return sum(entry.flight.mode is Mode.EMERGENCY for entry in self.decisions)

    @property
    def safe(self) -> bool:
        """Reached, and never nearer than the margin."""
        return self.reached and self.metrics.margin_violations == 0


OnDecision = Callable[[LoggedDecision[D], MissionProgress], None]


def decided_by_clearway(run: Run[Steering]) -> TypeGuard[Run]:
    """Whether the decisions of a flight carry what clearway's own do, as its pictures need."""
    return all(isinstance(entry.flight, FlightDecision) for entry in run.decisions)


def simulate(
    system: Pilot[D],
    world: World,
    lidars: Sequence[Lidar | Scanner],
    settings: SimulationSettings | None = None,
    on_decision: OnDecision[D] | None = None,
    traffic: AirTraffic | None = None,
) -> Run[D]:
    """Fly the pilot's mission through a true world; the same seed gives the same run.

    traffic: fresh for every flight, since it flies along.
    """
    settings = settings or SimulationSettings()
    flight = _Flight(system, world, lidars, settings, traffic)
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
    ) -> None:
        self.system, self.world, self.lidars, self.settings = system, world, lidars, settings
        self.traffic = traffic
        self.mission = system.mission
        self.automaton = system.planner.automaton
        self.scan_rng, self.state_rng, self.noise_rng, self.fault_rng = (
            np.random.default_rng([settings.seed, stream]) for stream in range(4)
        )
        self.wind_mps = np.array(settings.wind_mps)
        start = self.mission.start
        self.times = [start.time_s]
        self.states = [start.vector]
        self.progress = MissionProgress()
        self.movements: list[str] = []
        self.turn_rate = max(m.turn_rate_rps for m in self.automaton.movements)
        self.predicted = start.vector
        self.corrections = 0
        self.crashed = False
        self.free_m = 0.0

    def run(self, on_decision: OnDecision[D] | None) -> Run[D]:
        system, mission = self.system, self.mission
        limit = self._time_limit()
        self._move_traffic()
        decisions: list[LoggedDecision[D]] = []
        queue: list[Movement] = []
        while not (self.progress.done(mission) or self.crashed) and self.times[-1] < limit:
            now = self.times[-1]
            readings = self._sense(now)
            started = time.perf_counter()
            for reading in readings:
                system.update(reading)
            why = system.due(now)
            if why is not None:
                flight = system.decide(now)
                entry = LoggedDecision(flight, why, time.perf_counter() - started)
                decisions.append(entry)
                queue = list(self.automaton.chain(flight.movements))
                if on_decision is not None:
                    on_decision(entry, self.progress)
            self._fly(queue.pop(0))
        return self._finished(decisions)

    def _sense(self, now: float) -> list[Reading]:
        """What arrives at this moment: the own state, and scans as old as the latency."""
        settings = self.settings
        sigma = settings.position_sigma_m
        state = self._true_state(now)
        error = self.state_rng.normal(0.0, 1.0, 3) * sigma
        readings: list[Reading] = [
            replace(state, position_m=state.position_m + error, position_std_m=sigma)
        ]
        seen_from = self._true_state(max(self.times[0], now - settings.scan_latency_s))
        world = self._world_at(seen_from.time_s)
        scans = [scanned(sensor, world, seen_from, self.scan_rng) for sensor in self.lidars]
        reports = self.traffic.reports(now) if self.traffic is not None else []
        if settings.faults != NO_FAULTS:
            faulty = [settings.faults.scan(scan, now) for scan in scans]
            heard = [settings.faults.report(report, self.fault_rng) for report in reports]
            return readings + [one for one in (*faulty, *heard) if one is not None]
        return readings + scans + reports

    def _world_at(self, time_s: float) -> World:
        """What stands still, and visible traffic where it was at a time."""
        bodies = self.traffic.bodies(time_s) if self.traffic is not None else []
        return CombinedWorld([self.world, ObstacleMap(bodies)]) if bodies else self.world

    def _move_traffic(self) -> None:
        if self.traffic is not None:
            state = self.states[-1]
            self.traffic.step(State(state[:3], state[3:], self.times[-1]))

    def _true_state(self, time_s: float) -> State:
        at = int(np.searchsorted(self.times, time_s - 1e-9))
        vector = self.states[min(at, len(self.states) - 1)]
        return State(vector[:3], vector[3:], self.times[min(at, len(self.times) - 1)])

    def _fly(self, movement: Movement) -> None:
        """Execute one movement in steps; stops early at the last goal, or in an obstacle."""
        settings = self.settings
        steps = int(np.ceil(movement.duration_s / settings.step_s - 1e-9))
        step = movement.duration_s / steps
        self.movements.append(movement.name)
        start = self.times[-1]
        origin = self.states[-1]
        movement = self._corrected(movement)
        disturbed = (
            settings.state_noise_mps > 0.0 or settings.input_noise > 0.0 or self.wind_mps.any()
        )
        for number in range(1, steps + 1):
            if disturbed:
                state = self._disturbed(self.states[-1], movement, step)
            else:
                state = self.automaton.predict(origin, movement, number * step)
            self.states.append(state)
            self.times.append(start + number * step)
            self._move_traffic()
            self.crashed = self._hit()
            if self.crashed:
                return
            self.progress = advanced(self.mission, self.progress, state[:3], self.times[-1])
            if self.progress.done(self.mission):
                return

    def _hit(self) -> bool:
        """Whether the vehicle is in an obstacle; looked up only where it can have come to one."""
        self.free_m -= float(np.linalg.norm(self.states[-1][:3] - self.states[-2][:3]))
        if self.free_m <= 0.0:
            self.free_m = float(self.world.distance_m(self.states[-1][None, :3])[0])
        return self.free_m <= 0.0

    def _corrected(self, movement: Movement) -> Movement:
        """The movement that brings the attitude back to what the chain of movements predicts.

        Attitude is predicted along the whole chain, position from where the movement begins: the
        next decision starts from the true position anyway.
        """
        state, predicted = self.states[-1], self.predicted
        anchored = np.concatenate([state[:3], predicted[3:]])
        self.predicted = self.automaton.predict(anchored, movement)
        radius = self.automaton.turning_radius_m
        error = prediction_error(state, predicted, radius if np.isfinite(radius) else 0.0)
        if not needs_correction(error, self.system.planner.settings.safety_margin_m):
            return movement
        self.corrections += 1
        return corrected_movement(self.automaton, movement, state, anchored)

    def _disturbed(self, state: FloatArray, movement: Movement, step: float) -> FloatArray:
        settings = self.settings
        v = self.noise_rng.uniform(-1.0, 1.0, 3) * settings.input_noise
        inputs = movement.inputs
        inputs = inputs + np.array(
            [v[0] * inputs[0], 0.0, v[1] * self.turn_rate, v[2] * self.turn_rate]
        )
        moved = self.automaton.vehicle.advance(state, inputs, step)
        w = self.noise_rng.uniform(-1.0, 1.0, 3) * settings.state_noise_mps
        moved[:3] += (w + self.wind_mps) * step
        return moved

    def _time_limit(self) -> float:
        if self.settings.time_limit_s is not None:
            return self.mission.start.time_s + self.settings.time_limit_s
        speed = max(movement.speed_mps for movement in self.automaton.movements)
        straight = self.mission.straight_length_m / max(speed, 1e-9)
        return self.mission.start.time_s + 6.0 * straight + 60.0

    def _finished(self, decisions: list[LoggedDecision[D]]) -> Run[D]:
        times, states = np.array(self.times), np.array(self.states)
        margin = self.system.planner.settings.safety_margin_m
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
            decisions=tuple(decisions),
            movements=tuple(self.movements),
            progress=self.progress,
            metrics=measure(times, states, self.world, nominal, margin, intruders, straight),
            safety_margin_m=margin,
            seed=self.settings.seed,
            intruder_tracks={
                name: np.array([[time, *place] for time, place in track])
                for name, track in tracks.items()
            },
            corrections=self.corrections,
            counts=dict(self.system.counts),
        )
