"""Flights in which somebody hostile or careless commands, and a guardian stands between.

Where the vehicle goes, what is in its way and whether a command was safe is reckoned here, by
geometry of the tests' own.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live.guard.guardian import Guarded, Guardian
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.sensors.beams.simulate import simulate_scan
from clearway.vehicle.automaton import MovementAutomaton
from solids import Array, Solids

MARGIN_M, BODY_M, HOLD_S, TICK_S = 0.6, 0.1, 0.5, 0.1
FINE = 10
"""Steps of the true motion in a tick."""
GRID = AvoidanceGrid.uniform()
AUTOMATA = {
    "stops": MovementAutomaton.inertialess(1.0),
    "flies on": MovementAutomaton.plane(1.0),
}
LIBRARIES: dict[str, ReachLibrary] = {}


def planner_for(vehicle: str, escape: str) -> Planner:
    if vehicle not in LIBRARIES:
        LIBRARIES[vehicle] = ReachLibrary.load_or_build(AUTOMATA[vehicle], GRID)
    settings = AvoidanceSettings(
        safety_margin_m=MARGIN_M, body_radius_m=BODY_M, escape=escape, own_drift_mps=0.05
    )
    return Planner.of(LIBRARIES[vehicle], settings)


def world_of(seed: int, vehicle: str) -> ObstacleMap:
    """Balls, boxes, walls and wires about a free start."""
    rng = np.random.default_rng([seed, 17])
    obstacles: list[Obstacle] = []
    room = 5.5 if vehicle == "flies on" else 1.2
    while len(obstacles) < 18:
        place = rng.uniform(-14.0, 14.0, 3) * [1.0, 1.0, 0.5]
        turned = rng.uniform(-np.pi, np.pi, 3) * [0.2, 0.2, 1.0]
        kind = int(rng.integers(3))
        if kind == 0:
            one = Obstacle.ball(place, float(rng.uniform(0.3, 2.5)))
        elif kind == 1:
            size = tuple(float(s) for s in rng.uniform(0.3, 5.0, 3))
            one = Obstacle.cuboid(place, size, orientation_rad=turned)
        else:
            one = Obstacle.line(
                place, float(rng.uniform(2.0, 12.0)), radius_m=0.15, orientation_rad=turned
            )
        if Solids.of([one]).distance_m([0.0, 0.0, 0.0])[0] > room:
            obstacles.append(one)
    return ObstacleMap(obstacles)


def lidar_around() -> Lidar:
    """Sees all round, and 50 degrees up and down."""
    azimuth = np.radians(np.arange(-180.0, 180.0, 5.0))
    elevation = np.radians(np.arange(-50.0, 50.1, 5.0))
    pattern = BeamPattern.from_angles(azimuth, elevation, max_range_m=12.0)
    return Lidar("lidar", pattern, sigma_m=0.01, dropout=0.02)


@dataclass
class GuardedFlight:
    """One flight, a command a tick; what came of it."""

    seed: int
    vehicle: str
    ticks: int
    with_lidar: bool = False
    ahead: bool = False
    """Whether what has come is taken in before the command does."""
    least_m: float = np.inf
    """From the centre to any surface, along the whole way."""
    safe: int = 0
    """Commands that were safe by the test's own geometry."""
    safe_passed: int = 0
    unsafe_passed: int = 0
    passed: int = 0
    lost: int = 0
    """Ticks without a way out in hand after the first one."""
    track: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 18])
        self.map = world_of(self.seed, self.vehicle)
        self.solids = Solids.of(self.map.obstacles)
        escape = "strict" if self.with_lidar else "known"
        self.lidar = lidar_around() if self.with_lidar else None
        self.place, self.yaw, self.pitch = np.zeros(3), float(self.rng.uniform(-3.1, 3.1)), 0.0
        self.guardian = Guardian(
            planner_for(self.vehicle, escape),
            State(self.place, np.array([0.0, 0.0, self.yaw])),
            lidars=() if self.lidar is None else (self.lidar,),
            obstacle_map=None if self.with_lidar else self.map,
            acceleration_mps2=np.inf,
            hold_s=HOLD_S,
        )
        self.wish = np.array([1.0, 0.0, 0.0])
        held = False
        for tick in range(self.ticks):
            out = self._tick(tick)
            sure = out.way_out is not None and out.way_out.certain
            self.lost += held and not sure
            held = held or sure

    def _tick(self, tick: int) -> Guarded:
        now = round(tick * TICK_S, 6)
        state = State(self.place, np.array([0.0, self.pitch, self.yaw]), time_s=now)
        self.guardian.update(state)
        if self.lidar is not None and tick % 2 == 0:
            self.guardian.update(simulate_scan(self.lidar, self.map, state, self.rng))
        if self.ahead:
            self.guardian.catch_up(now)
        self._think(tick)
        silent = tick % 50 >= 44  # Nobody commands for a while.
        out = self.guardian.guard(None, now) if silent else (
            self.guardian.guard_velocity(self.wish, now, yaw_rate_rps=float(self.rng.normal()))
        )  # fmt: skip
        if not silent:
            self._judge(out)
        self._fly(out, now)
        return out

    def _think(self, tick: int) -> None:
        """The next command: at random, at the nearest thing, to and fro, too fast."""
        mood = (tick // 12) % 5
        if mood == 0 and tick % 12 == 0:
            self.wish = self._any() * self.rng.uniform(0.0, 1.0)
        elif mood in (1, 3):
            self.wish = self._at_nearest() * (1.0 if mood == 1 else 8.0)
        elif mood == 2:
            self.wish = self._any() * self.rng.uniform(0.0, 1.0)
        elif mood == 4 and tick % 3 == 0:
            self.wish = self._at_nearest() * (1.0 if tick % 2 else -1.0)

    def _any(self) -> Array:
        way = self.rng.normal(size=3)
        return np.asarray(way / np.linalg.norm(way))

    def _at_nearest(self) -> Array:
        steps = np.eye(3) * 1e-3
        here = self.solids.distance_m(self.place)[0]
        slope = np.array([self.solids.distance_m(self.place + s)[0] - here for s in steps])
        size = np.linalg.norm(slope)
        return self._any() if size < 1e-9 else np.asarray(-slope / size)

    def _judge(self, out: Guarded) -> None:
        """Whether the command was safe: straight on and then to a halt; or, of what cannot stop,
        turned towards and then round one of two circles."""
        fast = float(np.linalg.norm(self.wish))
        self.passed += out.passed
        if self.with_lidar or fast > 1.0:
            return
        if self.vehicle == "stops":
            way = np.array([self.place, self.place + self.wish * HOLD_S])
            clear = self.solids.nearest_on_track_m(way)
            safe = clear >= MARGIN_M + 1e-6
            unsafe = clear < MARGIN_M - 1e-6
        else:
            way, pitch, yaw = self._turned(HOLD_S, 40)
            way, levelled = _levelled(way, pitch, yaw)
            clear = self.solids.nearest_on_track_m(way)
            unsafe = clear < MARGIN_M - 0.01
            safe = clear >= MARGIN_M + 0.01 and abs(levelled) < 1e-9 and any(
                self.solids.nearest_on_track_m(_circle(way[-1], yaw, side)) >= MARGIN_M + 0.01
                for side in (-1.0, 1.0)
            )  # fmt: skip
        self.safe += safe
        self.safe_passed += safe and out.passed
        self.unsafe_passed += unsafe and out.passed

    def _turned(self, lasts_s: float, steps: int) -> tuple[Array, float, float]:
        """Where a vehicle that cannot stop flies for a command, at the middle of small steps."""
        most = np.radians(15.0)
        wished = np.arcsin(np.clip(-self.wish[2] / np.linalg.norm(self.wish), -1.0, 1.0))
        limit = np.radians(30.0)
        to_pitch = np.clip(
            np.clip(wished, -limit, limit) - self.pitch, -most * HOLD_S, most * HOLD_S
        )
        aside = np.arctan2(self.wish[1], self.wish[0]) - self.yaw
        to_yaw = np.clip((aside + np.pi) % (2 * np.pi) - np.pi, -most * HOLD_S, most * HOLD_S)
        share = (np.arange(steps) + 0.5) / steps * lasts_s / HOLD_S
        pitch, yaw = self.pitch + share * to_pitch, self.yaw + share * to_yaw
        ahead = np.stack(
            [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)], axis=1
        )
        way = self.place + np.concatenate(
            [np.zeros((1, 3)), np.cumsum(ahead * lasts_s / steps, axis=0)]
        )
        end = lasts_s / HOLD_S
        return way, float(self.pitch + end * to_pitch), float(self.yaw + end * to_yaw)

    def _fly(self, out: Guarded, now: float) -> None:
        """The true motion until the next tick."""
        if out.velocity_mps is self.wish or (out.why.startswith(("the wish keeps", "slowed"))):
            if self.vehicle == "stops":
                steps = np.arange(FINE + 1)[:, None] / FINE * TICK_S
                way = self.place + steps * out.velocity_mps
                self.yaw += out.yaw_rate_rps * TICK_S
            else:
                way, self.pitch, self.yaw = self._turned(TICK_S, FINE)
        else:
            states = [self.guardian.state_at(now + TICK_S * k / FINE) for k in range(1, FINE + 1)]
            way = np.array([self.place] + [s.position_m for s in states if s is not None])
            last = states[-1]
            assert last is not None
            self.pitch, self.yaw = float(last.attitude_rad[1]), float(last.attitude_rad[2])
        assert np.linalg.norm(way[-1] - way[0]) <= 1.01 * TICK_S, "no faster than the vehicle is"
        self.place = way[-1]
        self.track.append(self.place)
        self.least_m = min(self.least_m, self.solids.nearest_on_track_m(way))


def _levelled(way: Array, pitch: float, yaw: float) -> tuple[Array, float]:
    """On from the end of a way to the nearest pitch of 15 degrees' steps."""
    kept = np.radians(15.0) * round(pitch / np.radians(15.0))
    lasts_s = abs(kept - pitch) / np.radians(15.0)
    between = pitch + (np.arange(20) + 0.5) / 20 * (kept - pitch)
    ahead = np.stack(
        [np.cos(between) * np.cos(yaw), np.cos(between) * np.sin(yaw), -np.sin(between)], axis=1
    )
    return np.concatenate([way, way[-1] + np.cumsum(ahead * lasts_s / 20, axis=0)]), kept


def _circle(place: Array, yaw: float, side: float) -> Array:
    """A level circle of the smallest radius, begun at a place."""
    radius = 1.0 / np.radians(15.0)
    middle = place + radius * side * np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    turned = np.linspace(0.0, 2.0 * np.pi, 200)
    angle = yaw - side * 0.5 * np.pi + side * turned
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(200)], axis=1)
    return np.asarray(middle + radius * ring)
