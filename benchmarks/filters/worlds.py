"""The worlds that filters are judged in, and the copter that flies there."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, prepare
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import World
from clearway.sim.world_parts import MadeWorld, leg
from clearway.sim.worlds import make_world
from clearway.studies.campaigns.difficulty import LevelGrid

EMPTY = "empty"
SMALLEST_M: Mapping[str, float] = MappingProxyType(
    {
        EMPTY: 0.5,
        "forest": 0.4,
        "cylinders-medium": 2.0,
        "walls": 0.5,
        "street": 0.2,
        "dead-end": 0.5,
    }
)
"""Kinds of world by name, and the thickness of the thinnest thing there, which is declared."""
EMPTY_M = 60.0
REACHED_M = 2.0
MOST_GOALS = 2
"""Of a mission, the last of which is the goal: no flight takes longer than half a minute."""
SPEED_MPS, ACCELERATION_MPS2, BODY_M, MARGIN_M = 5.0, 3.0, 0.2, 0.6
ROOMS_M = (1.6, 1.3, 1.0)
"""The way that pilots know keeps so far from everything: the farthest with which there is one."""


class Course(NamedTuple):
    """A world, and a mission through it."""

    name: str
    seed: int
    world: World
    start_m: FloatArray
    """[3]"""
    goal_m: FloatArray
    """[3] at the height of the start."""
    way_m: FloatArray
    """[n, 3] a level way from start to goal; both ends alone where there is none."""


def make_course(name: str, seed: int) -> Course:
    """Return the course of a kind of world and a seed."""
    made = _empty() if name == EMPTY else make_world(name, seed)
    start = made.mission.start.position_m
    goals = made.mission.waypoints_m[:MOST_GOALS]
    goal = np.array([*goals[-1, :2], start[2]])
    tried = (LevelGrid(made.world, start, goal, room, None).shortest_way() for room in ROOMS_M)
    way = next((each for each in tried if each is not None), None)
    corners = np.array([start[:2], goal[:2]]) if way is None else way
    level = np.column_stack([corners, np.full(len(corners), start[2])])
    return Course(name, seed, made.world, start, goal, level)


def _empty() -> MadeWorld:
    return MadeWorld(ObstacleMap(), leg(EMPTY, (0.0, 0.0, 0.0), (EMPTY_M, 0.0, 0.0)))


def set_up(course: Course) -> FlightSetup:
    """Return the copter, its LiDAR and its planner, at the start of a course."""
    ahead = course.goal_m - course.start_m
    yaw_deg = float(np.degrees(np.arctan2(ahead[1], ahead[0])))
    tables = {
        "mission": {
            "name": course.name,
            "waypoints_m": [course.goal_m.tolist()],
            "reach_radius_m": REACHED_M,
        },
        "vehicle": {
            "kind": "multirotor",
            "position_m": course.start_m.tolist(),
            "attitude_deg": [0.0, 0.0, yaw_deg],
            "speed_mps": SPEED_MPS,
            "acceleration_mps2": ACCELERATION_MPS2,
            "body_radius_m": BODY_M,
        },
        "grid": {"range_m": 20.0},
        "safety": {"margin_m": MARGIN_M, "smallest_object_m": SMALLEST_M[course.name]},
        "lidar": [
            {"field_deg": [360, 30], "spacing_deg": 1.0, "max_range_m": 20.0, "sigma_m": 0.02}
        ],
    }
    return prepare(parse_model("filters", tables, MissionFile))
