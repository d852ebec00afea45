"""What was seen to be free, as own states and returns come: when it is taken back."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import simulate_scan
from clearway.sensors.observed.free_voxels import (
    NO_BOX,
    are_voxels_free,
    is_voxel_marked,
    pack_voxels,
)
from clearway.sensors.observed.range_views import NO_VIEWS
from clearway.sensors.observed.seen_space import SeenSpace, is_free, is_place_free
from worlds_for_tests import LIDAR, mission, planner

FAR = mission((40.0, 0.0, 0.0))
PLANNER = planner()
COUNT = "state: the own position jumped; observed free space is forgotten"


def after_one_decision(world=None) -> AvoidanceSystem:
    system = AvoidanceSystem(PLANNER, FAR, lidars=(LIDAR,))
    here = State(np.zeros(3))
    system.update(here)
    system.update(simulate_scan(LIDAR, world or ObstacleMap([]), here))
    system.decide(0.0)
    return system


def sees_free(system: AvoidanceSystem, place, time_s: float) -> bool:
    seen = system.situation(time_s)[0].seen
    assert seen is not None
    return bool(is_free(seen, *place, 0.1))


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


@pytest.mark.parametrize(
    ("place_m", "kept"),
    [((0.0, 0.0, 0.0), True), ((0.0, 1.0, 0.0), True), ((-1.5, 0.5, 0.0), True),
     ((0.0, 1.7, 0.0), False)],
)  # fmt: skip
def test_where_others_fly_only_what_nobody_can_fly_is_a_jump(
    place_m: tuple[float, float, float], kept: bool
) -> None:
    system = after_one_decision()
    system.followed = False
    system.update(State(np.array(place_m), time_s=1.0))  # It does 1 m/s, and the margin is 0.6 m.
    system.situation(1.0)
    assert system.counts[COUNT] == (not kept)


def test_what_ways_are_looked_for_in_is_taken_in_between_decisions_where_it_is_soon_due() -> None:
    """A full circle takes 24 s; without it, a decision takes it in after half of that."""
    kept, left = after_one_decision(), after_one_decision()
    began_s = kept.progress.planned_s
    for system in (kept, left):
        for now in range(1, 14):
            system.update(State(np.array([1.0 * now, 0.0, 0.0]), time_s=1.0 * now))
            system.catch_up(1.0 * now)
            if system is kept and now in (9, 11):
                system.keep_up(1.0 * now)
                assert system.progress.planned_s == (began_s if now == 9 else 11.0)
    for system, planned_s in ((kept, 11.0), (left, 13.0)):
        system.decide(13.0)
        assert system.progress.planned_s == planned_s


def test_what_is_declared_free_ends_at_what_is_seen_to_stand_there() -> None:
    free = after_one_decision()
    assert sees_free(free, (-0.6, 0.0, 0.0), 0.0), "behind the start nobody looks"
    ball = ObstacleMap([Obstacle.ball([0.9, 0.0, 0.0], 0.4)])
    assert not sees_free(after_one_decision(ball), (-0.6, 0.0, 0.0), 0.0)


def test_a_place_is_free_where_a_ball_without_radius_is() -> None:
    rng = np.random.default_rng(3)
    free = pack_voxels(rng.random((64, 64, 64)) < 0.5)
    boxes = (NO_BOX.ravel(), np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 1.5]))
    for declared_m, box in product((0.0, 2.0), boxes):
        window = np.concatenate([[-30.0, -31.0, -17.0, 4.0, 1.0, 1.5, 0.5, declared_m], box])
        for place in rng.uniform(-9.0, 9.0, (500, 3)):
            x, y, z = place.tolist()
            seen = SeenSpace(free, window, NO_VIEWS, free)
            assert is_place_free(seen, x, y, z) == is_free(seen, x, y, z, 0.0)


def test_a_ball_is_free_where_all_voxels_that_it_meets_are() -> None:
    """Balls of all sizes, across words and across the window's seam, with one voxel unseen."""
    rng = np.random.default_rng(4)
    window = np.concatenate([[-30.0, -31.0, -100.0, 4.0, 0.0, 0.0, 0.0, 0.0], NO_BOX.ravel()])
    told = []
    for _ in range(300):
        radius = float(rng.uniform(0.0, 2.0))
        middle = rng.uniform([-5.0, -5.0, -22.0], [5.5, 5.5, 4.0])
        hole = np.floor((middle + rng.normal(size=3) * radius) * 4.0).astype(np.int64)
        hole = np.clip(hole, [-30, -31, -100], [33, 32, 27])
        voxels = np.ones((64, 64, 128), dtype=np.bool_)
        voxels[tuple(hole % [64, 64, 128])] = False
        free = pack_voxels(voxels)
        nearest = np.clip(middle, hole / 4.0, (hole + 1) / 4.0)
        meets = bool(np.linalg.norm(nearest - middle) <= radius)
        assert are_voxels_free(free, window, *middle, radius) == (not meets)
        assert is_voxel_marked(free, window, *hole.tolist()) is False
        told.append(meets)
    assert 50 < sum(told) < 250
