"""One flight: a pilot wishes, a filter commands, a copter with inertia moves, the truth judges."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.filters.pilots import HEADS_FOR_GOAL, PILOTS
from benchmarks.filters.protocol import TICK_S, Command, Copter, Own, SafetyFilter
from benchmarks.filters.surroundings import SeenByLidar
from benchmarks.filters.worlds import (
    BODY_M,
    MARGIN_M,
    REACHED_M,
    SPEED_MPS,
    Course,
    make_course,
    set_up,
)
from clearway.avoidance.plan.time_cost import speed_abilities
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.mavlink.simulated_habits import default_habits
from clearway.mavlink.simulated_targets import Target, VelocityTarget
from clearway.mavlink.simulated_vehicle import VehicleLimits, VehicleTruth
from clearway.missions.setup import FlightSetup
from clearway.sensors import Lidar
from clearway.sensors.beams.simulate import simulate_scan

STEP_S = 0.025
SCAN_EVERY = 2
"""Ticks between two scans."""
LASTS_S, AIMLESS_S = 30.0, 15.0
"""Of a flight at most; of pilots that head for no goal."""
STANDS_S, STANDS_M = 5.0, 0.1
"""A copter that has moved by no more in so long is stuck: the flight ends."""
CHANGE_S = 0.3
"""A change is the difference in velocity that it makes in this time."""
ROUNDING_M = 1e-3


@dataclass
class FlightRow:
    """What came of a flight; all that the journal keeps."""

    world: str
    seed: int
    pilot: str
    method: str
    contact: bool = False
    nearest_m: float | None = None
    """Of the copter's middle to any surface; None in an empty world."""
    arrived: bool = False
    time_s: float = 0.0
    commands: int = 0
    changed: int = 0
    change_mps: float = 0.0
    """Sum over changed commands."""
    failed: str = ""
    """Of a filter that ended with an error."""
    call_ms: list[float] = field(default_factory=list)
    """CPU of each call."""

    @property
    def margin_lost(self) -> bool:
        """Whether it came nearer than the margin."""
        return self.nearest_m is not None and self.nearest_m < MARGIN_M - ROUNDING_M

    @property
    def key(self) -> tuple[str, int, str, str]:
        """Which flight it is."""
        return self.world, self.seed, self.pilot, self.method


MakeFilter = Callable[[FlightSetup, Copter], SafetyFilter]
_setups: dict[str, tuple[Course, FlightSetup]] = {}


def prepared(world: str, seed: int) -> tuple[Course, FlightSetup]:
    """Return a course and its copter; the last one is kept."""
    name = f"{world}/{seed}"
    if name not in _setups:
        course = make_course(world, seed)
        _setups.clear()
        _setups[name] = course, set_up(course)
    return _setups[name]


def fly(row: FlightRow, make: MakeFilter) -> FlightRow:
    """Fly what a row names, and fill it in."""
    course, setup = prepared(row.world, row.seed)
    lasts_s = LASTS_S if row.pilot in HEADS_FOR_GOAL else AIMLESS_S
    return _Flight(row, course, setup, make).run(lasts_s)


class _Flight:
    def __init__(
        self, row: FlightRow, course: Course, setup: FlightSetup, make: MakeFilter
    ) -> None:
        self.row, self.course = row, course
        self.copter = Copter(
            speed_abilities(setup.planner.automaton).acceleration_mps2, SPEED_MPS, MARGIN_M, BODY_M
        )
        habits = default_habits(setup.planner.automaton)
        self.limits = VehicleLimits(
            SPEED_MPS, habits.acceleration_mps2, habits.climb_acceleration_mps2, habits.tilt_s
        )
        lidar = setup.sensors[0]
        assert isinstance(lidar, Lidar)
        self.lidar = lidar
        yaw = float(setup.mission.start.attitude_rad[2])
        self.truth = VehicleTruth(course.start_m, np.zeros(3), yaw)
        self.known = SeenByLidar(setup.planner, lidar, course.start_m, self.copter)
        self.filter = make(setup, self.copter)
        # Every method meets the same pilot and the same noise.
        self.pilot = PILOTS[row.pilot](course, np.random.default_rng([row.seed, 171]))
        self.scan_rng = np.random.default_rng([row.seed, 172])
        self.nearest_m = np.inf
        self.stood: tuple[float, FloatArray] = (0.0, course.start_m)

    def run(self, lasts_s: float) -> FlightRow:
        row = self.row
        for tick in range(round(lasts_s / TICK_S)):
            now = round(tick * TICK_S, 6)
            own = Own(now, self.truth.position_m, self.truth.velocity_mps, self.truth.yaw_rad)
            self._see(own, tick)
            wish = self.pilot.wish(own)
            command = self._ask(own, wish)
            self._note(command, wish)
            self._move(command.target)
            row.time_s = round((tick + 1) * TICK_S, 6)
            row.contact = self.nearest_m <= BODY_M
            off = float(np.linalg.norm(self.truth.position_m - self.course.goal_m))
            row.arrived = not row.contact and off <= REACHED_M
            if row.contact or row.arrived or self._is_stuck(row.time_s):
                break
        row.nearest_m = float(self.nearest_m) if np.isfinite(self.nearest_m) else None
        return row

    def _is_stuck(self, now_s: float) -> bool:
        since_s, place = self.stood
        if float(np.linalg.norm(self.truth.position_m - place)) > STANDS_M:
            self.stood = now_s, self.truth.position_m
            return False
        return now_s - since_s >= STANDS_S

    def _see(self, own: Own, tick: int) -> None:
        state = State(own.position_m, np.array([0.0, 0.0, own.yaw_rad]), time_s=own.time_s)
        scan = None
        if tick % SCAN_EVERY == 0:
            scan = simulate_scan(self.lidar, self.course.world, state, self.scan_rng)
        self.known.hear(scan, state)
        self.filter.look(own, self.known)

    def _ask(self, own: Own, wish: FloatArray) -> Command:
        began = time.thread_time()
        command = self.filter.command(own, wish, self.known)
        own_ms = 1e3 * (time.thread_time() - began)
        self.row.call_ms.append(round(own_ms + (command.took_ms or 0.0), 3))
        return command

    def _note(self, command: Command, wish: FloatArray) -> None:
        self.row.commands += 1
        if not command.passed:
            self.row.changed += 1
            self.row.change_mps += self._difference(command.target, VelocityTarget(wish, 0.0))

    def _difference(self, one: Target, other: Target) -> float:
        ends = [self.truth, self.truth]
        steps = round(CHANGE_S / TICK_S)
        for n in range(steps):
            ends = [
                end.after(TICK_S, target, self.limits, n * TICK_S)
                for end, target in zip(ends, (one, other), strict=True)
            ]
        return float(np.linalg.norm(ends[0].velocity_mps - ends[1].velocity_mps))

    def _move(self, target: Target) -> None:
        steps = round(TICK_S / STEP_S)
        step_s = TICK_S / steps
        for n in range(steps):
            self.truth = self.truth.after(step_s, target, self.limits, n * step_s)
            gap = float(self.course.world.distance_m(self.truth.position_m[None])[0])
            self.nearest_m = min(self.nearest_m, gap)
