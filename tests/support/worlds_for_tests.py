"""What several tests fly with."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.sim import Run, SimulationSettings, simulate
from clearway.vehicle.automaton import MovementAutomaton

AUTOMATON = MovementAutomaton.plane()
GRID = AvoidanceGrid.uniform()
LIBRARY = ReachLibrary.build(AUTOMATON, GRID)
LIDAR = Lidar("lidar", BeamPattern.per_cell(GRID, max_range_m=10.0), sigma_m=0.03, dropout=0.05)


def planner(**settings: object) -> Planner:
    return Planner.of(LIBRARY, AvoidanceSettings(**settings))  # type: ignore[arg-type]


def mission(*waypoints: tuple[float, float, float], radius: float = 1.5) -> Mission:
    return Mission(
        "test",
        State(np.zeros(3)),
        waypoints_m=np.array(waypoints, dtype=float),
        reach_radius_m=radius,
    )


def flown(
    world: ObstacleMap,
    to_fly: Mission,
    obstacle_map: ObstacleMap | None = None,
    lidars: tuple[Lidar, ...] = (LIDAR,),
    settings: dict[str, object] | None = None,
    **simulation: object,
) -> Run:
    system = AvoidanceSystem(
        planner(**(settings or {})), to_fly, lidars=lidars, obstacle_map=obstacle_map
    )
    return simulate(system, world, lidars=lidars, settings=SimulationSettings(**simulation))  # type: ignore[arg-type]


def static_world():
    return ObstacleMap([Obstacle.ball(p, 2.0) for p in ([10, 0, 0], [20, 10, 0], [10, 20, 0])])


STATIC = mission((0, 0, 0), (20, 0, 0), (20, 20, 0), (0, 20, 0), (0, 0, 10))

WALLS = {
    "wall": [Obstacle.cuboid([20, 0, 0], (1, 20, 16))],
    "tall wall": [Obstacle.cuboid([20, 0, 0], (1, 20, 100))],
    "wide low wall": [Obstacle.cuboid([20, 0, 0], (1, 200, 16))],
    "gap of 4 m to one side": [
        Obstacle.cuboid([20, 28, 0], (1, 40, 60)),
        Obstacle.cuboid([20, -16, 0], (1, 40, 60)),
    ],
}
