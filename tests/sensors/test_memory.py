"""Memory: points stay when they leave the view, and go only where beams pass through them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ball_world import BallWorld
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.sensors import (
    BeamPattern,
    Lidar,
    Mounting,
    PointMemory,
    Scan,
    simulate_scan,
    update_memory,
)

GRID = AvoidanceGrid.uniform()
LIDAR = Lidar("front", BeamPattern.per_cell(GRID, max_range_m=12.0))
HERE = State(np.zeros(3))
NOTHING = BallWorld.of()
BALL = BallWorld.of(((6.0, 0.5, 0.2), 1.0))


def seen(world: BallWorld, state: State = HERE, lidar: Lidar = LIDAR, **settings) -> PointMemory:
    memory = PointMemory.empty(0.3, **settings)
    return update_memory(memory, lidar, simulate_scan(lidar, world, state), state)


def look(
    memory: PointMemory, world: BallWorld, times: int = 1, state: State = HERE, lidar: Lidar = LIDAR
) -> PointMemory:
    for step in range(times):
        moment = replace(state, time_s=state.time_s + step + 1.0)
        memory = update_memory(memory, lidar, simulate_scan(lidar, world, moment, step), moment)
    return memory


def covered(memory: PointMemory, points: np.ndarray, slack_m: float = 1e-9) -> np.ndarray:
    gaps = np.linalg.norm(points[:, None] - memory.position_m, axis=-1) - memory.radius_m
    return np.min(gaps, axis=1, initial=np.inf) <= slack_m


def test_returns_are_remembered_in_the_world_frame():
    state = State([2.0, -1.0, 3.0], np.radians([0.0, 10.0, 60.0]))
    lidar = replace(LIDAR, mounting=Mounting([0.2, 0.0, 0.1], np.radians([0.0, 5.0, -10.0])))
    world = BallWorld.of(((4.5, 4.0, 2.0), 1.0))
    memory = seen(world, state, lidar)
    assert len(memory.position_m) > 5
    assert np.all(world.distance_m(memory.position_m) <= 0.03)
    assert np.all(world.distance_m(memory.position_m) > -0.15)


def test_what_leaves_the_field_of_view_stays():
    memory = seen(BALL)
    away = State(np.zeros(3), np.radians([0.0, 0.0, 180.0]))
    np.testing.assert_array_equal(look(memory, BALL, 5, away).position_m, memory.position_m)


def test_ghosts_in_the_sky_clear_although_nothing_returns():
    memory = seen(BALL)
    assert len(look(memory, NOTHING, 1).position_m) == len(memory.position_m)
    assert len(look(memory, NOTHING, 2).position_m) == 0


def test_ghosts_in_front_of_a_wall_clear():
    wall = BallWorld.of(((60.0, 0.0, 0.0), 51.0))
    memory = look(seen(BALL), wall, 2)
    assert not covered(memory, np.array([[5.0, 0.5, 0.2]])).any()
    assert covered(memory, np.array([[9.0, 0.0, 0.0]]), 0.1).all()


def test_a_nearer_return_hides_and_does_not_clear():
    memory = seen(BALL)
    screen = BallWorld.of(((22.0, 0.0, 0.0), 20.0))
    later = look(memory, screen, 5)
    assert covered(later, memory.position_m).all()


def test_one_sweep_is_enough_if_told_so():
    assert len(look(seen(BALL, passes_to_clear=1), NOTHING).position_m) == 0


def test_being_hit_again_starts_the_count_anew():
    memory = look(look(look(seen(BALL), NOTHING), BALL), NOTHING)
    assert covered(memory, seen(BALL).position_m, 0.02).all()


def test_beyond_the_range_of_the_sensor_nothing_clears():
    memory = seen(BALL)
    short = Lidar("short", BeamPattern.per_cell(GRID, max_range_m=4.0))
    assert len(look(memory, NOTHING, 5, lidar=short).position_m) == len(memory.position_m)


def test_between_sparse_rings_nothing_clears():
    rings = Lidar("rings", BeamPattern.rotating([-20.0, -12.0, 20.0], 1.0, max_range_m=12.0))
    memory = seen(BALL)
    assert len(look(memory, NOTHING, 5, lidar=rings).position_m) == len(memory.position_m)


@pytest.mark.parametrize("sigma_m", [0.0, 0.03])
def test_real_surfaces_are_not_eaten(sigma_m):
    world = BallWorld.of(
        ((6.0, 1.5, 0.0), 1.0), ((7.0, -2.0, 1.0), 0.8), ((4.0, -1.0, -1.5), 0.5),
        ((9.0, 0.0, -40.0), 38.0),
    )  # fmt: skip
    lidar = replace(LIDAR, sigma_m=sigma_m, dropout=0.05)
    memory, returns = PointMemory.empty(0.15), []
    for step in range(16):
        attitude = np.radians([0.0, 3.0 * np.sin(step), 8.0 * np.sin(0.5 * step)])
        state = State([0.08 * step, 0.02 * step, 0.0], attitude, time_s=float(step))
        scan = simulate_scan(lidar, world, state, step)
        memory = update_memory(memory, lidar, scan, state)
        returns.append(scan.points_m @ state.world_from_body.T + state.position_m)
    # A surface seen once is still known, but for a few points at edges seen by single beams.
    kept = covered(memory, np.concatenate(returns)[::40], 0.15 + 2.0 * sigma_m)
    assert kept.mean() > 0.999


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), returns=st.integers(0, 300), ghosts=st.integers(0, 300))
def test_what_this_scan_hits_is_never_forgotten(seed, returns, ghosts):
    rng = np.random.default_rng(seed)
    memory = PointMemory.empty(0.5, passes_to_clear=1)
    first = Scan(rng.uniform([1, -5, -3], [10, 5, 3], (ghosts, 3)), 0.0, sensor="front")
    memory = update_memory(memory, LIDAR, first, HERE)
    beams = rng.choice(LIDAR.pattern.beams, returns, replace=False)
    scan = Scan(LIDAR.pattern.directions[beams] * rng.uniform(0.5, 11.9, (returns, 1)), 1.0)
    updated = update_memory(memory, LIDAR, scan, replace(HERE, time_s=1.0))
    assert covered(updated, scan.points_m).all()
    # One ball per voxel, every one of them seen now or remembered from before.
    voxels = np.floor(updated.position_m / 0.5)
    assert len(np.unique(voxels, axis=0)) == len(voxels)
    old = updated.last_seen_s < 1.0
    known = {tuple(p) for p in memory.position_m.tolist()}
    assert {tuple(p) for p in updated.position_m[old].tolist()} <= known
    assert np.all(np.diff(updated.last_seen_s) >= 0.0)


def test_out_of_reach_points_expire_and_within_it_they_never_do():
    memory = seen(BALL, horizon_s=3.0, reach_m=8.0)
    turned = np.radians([0.0, 0.0, 180.0])
    here, away = State(np.zeros(3), turned), State(np.array([-4.0, 0.0, 0.0]), turned)
    assert len(look(memory, NOTHING, 3, away).position_m) == len(memory.position_m) > 0
    assert len(look(memory, NOTHING, 4, away).position_m) == 0
    assert len(look(memory, NOTHING, 400, here).position_m) == len(memory.position_m)


def test_what_is_no_obstacle_is_not_remembered():
    pattern = BeamPattern.per_cell(GRID, min_range_m=1.0, max_range_m=12.0)
    lidar = Lidar("low", pattern, mounting=Mounting([0.0, 0.0, -0.5]), airframe_radius_m=1.5)
    points = np.array(
        [
            [0.5, 0.0, 0.0],  # blind
            [1.2, 0.0, 0.2],  # own airframe
            [13.0, 0.0, 0.0],  # beyond the range
            [5.0, 0.0, -2.0],  # ground
            [np.nan, 0.0, 0.0],
            [np.inf, 1.0, 0.0],
            [5.0, 0.0, 0.0],
            [9.0, 0.0, 0.0],  # beyond reach
        ]
    )
    memory = update_memory(
        PointMemory.empty(0.3, reach_m=8.0), lidar, Scan(points), HERE, ground_m=-1.0
    )
    np.testing.assert_allclose(memory.position_m, [[5.0, 0.0, -0.5]])


def test_near_balls_are_found():
    memory = seen(BallWorld.of(((4.0, 0.0, 0.0), 1.0), ((9.0, 3.0, 0.0), 1.0)))
    center = np.array([4.0, 0.0, 0.0])
    points, radii = memory.near(center, 1.2)
    gaps = np.linalg.norm(memory.position_m - center, axis=1) - memory.radius_m
    assert 0 < len(points) == np.count_nonzero(gaps <= 1.2) < len(memory.position_m)
    assert np.all(np.linalg.norm(points - center, axis=1) - radii <= 1.2)


def test_an_update_leaves_the_old_memory_alone():
    memory = seen(BALL)
    before = memory.position_m.copy(), memory.boxes.doubt.copy()
    look(memory, NOTHING, 2)
    np.testing.assert_array_equal(memory.position_m, before[0])
    np.testing.assert_array_equal(memory.boxes.doubt, before[1])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"voxel_m": 0.0}, "voxel_m must be above 0"),
        ({"voxel_m": 0.3, "horizon_s": -1.0}, "horizon_s"),
        ({"voxel_m": 0.3, "reach_m": np.nan}, "reach_m"),
        ({"voxel_m": 0.3, "capacity": 0}, "capacity"),
        ({"voxel_m": 0.3, "smallest_m": np.nan}, "smallest_m"),
    ],
)
def test_impossible_settings_are_refused(arguments, message):
    with pytest.raises(ClearwayError, match=message):
        PointMemory.empty(**arguments)
