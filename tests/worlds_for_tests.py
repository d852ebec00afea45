"""What several tests fly with."""

from __future__ import annotations

import numpy as np

from clearway.grid import AvoidanceGrid
from clearway.mission import Mission
from clearway.movements import MovementAutomaton
from clearway.obstacle_map import ObstacleMap
from clearway.planner import AvoidanceSettings, Planner
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.simulation import Run, SimulationSettings, simulate
from clearway.state import State
from clearway.system import AvoidanceSystem

AUTOMATON = MovementAutomaton.plane()
GRID = AvoidanceGrid.uniform()
LIBRARY = ReachLibrary.build(AUTOMATON, GRID)
LIDAR = Lidar("lidar", BeamPattern.per_cell(GRID, max_range_m=10.0), sigma_m=0.03, dropout=0.05)


def planner(**settings: object) -> Planner:
    return Planner.of(LIBRARY, AvoidanceSettings(**settings))  # type: ignore[arg-type]


def mission(*waypoints: tuple[float, float, float], radius: float = 1.5) -> Mission:
    return Mission("test", State(np.zeros(3)), np.array(waypoints, dtype=float), radius)


def flown(
    world: ObstacleMap,
    to_fly: Mission,
    obstacle_map: ObstacleMap | None = None,
    lidars: tuple[Lidar, ...] = (LIDAR,),
    settings: dict[str, object] | None = None,
    **simulation: object,
) -> Run:
    system = AvoidanceSystem(planner(**(settings or {})), to_fly, lidars, obstacle_map)
    return simulate(system, world, lidars, SimulationSettings(**simulation))  # type: ignore[arg-type]
