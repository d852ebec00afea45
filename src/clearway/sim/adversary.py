"""An adversary: balls put where a vehicle means to fly and no beam of any sensor has ever been.

The world might have stood like that from the start, so whatever is claimed of static worlds has to
hold in it. Any vehicle, planner, sensor and world can be opposed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld, World
from clearway.sensors import Lidar, Scan
from clearway.sensors.beams.simulate import Scanner, scan_world, sensor_pose
from clearway.sim.settings import SimulationSettings

TRIES = 40
"""Places looked at after each decision for one that no beam has crossed."""
LARGEST = 5.0
"""Thickest ball, in least thicknesses; every second one is of the least."""
BEYOND_M = 14.0
"""How far past what is planned balls are put too, straight on."""
ASIDE_M = 2.0
"""How far beside it."""
CLOSER_M = 1e-3
"""By which a beam has to pass a ball, for rounding."""


class Beams(NamedTuple):
    """What one scan has shown to be free."""

    origin_m: FloatArray
    directions: FloatArray
    """[n, 3] unit vectors, world frame."""
    lengths_m: FloatArray
    """[n] as far as each beam came."""


class KeptClear(NamedTuple):
    """What an adversary has to leave free."""

    margin_m: float
    """About where the vehicle has been: else the margin would be lost by the ball, not the way."""
    start_m: float
    """About the start, where a ball counts as seen."""
    goal_m: float
    """About goals, so that they can be reached."""


class Adversary:
    """Puts balls into a world while a vehicle flies through it.

    thickness_m: of the thinnest ball. places_m: [n, 3] start and goals.
    """

    def __init__(
        self,
        world: World,
        thickness_m: float,
        places_m: FloatArray,
        kept: KeptClear,
        rng: np.random.Generator,
    ) -> None:
        self._world, self._thickness_m = world, thickness_m
        self._places_m, self._kept, self._rng = places_m, kept, rng
        self.balls: list[Obstacle] = []
        self.world: World = world
        """The world with the balls that stand by now."""
        self._beams: list[Beams] = []

    @classmethod
    def of(
        cls, world: World, settings: SimulationSettings, planner: Planner, mission: Mission
    ) -> Adversary:
        """The adversary of a flight, by its settings."""
        margin_m, start_m = planner.settings.safety_margin_m, planner.settings.start_free_m
        kept = KeptClear(
            margin_m,
            planner.automaton.step_m if start_m is None else start_m,
            mission.reach_radius_m + margin_m,
        )
        places = np.concatenate([mission.start.position_m[None], mission.goals_m])
        rng = np.random.default_rng([settings.seed, 4])
        return cls(world, settings.adversary_m, places, kept, rng)

    def watch(self, sensor: Lidar | Scanner) -> Scanner:
        """The sensor, whose beams the adversary takes note of."""
        return _Watched(sensor, self)

    def note(self, beams: Beams) -> None:
        """Take note of beams: no ball will stand where they have been."""
        self._beams.append(beams)

    def oppose(self, plans_m: Sequence[FloatArray], track_m: FloatArray) -> bool:
        """Put one ball across or beside places [n, 3] that are to be flown, if no beam was there.

        track_m: [n, 3] where the vehicle has been. Returns whether a ball was put.
        """
        rng = self._rng
        for _ in range(TRIES):
            plan = plans_m[int(rng.integers(len(plans_m)))]
            radius = 0.5 * self._thickness_m
            if rng.random() < 0.5:
                radius *= float(rng.uniform(1.0, LARGEST))
            way = rng.normal(size=3)
            way *= rng.uniform(0.0, radius + ASIDE_M * rng.random()) / np.linalg.norm(way)
            center = plan[int(rng.integers(len(plan)))] + way
            if self._may_stand(center, radius, track_m):
                number = len(self.balls)
                self.balls.append(Obstacle.ball(center, radius, name=f"adversary's ball {number}"))
                self.world = CombinedWorld([self._world, ObstacleMap(self.balls)])
                return True
        return False

    def _may_stand(self, center: FloatArray, radius: float, track_m: FloatArray) -> bool:
        kept = self._kept
        if float(np.linalg.norm(track_m - center, axis=1).min()) - radius <= kept.margin_m:
            return False
        away = np.linalg.norm(self._places_m - center, axis=1) - radius
        if away[0] <= kept.start_m or np.any(away[1:] <= kept.goal_m):
            return False
        # The latest beams first: they are where the vehicle is.
        return not any(
            crosses(center, radius + CLOSER_M, one.origin_m, one.directions, one.lengths_m)
            for one in reversed(self._beams)
        )


class _Watched:
    """A sensor whose beams an adversary takes note of."""

    def __init__(self, sensor: Lidar | Scanner, adversary: Adversary) -> None:
        self.name, self._sensor, self._adversary = sensor.name, sensor, adversary

    def scan(self, world: World, state: State, rng: np.random.Generator) -> Scan:
        noting = _Noting(world)
        scan = scan_world(self._sensor, noting, state, rng)
        sensor = self._sensor
        for origin, directions, ranges, farthest in noting.casts:
            self._adversary.note(Beams(origin, directions, np.minimum(ranges, farthest)))
        if not noting.casts and isinstance(sensor, Lidar):
            # Nothing is in range: every beam came as far as it can.
            rotation, origin = sensor_pose(sensor, state)
            directions = np.ascontiguousarray(sensor.pattern.directions @ rotation.T)
            lengths = np.full(len(directions), sensor.pattern.max_range_m)
            self._adversary.note(Beams(np.array(origin), directions, lengths))
        return scan


class _Noting:
    """A world that remembers which rays were cast into it."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.casts: list[tuple[FloatArray, FloatArray, FloatArray, float]] = []

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        return self._world.distance_m(points_m)

    def cast(self, origin_m: FloatArray, directions: FloatArray, max_range_m: float) -> FloatArray:
        ranges = self._world.cast(origin_m, directions, max_range_m)
        self.casts.append((np.array(origin_m), np.array(directions), ranges, max_range_m))
        return ranges


def list_planned_ways(flight: object, state: State) -> Iterator[FloatArray]:
    """Places [n, 3] that are to be flown: a decision's way and its escape, and straight on.

    flight: what was decided, by whichever planner; of others than clearway's, only straight on is
    known.
    """
    decision = getattr(flight, "decision", None)
    ends = state.position_m
    if isinstance(decision, Decision):
        ways = [decision.path_m]
        if decision.way_out is not None:
            ways.append(decision.way_out.path_m)
        for way in ways:
            if len(way):
                yield way
                ends = way[-1]
    yaw = float(state.attitude_rad[2])
    ahead = np.arange(0.0, BEYOND_M, 0.4)[:, None] * [np.cos(yaw), np.sin(yaw), 0.0]
    yield ends + ahead


@compiled
def crosses(
    center: Floats, radius: float, origin: Floats, directions: Floats2, lengths: Floats
) -> bool:
    """Whether a beam from an origin, of unit directions [n, 3] and lengths [n], meets a ball."""
    x, y, z = center[0] - origin[0], center[1] - origin[1], center[2] - origin[2]
    away2, radius2 = x * x + y * y + z * z, radius * radius
    for n in range(len(directions)):
        ahead = x * directions[n, 0] + y * directions[n, 1] + z * directions[n, 2]
        along = max(0.0, min(ahead, lengths[n]))
        if away2 - 2.0 * along * ahead + along * along < radius2:
            return True
    return False
