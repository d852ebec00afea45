"""Flights of guarded copters by number: straight at masts and walls, hostile, past an aircraft.

Which wishes were near nothing is reckoned here, by geometry of the tests' own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clearway.live.guard.braking import Braking, find_braking
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.scripted import ScriptedIntruder
from companion_missions import mission
from guarded_inertia import GuardedCopter

MARGIN_M, HEIGHT_M, AWAY_M, RANGE_M = 1.5, 7.0, 22.0, 30.0
ROUNDED_M = 0.01
"""Distances are told in centimetres."""
WIDE_M, AIRCRAFT_MPS, AIRCRAFT_M = 5.5, 20.0, 2.0
NOTHING_M = 1.0
"""A wish is near nothing whose way, to a stop, keeps so much more than the margin."""
HOLD_S, BEGINS_S = 0.5, 1.0
MOOD_S, MOODS = 0.6, 5


@dataclass(frozen=True)
class Outcome:
    """What came of a flight."""

    nearest_m: float
    """That the centre came to a surface, or to the edge of an aircraft."""
    asked_m: float
    tally: dict[str, int]
    near_nothing: int = 0
    """Wishes whose way is far from everything."""
    unchanged: int = 0
    """Of these, those that passed."""

    @property
    def is_kept(self) -> bool:
        """Whether the margin was."""
        return self.nearest_m >= self.asked_m - ROUNDED_M


def straight_at(seed: int) -> Outcome:
    """Commanded straight at a mast or a wall at 1 to 10 m/s."""
    rng = np.random.default_rng(seed)
    speed = float(rng.uniform(1.0, 10.0))
    file, setup = _guarded(seed, speed)
    aside = float(rng.uniform(-2.0, 2.0))
    mast = Obstacle.line_between([AWAY_M, aside, 0.0], [AWAY_M, aside, 20.0], radius_m=1.5)
    wall = Obstacle.cuboid([AWAY_M, aside, 10.0], (2.0, 25.0, 20.0))
    habits = _habits(rng)
    course = float(rng.uniform(-0.05, 0.05))
    wish = speed * np.array([np.cos(course), np.sin(course), 0.0])
    world = ObstacleMap([mast if rng.random() < 0.5 else wall])
    flight = GuardedCopter(file, replace(setup, world=world), lambda _time, _place: wish, habits)
    flight.run(6.0 + AWAY_M / speed)
    return _outcome(flight)


def hostile(seed: int) -> Outcome:
    """300 wishes among masts and walls: at the nearest thing, to and fro, at random, too fast."""
    rng = np.random.default_rng([seed, 55])
    speed = float(rng.uniform(1.0, 6.0))
    file, setup = _guarded(seed, speed)
    world, habits = _masts(rng), _habits(rng)
    wishes = Wishes(rng, world, speed)
    flight = GuardedCopter(file, replace(setup, world=world), wishes, habits)
    braking = find_braking(setup.planner, None)
    near_nothing = unchanged = 0
    while flight.autopilot.time_s < 15.0:
        truth = flight.autopilot.truth
        guarded = flight.step().guarded
        is_far = wishes.is_near_nothing(truth.position_m, truth.velocity_mps, braking)
        if guarded is not None and is_far and flight.autopilot.time_s > BEGINS_S:
            near_nothing, unchanged = near_nothing + 1, unchanged + guarded.passed
    return _outcome(flight, near_nothing=near_nothing, unchanged=unchanged)


def crossing(seed: int) -> Outcome:
    """A wish at 0 to 5 m/s, and an aircraft of 20 m/s from anywhere that would hit in 13 s."""
    rng = np.random.default_rng([seed, 56])
    wished = float(rng.choice([0.0, rng.uniform(1.0, 5.0)]))
    file, setup = _guarded(0, 5.0, height_m=40.0, margin_m=WIDE_M, sees=False)
    angle = float(rng.uniform(-math.pi, math.pi))
    velocity = AIRCRAFT_MPS * np.array([math.cos(angle), math.sin(angle), 0.0])
    meets = np.array([14.0 * wished, 0.0, 40.0])
    start = meets - 13.0 * velocity
    who = ScriptedIntruder("FAST", 1.0, start, velocity, radius_m=AIRCRAFT_M, spawn="world")
    wish = np.array([wished, 0.0, 0.0])
    flight = GuardedCopter(
        file, replace(setup, script=(who,)), lambda _time, _place: wish, _habits(rng)
    )
    flight.run(20.0)
    return _outcome(flight, asked_m=WIDE_M)


KINDS: dict[str, Callable[[int], Outcome]] = {
    "straight": straight_at,
    "hostile": hostile,
    "crossing": crossing,
}


class Wishes:
    """A wish a tick, in moods of 0.6 s."""

    def __init__(self, rng: np.random.Generator, world: ObstacleMap, speed_mps: float) -> None:
        self._rng, self._world, self._speed_mps = rng, world, speed_mps
        self._began_s = -math.inf
        self._mood, self._ticks = 0, 0
        self.wish = np.zeros(3)

    def __call__(self, time_s: float, place_m: np.ndarray) -> np.ndarray:
        self._ticks += 1
        if time_s - self._began_s >= MOOD_S - 1e-6:
            self._began_s, self._mood = time_s, int(self._rng.integers(MOODS))
            angle = self._rng.uniform(-math.pi, math.pi)
            share = self._rng.uniform(0.2, 1.0)
            self.wish = share * self._speed_mps * np.array([math.cos(angle), math.sin(angle), 0.0])
        if self._mood < 3:
            at = self._at_nearest(place_m)
            back = self._mood == 1 and self._ticks // 3 % 2
            self.wish = self._speed_mps * (3.0 if self._mood == 2 else 1.0) * (-at if back else at)
        return self.wish

    def _at_nearest(self, place_m: np.ndarray) -> np.ndarray:
        steps = np.concatenate([np.zeros((1, 3)), 1e-3 * np.eye(3)[:2]])
        here, east, north = self._world.distance_m(place_m + steps)
        slope = np.array([here - east, here - north, 0.0])
        return slope / max(float(np.linalg.norm(slope)), 1e-12)

    def is_near_nothing(
        self, place_m: np.ndarray, velocity_mps: np.ndarray, braking: Braking
    ) -> bool:
        """Whether the way of the wish, for as long as it counts and then to a stop, is far from
        everything, as is all that it is seen from; as late and hard as the vehicle brakes, and as
        soon and hard as its autopilot may gain speed."""
        if np.linalg.norm(self.wish) > self._speed_mps:
            return False
        gaps = [
            self._world.distance_m(np.concatenate([way, np.linspace(place_m, way[-1], 50)]))
            for way in (
                self._way(place_m, velocity_mps, braking, braking),
                self._way(place_m, velocity_mps, braking.late, braking.eager),
            )
        ]
        return min(float(one.min()) for one in gaps) >= MARGIN_M + NOTHING_M

    def _way(
        self, place_m: np.ndarray, velocity_mps: np.ndarray, braking: Braking, gains: Braking
    ) -> np.ndarray:
        """[n, 3] places of a vehicle that comes to the wish by one, and to a stop by the other."""
        times, velocity, place, way = 0.02, velocity_mps.copy(), place_m.copy(), [place_m]
        for step in range(1000):
            begun_s = step * times
            wished = begun_s < HOLD_S + braking.late_s
            change = (self.wish if wished else np.zeros(3)) - velocity
            most = (gains if wished else braking).acceleration_mps2 * times
            most *= begun_s >= gains.late_s
            velocity = velocity + change * min(1.0, most / max(np.linalg.norm(change), 1e-12))
            place = place + times * velocity
            way.append(place)
            if not wished and not velocity.any():
                break
        return np.array(way)


def _guarded(
    seed: int, speed_mps: float, *, height_m: float = HEIGHT_M, margin_m: float = MARGIN_M,
    sees: bool = True,
) -> tuple[MissionFile, FlightSetup]:  # fmt: skip
    """A copter that states its inertia, or one that does not."""
    kind = ("multirotor", "inertialess")[seed % 2]
    lidar: list[dict[str, Any]] = [{"max_range_m": RANGE_M}] if sees else []
    return mission(
        mission={"name": "g", "waypoints_m": [[200, 0, height_m]], "reach_radius_m": 2},
        vehicle={"kind": kind, "position_m": [0, 0, height_m], "speed_mps": speed_mps},
        grid={"range_m": RANGE_M, "layers": 10},
        safety={"margin_m": margin_m, "smallest_object_m": 3.0},
        lidar=lidar,
    )


def _habits(rng: np.random.Generator) -> Habits:
    return Habits(
        tilt_s=float(rng.uniform(0.1, 0.2)), acceleration_mps2=float(rng.uniform(3.5, 5.0))
    )


def _masts(rng: np.random.Generator) -> ObstacleMap:
    """Four masts and a wall, none near the start."""
    found: list[Obstacle] = []
    while len(found) < 4:
        x, y = rng.uniform(-25.0, 25.0, 2)
        if math.hypot(x, y) > 8.0:
            found.append(Obstacle.line_between([x, y, 0.0], [x, y, 20.0], radius_m=1.5))
    away = float(rng.uniform(10.0, 20.0))
    return ObstacleMap([*found, Obstacle.cuboid([0.0, away, 10.0], (20.0, 2.0, 20.0))])


def _outcome(flight: GuardedCopter, asked_m: float = MARGIN_M, **counts: int) -> Outcome:
    near_m = min(flight.autopilot.nearest_obstacle_m, flight.autopilot.nearest_intruder_m)
    return Outcome(float(near_m), asked_m, dict(flight.session.core.tally), **counts)
