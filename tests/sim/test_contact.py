"""A flight tells what it hit, and whether what it promises held: before, after, and for whom."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.point_world import PointWorld
from clearway.obstacles.world import CombinedWorld
from clearway.sim.contact import what_stands
from clearway.sim.pilot import Steering
from clearway.sim.run import Run
from worlds_for_tests import STATIC, flown, static_world

BALL = {"shape": "ball", "position_m": [6.0, 0.0, 0.0], "radius_m": 1.0}
HEAD_ON = {
    "position_m": [20.0, 0.0, 0.0],
    "velocity_mps": [-1.0, 0.0, 0.0],
    "appears_s": 0.0,
    "name": "glider",
}


def straight_on(**tables: object) -> Run[Steering]:
    mission = {"name": "into", "waypoints_m": [[20.0, 0.0, 0.0]]}
    return prepare(MissionFile.model_validate({"mission": mission, **tables})).fly_with("straight")


@pytest.mark.parametrize(
    ("tables", "hit"),
    [
        ({"obstacle": [BALL | {"name": "silo"}]}, "obstacle 0 'silo' (ball)"),
        ({"obstacle": [BALL | {"position_m": [6.0, 9.0, 0.0]}, BALL]}, "obstacle 1 (ball)"),
        ({"intruder": [HEAD_ON | {"radius_m": 0.5}]}, "intruder 'glider'"),
        ({}, None),
    ],
)
def test_it_is_told_by_name(tables: dict[str, object], hit: str | None) -> None:
    told = straight_on(**tables).summary()
    assert told["crashed"] == hit
    assert (told["crashed_s"] is None) == (hit is None)


def test_of_worlds_in_one_it_is_what_stands_where_it_was_hit() -> None:
    far = ObstacleMap([Obstacle.ball([50.0, 0.0, 0.0], 1.0)])
    points = PointWorld(np.array([[6.0, 0.0, 0.0]]), point_radius_m=1.0)
    assert (
        what_stands(CombinedWorld([far, points]), np.array([5.0, 0.0, 0.0])) == "a surveyed point"
    )
    assert what_stands(points, np.zeros(3)) == "a surveyed point"
    assert what_stands(None, np.zeros(3)) == "an obstacle"


@pytest.mark.parametrize(("escape", "guaranteed"), [("strict", True), ("known", False)])
def test_a_guarantee_is_told_only_where_it_held(escape: str, guaranteed: bool) -> None:
    told = flown(static_world(), STATIC, settings={"escape": escape}, time_limit_s=20.0).summary()
    assert told["escape_mode"] == escape
    assert told["decisions_without_escape"] == 0
    assert told["guarantee"] is guaranteed
