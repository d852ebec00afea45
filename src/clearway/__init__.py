"""clearway: detect and avoid for unmanned aircraft.

The names below are the promise of the library. They are imported when first used, so that the
command line answers at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from clearway.base.version import __version__

if TYPE_CHECKING:
    from clearway.avoidance.decide import decide
    from clearway.avoidance.decision import Decision
    from clearway.avoidance.plan.costs import Prices
    from clearway.avoidance.plan.planner import Planner
    from clearway.avoidance.plan.settings import AvoidanceSettings
    from clearway.avoidance.plan.situation import Situation
    from clearway.avoidance.scene import SceneAssessment
    from clearway.base.errors import ClearwayError
    from clearway.base.grid import AvoidanceGrid
    from clearway.base.state import State
    from clearway.io.maps.maps import read_map
    from clearway.io.traffic.traffic import read_traffic
    from clearway.live import AvoidanceSystem
    from clearway.live.guard.guardian import Guardian
    from clearway.live.mission import Mission
    from clearway.missions.assess import assess
    from clearway.missions.fly import fly
    from clearway.missions.mission_file import MissionFile
    from clearway.missions.recorded_scan import RecordedScan, read_scan, read_scans
    from clearway.missions.world_file import read_mission
    from clearway.obstacles.obstacle import Obstacle
    from clearway.obstacles.obstacle_map import ObstacleMap
    from clearway.obstacles.point_world import PointWorld
    from clearway.reach import ReachLibrary, ReachSet, build_reach_set
    from clearway.sensors import BeamPattern, Lidar, Scan
    from clearway.sim import Run, SimulationSettings, simulate
    from clearway.studies.figures.flight_set import draw_flight
    from clearway.traffic import Intruder
    from clearway.traffic.recorded.picture import air_picture
    from clearway.vehicle.automaton import MovementAutomaton
    from clearway.view.plot.assessment import draw_assessment


__all__ = [
    "AvoidanceGrid",
    "AvoidanceSettings",
    "AvoidanceSystem",
    "BeamPattern",
    "ClearwayError",
    "Decision",
    "Guardian",
    "Intruder",
    "Lidar",
    "Mission",
    "MissionFile",
    "MovementAutomaton",
    "Obstacle",
    "ObstacleMap",
    "Planner",
    "PointWorld",
    "Prices",
    "ReachLibrary",
    "ReachSet",
    "RecordedScan",
    "Run",
    "Scan",
    "SceneAssessment",
    "SimulationSettings",
    "Situation",
    "State",
    "__version__",
    "air_picture",
    "assess",
    "build_reach_set",
    "decide",
    "draw_assessment",
    "draw_flight",
    "fly",
    "read_map",
    "read_mission",
    "read_scan",
    "read_scans",
    "read_traffic",
    "simulate",
]

_ROOM_OF = {
    "AvoidanceGrid": "base.grid",
    "AvoidanceSettings": "avoidance.plan.settings",
    "AvoidanceSystem": "live",
    "BeamPattern": "sensors",
    "ClearwayError": "base.errors",
    "Decision": "avoidance.decision",
    "Guardian": "live.guard.guardian",
    "Intruder": "traffic",
    "Lidar": "sensors",
    "Mission": "live.mission",
    "MissionFile": "missions.mission_file",
    "MovementAutomaton": "vehicle.automaton",
    "Obstacle": "obstacles.obstacle",
    "ObstacleMap": "obstacles.obstacle_map",
    "Planner": "avoidance.plan.planner",
    "PointWorld": "obstacles.point_world",
    "Prices": "avoidance.plan.costs",
    "ReachLibrary": "reach",
    "ReachSet": "reach",
    "RecordedScan": "missions.recorded_scan",
    "Run": "sim",
    "Scan": "sensors",
    "SceneAssessment": "avoidance.scene",
    "SimulationSettings": "sim",
    "Situation": "avoidance.plan.situation",
    "State": "base.state",
    "air_picture": "traffic.recorded.picture",
    "assess": "missions.assess",
    "build_reach_set": "reach",
    "decide": "avoidance.decide",
    "draw_assessment": "view.plot.assessment",
    "draw_flight": "studies.figures.flight_set",
    "fly": "missions.fly",
    "read_map": "io.maps.maps",
    "read_mission": "missions.world_file",
    "read_scan": "missions.recorded_scan",
    "read_scans": "missions.recorded_scan",
    "read_traffic": "io.traffic.traffic",
    "simulate": "sim",
}


def __getattr__(name: str) -> object:
    if name not in _ROOM_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"clearway.{_ROOM_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
