"""Range views: their pyramids, what they hide, and which of them are kept."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, simulate_scan
from clearway.sensors.observed.free_space import KEYFRAMES, FreeSpace
from clearway.sensors.observed.range_views import (
    LEVELS,
    entries_along,
    pyramid_size,
    raise_pyramid,
)
from clearway.sensors.observed.seen_space import is_free
from clearway.sensors.range_sensor import LidarSensor

AHEAD = BeamPattern.from_angles(
    np.radians(np.arange(-45.0, 45.1, 1.0)),
    np.radians(np.arange(-30.0, 30.1, 1.0)),
    max_range_m=12.0,
)
LIDAR = Lidar("front", AHEAD)


def look(free: FreeSpace, world: ObstacleMap, at: State) -> None:
    free.take(LidarSensor(LIDAR), simulate_scan(LIDAR, world, at), at)


@pytest.mark.parametrize("seed", range(8))
def test_every_entry_of_a_pyramid_is_the_least_of_its_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(1, 90, 2).tolist()
    image = rng.integers(-500, 30_000, (rows, columns)).astype(np.int16)
    pyramid = np.zeros(pyramid_size(rows, columns), dtype=np.int16)
    pyramid[: image.size] = image.ravel()
    raise_pyramid(pyramid, rows, columns)
    at = 0
    for level in range(LEVELS):
        high, wide = entries_along(rows, level), entries_along(columns, level)
        told = pyramid[at : at + high * wide].reshape(high, wide)
        size = 1 << level
        for i in range(high):
            for j in range(wide):
                under = image[i * size : (i + 1) * size, j * size : (j + 1) * size]
                assert told[i, j] == under.min()
        at += high * wide
    assert at == len(pyramid)


@pytest.mark.parametrize("seed", range(10))
def test_what_lies_behind_something_stays_hidden(seed: int) -> None:
    """From wherever it is looked at, however often, unless from beside."""
    rng = np.random.default_rng(seed)
    plate = ObstacleMap([Obstacle.cuboid([5.0, 0.0, 0.0], (0.2, 3.0, 3.0))])
    free = FreeSpace(0.25, np.zeros(3), 0.0, reach_m=12.0)
    for time_s in range(20):
        place = rng.uniform([0.0, -0.5, -0.5], [2.0, 0.5, 0.5])
        look(free, plate, State(place, rng.uniform(-0.2, 0.2, 3), time_s=float(time_s)))
    shown = 0
    for place in rng.uniform([5.0, -0.9, -0.9], [9.0, 0.9, 0.9], (500, 3)).tolist():
        assert not is_free(free.seen, *place, 0.1)
    for place in rng.uniform([3.0, -0.7, -0.7], [4.6, 0.7, 0.7], (500, 3)).tolist():
        shown += is_free(free.seen, *place, 0.1)
    assert shown > 450


def test_the_place_where_it_hovers_and_turns_stays_seen() -> None:
    """By keyframes from where it came, which no later view takes the place of."""
    free, empty = FreeSpace(0.25, np.zeros(3), 0.0, reach_m=12.0), ObstacleMap()
    for at in range(20):
        look(free, empty, State(np.array([0.3 * at, 0.0, 0.0]), time_s=float(at)))
    here = np.array([5.7, 0.0, 0.0])
    for turn in range(300):
        look(free, empty, State(here, np.array([0.0, 0.0, 0.1 * turn]), time_s=20.0 + turn))
        assert is_free(free.seen, *here, 0.4)
    assert len(free.seen.views.asked) <= KEYFRAMES + 1


def test_views_are_bounded_and_the_farthest_makes_room() -> None:
    free, empty = FreeSpace(0.25, np.zeros(3), 0.0, reach_m=12.0), ObstacleMap()
    for at in range(200):
        look(free, empty, State(np.array([float(at), 0.0, 0.0]), time_s=float(at)))
    views = free.seen.views
    assert len(views.asked) == KEYFRAMES
    assert views.pose[views.asked, 9].min() == 200.0 - KEYFRAMES
    assert views.pixels.nbytes < 20e6
    free.forget()
    assert not is_free(free.seen, 203.0, 0.0, 0.0, 0.1)


@pytest.mark.parametrize("seed", range(20))
def test_no_gap_is_left_between_the_start_ball_and_the_field_of_view(seed: int) -> None:
    """A ball of r / sin(half the field) leaves none: at any place, heading, and distance ahead."""
    rng = np.random.default_rng(seed)
    body_m, edge_deg = float(rng.uniform(0.1, 0.6)), 28.0
    start_m, yaw = rng.uniform(-100.0, 100.0, 3), float(rng.uniform(-np.pi, np.pi))
    ball_m = body_m / np.sin(np.radians(edge_deg))
    free = FreeSpace(0.25, start_m, ball_m, reach_m=12.0)
    look(free, ObstacleMap(), State(start_m, np.array([0.0, 0.0, yaw])))
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    for away_m in np.linspace(0.0, 8.0, 200):
        assert is_free(free.seen, *(start_m + away_m * ahead), body_m), away_m
    less = FreeSpace(0.25, start_m, 0.7 * ball_m, reach_m=12.0)
    look(less, ObstacleMap(), State(start_m, np.array([0.0, 0.0, yaw])))
    along = [
        is_free(less.seen, *(start_m + away_m * ahead), body_m)
        for away_m in np.linspace(0.0, 8.0, 200)
    ]
    assert not all(along)
