"""What was seen to be free, as own states and returns come: when it is taken back."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import simulate_scan
from clearway.sensors.free_space import is_free
from worlds_for_tests import LIDAR, mission, planner

FAR = mission((40.0, 0.0, 0.0))
PLANNER = planner()
COUNT = "state: the own place jumped; what was seen to be free is forgotten"


def after_one_decision(world=None) -> AvoidanceSystem:
    system = AvoidanceSystem(PLANNER, FAR, (LIDAR,))
    here = State(np.zeros(3))
    system.update(here)
    system.update(simulate_scan(LIDAR, world or ObstacleMap([]), here))
    system.decide(0.0)
    return system


def sees_free(system: AvoidanceSystem, place, time_s: float) -> bool:
    seen = system.situation(time_s)[0].seen
    assert seen is not None
    return bool(is_free(*seen, *place, 0.1))


@pytest.mark.parametrize(("off_m", "kept"), [(0.0, True), (0.5, True), (0.7, False), (30.0, False)])
def test_a_jump_beyond_the_margin_takes_back_what_was_seen(off_m: float, kept: bool) -> None:
    system = after_one_decision()
    assert sees_free(system, (5.0, 0.0, 0.0), 0.0)
    there = system.state_at(1.0)
    assert there is not None
    place_m = there.position_m + np.array([0.0, off_m, 0.0])
    system.update(State(place_m, there.attitude_rad, time_s=1.0))
    assert sees_free(system, (5.0, 0.0, 0.0), 1.0) is kept
    assert system.counts[COUNT] == (not kept)


def test_what_is_declared_free_ends_at_what_is_seen_to_stand_there() -> None:
    free = after_one_decision()
    assert sees_free(free, (-0.6, 0.0, 0.0), 0.0), "behind the start nobody looks"
    ball = ObstacleMap([Obstacle.ball([0.9, 0.0, 0.0], 0.4)])
    assert not sees_free(after_one_decision(ball), (-0.6, 0.0, 0.0), 0.0)
