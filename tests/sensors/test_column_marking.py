"""Free space above and below a level plane: no column that beams would have met stands in it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.sensors import BeamPattern, Lidar, Mounting, Scan
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.seen_space import is_free
from clearway.sensors.range_sensor import LidarSensor

VOXEL_M, REACH_M = 0.25, 8.0
LOW_M, HIGH_M = -2.0, 3.0
Array = npt.NDArray[np.float64]
SEEDS = [*range(6), *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(6, 12))]


def ring(span_deg: float = 360.0, up_deg: float = 0.0, mounting: Mounting | None = None) -> Lidar:
    azimuth = np.radians(np.arange(-0.5 * span_deg + 0.5, 0.5 * span_deg, 1.0))
    pattern = BeamPattern.from_angles(azimuth, [np.radians(up_deg)], max_range_m=REACH_M)
    return Lidar("ring", pattern, mounting=mounting or Mounting())


def columns(rng: np.random.Generator, count: int = 12) -> Array:
    """[n, 3] x, y and radius of columns from LOW_M to HIGH_M that leave the middle free."""
    found: list[Array] = []
    while len(found) < count:
        x, y, radius = rng.uniform([-7.0, -7.0, 0.15], [7.0, 7.0, 1.0])
        if np.hypot(x, y) > radius + 1.0:
            found.append(np.array([x, y, radius]))
    return np.array(found)


def swept(world: Array, origin: Array, directions: Array) -> Array:
    """[n] range of the first column that each beam [n, 3] meets; inf without any."""
    nearest = np.full(len(directions), np.inf)
    for x, y, radius in world:
        to, flat = np.array([x, y]) - origin[:2], directions[:, :2]
        a, b = (flat**2).sum(axis=1), flat @ to
        root = b**2 - a * (to @ to - radius**2)
        hit = np.where(root >= 0.0, (b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)
        height = origin[2] + hit * directions[:, 2]
        meets = (hit > 0.0) & (height >= LOW_M) & (height <= HIGH_M)
        nearest = np.where(meets & (hit < nearest), hit, nearest)
    nearest[nearest > REACH_M] = np.inf
    return nearest


def marked(
    lidar: Lidar, world: Array, state: State, up_rad: Array | None = None, **scan: float
) -> Array:
    """[n, 3] middles of the voxels that a sweep shows free.

    up_rad: [beams] by how much beams of a level pattern truly point up.
    """
    free = FreeSpace(VOXEL_M, state.position_m, reach_m=REACH_M, span_m=(LOW_M, HIGH_M))
    rotation = state.world_from_body @ lidar.mounting.body_from_sensor
    origin = state.position_m + state.world_from_body @ lidar.mounting.position_m
    truly = lidar.pattern.directions
    if up_rad is not None:
        truly = np.column_stack([np.cos(up_rad)[:, None] * truly[:, :2], np.sin(up_rad)])
    away = swept(world, origin, truly @ rotation.T)
    back = np.isfinite(away)
    points = away[back, None] * lidar.pattern.directions[back]
    free.take(LidarSensor(lidar), Scan(points, 0.0, sensor="ring", **scan), state)
    seen, ticks = free.seen, np.arange(-REACH_M, REACH_M, VOXEL_M) + 0.5 * VOXEL_M
    corner = np.floor(state.position_m / VOXEL_M) * VOXEL_M
    middles = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3) + corner
    return middles[[is_free(seen, *place, 0.0) for place in middles.tolist()]]


def holds(found: Array, world: Array) -> None:
    """Nothing that is marked lies in a column, or where nothing is declared."""
    assert found[:, 2].min() >= LOW_M
    assert found[:, 2].max() <= HIGH_M
    for x, y, radius in world:
        assert np.hypot(found[:, 0] - x, found[:, 1] - y).min() >= radius


@pytest.mark.parametrize("seed", SEEDS)
def test_no_column_stands_where_a_sweep_shows_free_space(seed: int) -> None:
    """Whatever the attitude, the mounting and the field of view."""
    rng = np.random.default_rng(seed)
    attitude = rng.uniform([-0.3, -0.3, -3.1], [0.3, 0.3, 3.1])
    turned = np.array([np.pi if seed % 4 == 1 else 0.0, 0.0, rng.uniform(-3.0, 3.0)])
    mounting = Mounting(rng.uniform(-0.3, 0.3, 3), turned)
    lidar = ring(360.0 if seed % 2 else 150.0, float(rng.choice([-8.0, 0.0, 0.0, 8.0])), mounting)
    state = State(rng.uniform([-0.4, -0.4, LOW_M], [0.4, 0.4, HIGH_M]), attitude)
    world = columns(rng)
    found = marked(lidar, world, state)
    assert len(found) > 500
    holds(found, world)


@pytest.mark.parametrize("seed", SEEDS)
def test_nor_where_its_beams_point_up_and_down_by_as_much_as_is_stated(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    tilt = float(rng.uniform(0.02, 0.4))
    lidar = ring()
    up_rad = tilt * np.cos(lidar.pattern.azimuth_rad - rng.uniform(-np.pi, np.pi))
    state = State(np.append(rng.uniform(-0.4, 0.4, 2), rng.uniform(LOW_M, HIGH_M)))
    world = columns(rng)
    found = marked(lidar, world, state, up_rad, tilt_rad=tilt)
    if len(found):
        holds(found, world)
    off_m = 0.5 * np.tan(tilt) * REACH_M
    if LOW_M + off_m < state.position_m[2] < HIGH_M - off_m:
        assert len(found) > 500


def test_an_empty_plane_is_free_at_all_heights_that_are_declared() -> None:
    state = State(np.array([0.1, 0.1, 0.4]))
    found = marked(ring(), np.zeros((0, 3)), state)
    level = np.hypot(found[:, 0] - 0.1, found[:, 1] - 0.1)
    inside = np.pi * (REACH_M - VOXEL_M) ** 2 * (HIGH_M - LOW_M) / VOXEL_M**3
    assert len(found) > 0.95 * inside
    assert level.max() <= REACH_M


def test_the_higher_and_lower_it_may_have_looked_the_less_far_it_shows() -> None:
    state, nothing = State(np.zeros(3)), np.zeros((0, 3))
    for tilt in (0.3, 0.6, 1.2):
        found = marked(ring(), nothing, state, tilt_rad=tilt)
        farthest_m = np.hypot(found[:, 0], found[:, 1]).max()
        assert farthest_m <= 2.0 / np.tan(tilt)
        assert farthest_m >= 2.0 / np.tan(tilt) - 2.0 * VOXEL_M


@pytest.mark.parametrize("height_m", [LOW_M - 0.1, HIGH_M + 0.1])
def test_a_plane_above_or_below_what_is_declared_shows_nothing(height_m: float) -> None:
    state = State(np.array([0.0, 0.0, height_m]))
    assert not len(marked(ring(), np.zeros((0, 3)), state))


def test_one_that_was_blind_farther_than_anything_was_seen_shows_nothing() -> None:
    state, nothing = State(np.zeros(3)), np.zeros((0, 3))
    assert len(marked(ring(), nothing, state, blind_m=0.0)) > 500
    assert not len(marked(ring(), nothing, state, blind_m=0.5))


@pytest.mark.parametrize("told", [{"tilt_rad": -0.1}, {"tilt_rad": np.nan}, {"tilt_rad": 1.6},
                                  {"blind_m": -1.0}, {"blind_m": np.inf}])  # fmt: skip
def test_a_scan_that_leans_or_is_blind_by_no_number_is_refused(told: dict[str, float]) -> None:
    with pytest.raises(ClearwayError, match=next(iter(told))):
        Scan(np.zeros((0, 3)), 0.0, sensor="ring", **told)
