"""Maps that are declared complete: what counts as free there, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.preflight.escape_plan import escape_plan
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, simulate_scan
from clearway.sensors.observed.seen_space import is_free
from clearway.sim import simulate
from worlds_for_tests import GRID, LIDAR, mission, planner

FAR = mission((40.0, 0.0, 0.0))
BOX = np.array([[-30.0, -8.0, -20.0], [20.0, 30.0, 20.0]])
EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])
SHORT = Lidar("lidar", BeamPattern.per_cell(GRID, max_range_m=5.0), sigma_m=0.03)


def seen_by(obstacle_map: ObstacleMap, sensors=(LIDAR,), escape: str = "mapped"):
    system = AvoidanceSystem(planner(escape=escape), FAR, lidars=sensors, obstacle_map=obstacle_map)
    system.update(State(np.zeros(3)))
    for sensor in sensors:
        system.update(simulate_scan(sensor, obstacle_map, State(np.zeros(3))))
    return system.situation(0.0)[0].seen


def free(seen, *place: float) -> bool:
    return bool(is_free(seen, *place, 0.1))


@pytest.mark.parametrize("sensors", [(LIDAR,), ()])
def test_unseen_places_count_as_free_inside_the_declared_box_alone(sensors) -> None:
    seen = seen_by(ObstacleMap(complete_m=BOX), sensors)
    assert free(seen, -25.0, 0.0, 0.0), "behind, where nobody looks"
    assert free(seen, 15.0, 25.0, 10.0), "out of range"
    assert not free(seen, 15.0, -9.0, 10.0), "beside the box"
    assert not free(seen, 25.0, 0.0, 0.0), "beyond it"
    assert not free(seen, 19.95, 0.0, 0.0), "the body would reach out of it"


def test_strict_and_maps_that_declare_nothing_count_nothing_unseen_as_free() -> None:
    assert not free(seen_by(ObstacleMap(complete_m=BOX), escape="strict"), -25.0, 0.0, 0.0)
    assert not free(seen_by(ObstacleMap()), -25.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("complete", "sensors", "flown", "said"),
    [
        (None, (LIDAR,), "strict", "no map is declared complete; every decision"),
        (None, (SHORT,), "known", "no map is declared complete; no escape of a body"),
        (BOX, (LIDAR,), "mapped", "from (-30, -8, -20) to (20, 30, 20) m"),
        (BOX, (SHORT,), "mapped", "sensors of 5 m range see"),
        (BOX, (), "mapped", "no range sensor"),
        (EVERYWHERE, (), "mapped", "what neither it nor a sensor shows to stand is free"),
    ],
)
def test_what_is_flown_is_said_before_take_off(complete, sensors, flown: str, said: str) -> None:
    plan = escape_plan(planner(escape="mapped"), sensors, ObstacleMap(complete_m=complete))
    assert (plan.asked, plan.flown) == ("mapped", flown)
    assert said in plan.why


def test_no_decision_is_without_a_way_out_where_the_map_shows_all_and_sensors_see_little() -> None:
    trees = [Obstacle.ball([12.0 + 9.0 * n, 2.0 * (-1) ** n, 0.0], 2.0) for n in range(3)]
    told = ObstacleMap(trees, complete_m=[[-60.0] * 3, [90.0] * 3])
    system = AvoidanceSystem(planner(escape="mapped"), FAR, lidars=(SHORT,), obstacle_map=told)
    run = simulate(system, ObstacleMap(trees), lidars=(SHORT,))
    assert run.safe
    assert run.summary()["escape_mode"] == "mapped"
    assert run.summary()["way_out_from_s"] == 0.0
    assert run.summary()["decisions_without_escape"] == 0


@pytest.mark.parametrize("escape", ["mapped", "strict", "known"])
def test_the_body_is_kept_clear_where_a_smaller_margin_is_asked_for(escape: str) -> None:
    trees = [Obstacle.ball([10.0, 0.3, 0.0], 2.0)]
    told = ObstacleMap(trees, complete_m=EVERYWHERE)
    settings = {"escape": escape, "safety_margin_m": 0.05, "body_radius_m": 0.2}
    there = mission((20.0, 0.0, 0.0))
    system = AvoidanceSystem(planner(**settings), there, lidars=(LIDAR,), obstacle_map=told)
    run = simulate(system, ObstacleMap(trees), lidars=(LIDAR,))
    assert system.escape.flown == escape
    assert system.planner.settings.safety_margin_m == 0.2
    assert run.reached
    assert run.metrics.min_obstacle_distance_m >= 0.2


def test_where_the_declared_box_ends_the_vehicle_turns_round() -> None:
    told = ObstacleMap(complete_m=[[-30.0] * 3, [25.0, 30.0, 30.0]])
    system = AvoidanceSystem(planner(escape="mapped"), FAR, lidars=(), obstacle_map=told)
    run = simulate(system, ObstacleMap(), lidars=())
    assert not run.reached
    assert run.states[:, 0].max() <= 25.0 - system.planner.settings.body_radius_m
    assert run.summary()["decisions_without_escape"] == 0


@pytest.mark.parametrize("box", [[[0, 0, 0], [1, 1, 0]], [[0, 0], [1, 1]], [0.0, 1.0]])
def test_corners_that_bound_no_box_are_refused(box) -> None:
    with pytest.raises(ClearwayError, match="complete_m"):
        ObstacleMap(complete_m=box)


MISSION = """
[mission]
name = "told"
waypoints_m = [[30.0, 0.0, 0.0]]
[safety]
escape = "mapped"
[map]
complete = {complete}
[[obstacle]]
shape = "ball"
position_m = [15.0, 0.0, 0.0]
radius_m = 1.0
known = "both"
"""


@pytest.mark.parametrize(
    ("complete", "box"), [("true", EVERYWHERE), ("[[-9, -9, -9], [40, 9, 9.5]]", None)]
)
def test_a_mission_file_declares_where_its_map_is_complete(tmp_path, complete, box) -> None:
    path = tmp_path / "told.toml"
    path.write_text(MISSION.format(complete=complete))
    setup = prepare(read_mission_file(str(path)))
    expected = np.array([[-9, -9, -9], [40, 9, 9.5]]) if box is None else box
    np.testing.assert_array_equal(setup.obstacle_map.complete_m, expected)
    assert len(setup.obstacle_map) == 1
    assert setup.escape.flown == "mapped"


@pytest.mark.parametrize(
    ("complete", "said"),
    [("false", "at least one is needed, or complete"), ("[[0, 0, 0], [1, 0, 1]]", "of a box")],
)
def test_and_is_refused_where_it_declares_nothing(tmp_path, complete: str, said: str) -> None:
    path = tmp_path / "told.toml"
    path.write_text(MISSION.format(complete=complete))
    with pytest.raises(InputError, match=said):
        read_mission_file(str(path))
