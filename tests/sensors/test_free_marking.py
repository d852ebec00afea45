"""What a sweep notes is what each voxel, asked on its own, says: no block is passed over."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Lidar, Scan, simulate_scan
from clearway.sensors.beams.pattern import BeamPattern
from clearway.sensors.observed.free_marking import COLUMNS, ROWS, go_by, mark, nearest_about
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.free_voxels import is_marked, pack_voxels
from clearway.sensors.observed.range_views import shows_ball
from clearway.sensors.observed.seen_space import NOTHING_SEEN, is_place_free
from clearway.sensors.range_sensor import LidarSensor
from worlds_for_tests import LIDAR

VOXEL_M = 0.3


def pattern(rng: np.random.Generator, seed: int) -> BeamPattern:
    """All round, to a side, straight up or across the rear, narrow and wide."""
    wide_deg, middle_deg = rng.uniform(10.0, 178.0), rng.uniform(-60.0, 60.0)
    if seed % 4 == 0:
        wide_deg = 360.0
    if seed % 4 == 1:
        middle_deg = rng.uniform(-180.0, 180.0)
    across = np.arange(int(rng.integers(20, 90))) / 90.0 * wide_deg + middle_deg - wide_deg / 2
    up = np.linspace(*np.sort(rng.uniform(-88.0, 88.0, 2)), int(rng.integers(8, 30)))
    azimuth, elevation = np.meshgrid(np.radians((across + 180.0) % 360.0 - 180.0), np.radians(up))
    spacing = float(np.radians(max(wide_deg / 90.0, np.diff(up).max())))
    return BeamPattern(
        "p", azimuth.ravel(), elevation_rad=elevation.ravel(), spacing_rad=spacing, max_range_m=30.0
    )


def seen_in(rng: np.random.Generator, seed: int, reach_m: float) -> tuple[FreeSpace, np.ndarray]:
    """After one sweep with returns anywhere; and where the sensor was."""
    lidar = Lidar("p", pattern(rng, seed))
    state = State(rng.uniform(-2.0, 2.0, 3), rng.uniform([-0.6, -1.2, -3.0], [0.6, 1.2, 3.0]))
    free = FreeSpace(VOXEL_M, state.position_m, reach_m=reach_m)
    free.take(LidarSensor(lidar), Scan(rng.normal(size=(40, 3)) * 2.0, sensor="p"), state)
    return free, state.position_m


@pytest.mark.parametrize("seed", range(12))
def test_every_voxel_is_marked_that_says_so(seed: int) -> None:
    rng = np.random.default_rng(seed)
    reach = float(rng.uniform(2.0, 4.5))
    space, origin = seen_in(rng, seed, reach)
    views = space.seen.views
    slot = int(views.asked[0])
    about = nearest_about(views, slot)
    free = pack_voxels(np.zeros((COLUMNS, COLUMNS, ROWS), dtype=np.bool_))
    low = np.array([-COLUMNS // 2, -COLUMNS // 2, -ROWS // 2])
    mark(free, low, VOXEL_M, reach, views, slot)
    far = int(reach / VOXEL_M) + 3
    ticks = np.arange(-far, far + 1)
    steps = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    voxels, said = np.floor(origin / VOXEL_M).astype(np.int64) + steps, 0
    for voxel in voxels:
        says = go_by(views, slot, about, *((voxel + 0.5) * VOXEL_M).tolist())
        assert is_marked(free, *voxel.tolist()) == says, voxel
        said += says
    assert int(np.unpackbits(free.view(np.uint8)).sum()) == said
    assert said or seed % 4 != 0


@pytest.mark.parametrize("seed", range(12))
def test_where_a_view_shows_a_ball_as_wide_as_a_voxel_the_index_says_so(seed: int) -> None:
    """Else what is free would be passed over."""
    rng = np.random.default_rng(seed)
    space, origin = seen_in(rng, seed, 4.5)
    seen, shown = space.seen, 0
    slot, none = int(seen.views.asked[0]), NOTHING_SEEN.window
    for place in (origin + rng.uniform(-4.0, 4.0, (20_000, 3))).tolist():
        if shows_ball(seen.views, slot, none, *place, np.sqrt(0.75) * VOXEL_M):
            assert is_place_free(seen, *place)
            shown += 1
    assert shown or seed % 4 != 0


def test_behind_a_wall_nothing_is_noted_though_returns_get_lost() -> None:
    """By it routes are planned: pixels between beams, and lost returns, tell nothing of a wall."""
    wall = ObstacleMap([Obstacle.cuboid([6.5, 0.0, 0.0], (1.0, 40.0, 40.0))])
    space = FreeSpace(VOXEL_M, np.zeros(3), reach_m=10.0)
    for second in range(20):
        state = State(np.array([0.05 * second, 0.0, 0.0]), time_s=float(second))
        scan = simulate_scan(LIDAR, wall, state, seed=second)
        space.take(LidarSensor(LIDAR), scan, state)
    rng = np.random.default_rng(0)
    behind = rng.uniform([7.5, -4.0, -2.0], [9.0, 4.0, 2.0], (2000, 3))
    before = rng.uniform([3.0, -1.5, -1.0], [5.0, 1.5, 1.0], (2000, 3))
    assert np.mean([is_place_free(space.seen, *place) for place in behind.tolist()]) < 0.01
    assert np.mean([is_place_free(space.seen, *place) for place in before.tolist()]) > 0.95
