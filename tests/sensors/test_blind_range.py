"""What stands nearer than a sensor hears gives no return: nothing behind it is taken for free."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.preflight.escape_plan import escape_plan
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, simulate_scan
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.seen_space import is_free
from clearway.sensors.range_sensor import LidarSensor
from worlds_for_tests import GRID, mission, planner

VOXEL_M, BLIND_M = 0.2, 1.0
PATTERN = BeamPattern.from_angles(
    np.radians(np.arange(-180.0, 180.0, 3.0)),
    np.radians(np.arange(-60.0, 61.0, 3.0)),
    min_range_m=BLIND_M,
    max_range_m=8.0,
)
BLIND = Lidar("blind", PATTERN, dark_range_m=8.0)


def seen(places_m: np.ndarray, world: ObstacleMap, start_free_m: float = 1.5) -> FreeSpace:
    free = FreeSpace(VOXEL_M, places_m[0], start_free_m, reach_m=8.0)
    for at, place in enumerate(places_m):
        state = State(place, time_s=float(at))
        free.take(LidarSensor(BLIND), simulate_scan(BLIND, world, state), state)
    return free


def marked(free: FreeSpace, places_m: np.ndarray) -> np.ndarray:
    space = free.seen
    return np.array([is_free(space, *place, 0.0) for place in places_m])


def test_nothing_is_free_behind_what_stands_within_the_blind_range() -> None:
    """A plate appears at 0.6 m, all of it within the blind range of the middle beams."""
    plate = ObstacleMap([Obstacle.cuboid([0.6, 0.0, 0.0], (0.1, 1.2, 1.2))])
    behind = np.array([[x, 0.0, 0.0] for x in (1.2, 2.0, 4.0, 6.0)])
    beside = np.array([[-2.0, 3.0, 0.0]])
    free = seen(np.zeros((1, 3)), plate, start_free_m=0.4)
    assert not marked(free, behind).any()
    assert not marked(free, beside).any(), "nor where nobody knows what stands near"
    assert marked(seen(np.zeros((1, 3)), ObstacleMap()), np.vstack([behind, beside])).all()


def test_who_comes_from_far_sees_on() -> None:
    """What was seen before is known to be free where it is too near to be heard."""
    way = np.array([[0.5 * at, 0.0, 0.0] for at in range(9)])
    assert marked(seen(way, ObstacleMap()), np.array([[9.0, 0.0, 0.0], [4.0, 5.0, 0.0]])).all()


@pytest.mark.parametrize("seed", range(6))
def test_what_stands_is_never_free_on_a_way_among_balls(seed: int) -> None:
    """Flown so near that most of them come within the blind range."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform([0.0, -3.0, -1.5], [8.0, 3.0, 1.5], (14, 3))
    radius = rng.uniform(0.3, 0.9, 14)
    way = np.array([[0.25 * at, 0.0, 0.0] for at in range(33)])
    away = np.linalg.norm(way[:, None] - middle, axis=2) - radius
    beside = (away.min(axis=0) > 0.15) & (np.linalg.norm(middle, axis=1) - radius > 1.5)
    assert np.any(away[:, beside] < BLIND_M)
    balls = [Obstacle.ball(*one) for one in zip(middle[beside], radius[beside], strict=True)]
    free = seen(way, ObstacleMap(balls))
    inside = rng.normal(size=(200, 3))
    inside *= (rng.random(200) ** (1.0 / 3.0) / np.linalg.norm(inside, axis=1))[:, None]
    for place, width in zip(middle[beside], radius[beside], strict=True):
        # A voxel counts by its middle: one at the surface may reach over it.
        assert not marked(free, place + (width - VOXEL_M) * inside).any()


def test_after_all_was_forgotten_it_sees_again() -> None:
    free = seen(np.zeros((1, 3)), ObstacleMap())
    free.forget()
    ahead = np.array([[5.0, 0.0, 0.0]])
    assert not marked(free, ahead).any()
    state = State(np.array([0.5, 0.0, 0.0]), time_s=1.0)
    free.take(LidarSensor(BLIND), simulate_scan(BLIND, ObstacleMap(), state), state)
    assert marked(free, ahead).all()


@pytest.mark.parametrize(
    ("blind_m", "start_free_m", "flown", "said"),
    [
        (0.5, None, "strict", "every decision keeps an escape"),
        (1.5, None, "strict", "sensors are blind near: 1.75 m around the start count as free"),
        (1.5, 1.0, "known", "sensors are blind near the start; start_free_m = 1.75 would do"),
        (6.0, None, "known", "no escape of a body"),
    ],
)
def test_before_take_off_it_is_said(
    blind_m: float, start_free_m: float | None, flown: str, said: str
) -> None:
    pattern = BeamPattern.per_cell(GRID, max_range_m=10.0, min_range_m=blind_m)
    plan = escape_plan(planner(start_free_m=start_free_m), (Lidar("blind", pattern),))
    assert plan.flown == flown
    assert said in plan.why
    system = AvoidanceSystem(
        planner(start_free_m=start_free_m),
        mission((30.0, 0.0, 0.0)),
        lidars=(Lidar("blind", pattern),),
    )
    assert system.escape.flown == flown
