"""clearway: detect and avoid for unmanned aircraft.

The names below are the promise of the library. They are imported when first used, so that the
command line answers at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clearway.avoidance import Decision, decide
    from clearway.costs import Prices
    from clearway.errors import ClearwayError
    from clearway.grid import AvoidanceGrid
    from clearway.intruders import Intruder
    from clearway.mission import Mission
    from clearway.movements import MovementAutomaton
    from clearway.obstacle_map import ObstacleMap
    from clearway.obstacles import Obstacle
    from clearway.planner import AvoidanceSettings, Planner
    from clearway.point_world import PointWorld
    from clearway.reach import ReachLibrary, ReachSet, build_reach_set
    from clearway.sensors import BeamPattern, Lidar, Scan
    from clearway.simulation import SimulationSettings, simulate
    from clearway.situation import Situation
    from clearway.state import State
    from clearway.system import AvoidanceSystem

__version__ = "0.1.0"

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
    "AvoidanceGrid": "grid",
    "AvoidanceSettings": "planner",
    "AvoidanceSystem": "system",
    "BeamPattern": "sensors",
    "ClearwayError": "errors",
    "Decision": "avoidance",
    "Intruder": "intruders",
    "Lidar": "sensors",
    "Mission": "mission",
    "MovementAutomaton": "movements",
    "Obstacle": "obstacles",
    "ObstacleMap": "obstacle_map",
    "Planner": "planner",
    "PointWorld": "point_world",
    "Prices": "costs",
    "ReachLibrary": "reach",
    "ReachSet": "reach",
    "Scan": "sensors",
    "SimulationSettings": "simulation",
    "Situation": "situation",
    "State": "state",
    "build_reach_set": "reach",
    "decide": "avoidance",
    "simulate": "simulation",
}


def __getattr__(name: str) -> object:
    if name not in _ROOM_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"clearway.{_ROOM_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
