"""clearway: detect and avoid for unmanned aircraft.

The names below are the promise of the library. They are imported when first used, so that the
command line answers at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from clearway.base.version import __version__

if TYPE_CHECKING:
    from clearway.avoidance.costs import Prices
    from clearway.avoidance.decide import Decision, decide
    from clearway.avoidance.planner import AvoidanceSettings, Planner
    from clearway.avoidance.situation import Situation
    from clearway.base.errors import ClearwayError
    from clearway.base.grid import AvoidanceGrid
    from clearway.base.state import State
    from clearway.live import AvoidanceSystem
    from clearway.live.mission import Mission
    from clearway.obstacles.obstacle import Obstacle
    from clearway.obstacles.obstacle_map import ObstacleMap
    from clearway.obstacles.point_world import PointWorld
    from clearway.reach import ReachLibrary, ReachSet, build_reach_set
    from clearway.sensors import BeamPattern, Lidar, Scan
    from clearway.sim import SimulationSettings, simulate
    from clearway.traffic import Intruder
    from clearway.vehicle.automaton import MovementAutomaton


__all__ = [
    "AvoidanceGrid",
    "AvoidanceSettings",
    "AvoidanceSystem",
    "BeamPattern",
    "ClearwayError",
    "Decision",
    "Intruder",
    "Lidar",
    "Mission",
    "MovementAutomaton",
    "Obstacle",
    "ObstacleMap",
    "Planner",
    "PointWorld",
    "Prices",
    "ReachLibrary",
    "ReachSet",
    "Scan",
    "SimulationSettings",
    "Situation",
    "State",
    "__version__",
    "build_reach_set",
    "decide",
    "simulate",
]

_ROOM_OF = {
    "AvoidanceGrid": "base.grid",
    "AvoidanceSettings": "avoidance.planner",
    "AvoidanceSystem": "live",
    "BeamPattern": "sensors",
    "ClearwayError": "base.errors",
    "Decision": "avoidance.decide",
    "Intruder": "traffic",
    "Lidar": "sensors",
    "Mission": "live.mission",
    "MovementAutomaton": "vehicle.automaton",
    "Obstacle": "obstacles.obstacle",
    "ObstacleMap": "obstacles.obstacle_map",
    "Planner": "avoidance.planner",
    "PointWorld": "obstacles.point_world",
    "Prices": "avoidance.costs",
    "ReachLibrary": "reach",
    "ReachSet": "reach",
    "Scan": "sensors",
    "SimulationSettings": "sim",
    "Situation": "avoidance.situation",
    "State": "base.state",
    "build_reach_set": "reach",
    "decide": "avoidance.decide",
    "simulate": "sim",
}


def __getattr__(name: str) -> object:
    if name not in _ROOM_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"clearway.{_ROOM_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
