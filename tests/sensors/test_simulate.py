"""Simulated scans: exact ranges, noise and drop-outs by seed, range limits, poses."""

from __future__ import annotations

import numpy as np

from ball_world import BallWorld
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.sensors import BeamPattern, Lidar, Mounting, simulate_scan

PATTERN = BeamPattern.rotating(np.linspace(-30.0, 30.0, 31), 2.0, max_range_m=20.0)
WORLD = BallWorld.of(((8.0, 0.0, 0.0), 3.0), ((0.0, -6.0, 1.0), 2.0), ((-15.0, 0.0, 0.0), 4.0))


def test_noiseless_returns_lie_on_the_surfaces():
    state = State([1.0, -0.5, 0.3], np.radians([5.0, -10.0, 40.0]), time_s=7.25)
    lidar = Lidar("top", PATTERN, mounting=Mounting([0.1, 0.2, 0.3], np.radians([0.0, 15.0, 90.0])))
    scan = simulate_scan(lidar, WORLD, state)
    in_body = scan.points_m @ lidar.mounting.body_from_sensor.T + lidar.mounting.position_m
    in_world = in_body @ state.world_from_body.T + state.position_m
    assert len(scan.points_m) > 200
    np.testing.assert_allclose(WORLD.distance_m(in_world), 0.0, atol=1e-9)
    assert (scan.time_s, scan.sensor) == (7.25, "top")


def test_only_beams_that_meet_something_return():
    scan = simulate_scan(Lidar("x", PATTERN), BallWorld.of(), State(np.zeros(3)))
    assert scan.points_m.shape == (0, 3)


def test_noise_has_the_stated_deviation_along_the_beam():
    state = State(np.zeros(3))
    exact = simulate_scan(Lidar("x", PATTERN), WORLD, state).points_m
    noisy = simulate_scan(Lidar("x", PATTERN, sigma_m=0.05), WORLD, state, seed=4).points_m
    ranges = np.linalg.norm(exact, axis=1)
    np.testing.assert_allclose(
        noisy / np.linalg.norm(noisy, axis=1)[:, None], exact / ranges[:, None], atol=1e-12
    )
    errors = np.linalg.norm(noisy, axis=1) - ranges
    assert abs(np.std(errors) - 0.05) < 0.01
    assert abs(np.mean(errors)) < 0.01


def test_dropout_loses_the_stated_share():
    state = State(np.zeros(3))
    full = len(simulate_scan(Lidar("x", PATTERN), WORLD, state).points_m)
    left = len(simulate_scan(Lidar("x", PATTERN, dropout=0.25), WORLD, state, seed=1).points_m)
    assert abs(left / full - 0.75) < 0.06


def test_a_seed_repeats_a_scan_and_another_does_not():
    lidar, state = Lidar("x", PATTERN, sigma_m=0.03, dropout=0.05), State(np.zeros(3))
    first, again, other = (simulate_scan(lidar, WORLD, state, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first.points_m, again.points_m)
    assert not np.array_equal(first.points_m[:50], other.points_m[:50])


def test_a_scan_is_what_its_draws_say():
    pattern = BeamPattern.rotating([-10.0, 0.0, 10.0], 2.0, min_range_m=3.0, max_range_m=9.5)
    lidar, state = Lidar("x", pattern, sigma_m=0.5, dropout=0.3), State(np.zeros(3))
    rng, drawn = np.random.default_rng(8), np.random.default_rng(8)
    for world in (WORLD, BallWorld.of(), BallWorld.of(((0.0, 0.0, 12.0), 2.5)), WORLD):
        points = simulate_scan(lidar, world, state, rng).points_m
        directions = np.ascontiguousarray(pattern.directions @ np.eye(3).T)
        ranges = world.cast(np.zeros(3), directions, 9.5)
        met = np.flatnonzero(np.isfinite(ranges))
        ranges = ranges[met] + drawn.normal(0.0, 0.5, len(met))
        back = (ranges > 0.0) & (ranges >= 3.0) & (ranges <= 9.5)
        back &= drawn.random(len(met)) >= 0.3
        np.testing.assert_array_equal(points, ranges[back, None] * pattern.directions[met][back])


def test_a_share_of_the_beams_returns_from_anywhere_in_place_of_the_truth():
    pattern = BeamPattern.rotating(
        np.linspace(-30.0, 30.0, 31), 1.0, min_range_m=2.0, max_range_m=20.0
    )
    lidar, state = Lidar("x", pattern, false_returns=0.02), State(np.zeros(3))
    for world in (WORLD, BallWorld.of()):
        dry = simulate_scan(Lidar("x", pattern), world, state).points_m
        wet = simulate_scan(lidar, world, state, seed=3).points_m
        np.testing.assert_array_equal(wet, simulate_scan(lidar, world, state, seed=3).points_m)
        true = {tuple(point) for point in dry.tolist()}
        false = np.array([point for point in wet.tolist() if tuple(point) not in true])
        # 4 standard deviations of a binomial count, and what misses the truth that is replaced.
        assert abs(len(false) / pattern.beams - 0.02) < 4.0 * np.sqrt(0.02 * 0.98 / pattern.beams)
        ranges = np.linalg.norm(false, axis=1)
        assert 2.0 <= ranges.min() < 3.5
        assert 18.5 < ranges.max() <= 20.0
        assert abs(ranges.mean() - 11.0) < 4.0 * 18.0 / np.sqrt(12.0 * len(false))
        ways = false / ranges[:, None]
        assert not len(dry) or (ways @ (dry / np.linalg.norm(dry, axis=1)[:, None]).T).max() > 0.9
        directions = wet / np.linalg.norm(wet, axis=1)[:, None]
        assert len(np.unique(np.round(directions, 9), axis=0)) == len(wet), "one return a beam"


def test_blind_and_too_far_surfaces_do_not_return():
    near_and_far = BeamPattern.rotating([0.0], 1.0, min_range_m=5.5, max_range_m=10.0)
    scan = simulate_scan(Lidar("x", near_and_far, sigma_m=0.02), WORLD, State(np.zeros(3)), seed=2)
    ranges = np.linalg.norm(scan.points_m, axis=1)
    assert ranges.min() >= 5.5
    assert ranges.max() <= 10.0
    # The nearest point of the first ball lies at 5 m, dead ahead.
    assert not np.any(np.abs(scan.points_m[:, 1]) < 0.1 * scan.points_m[:, 0])


def test_the_nearer_of_two_worlds_is_seen():
    near, far = BallWorld.of(((5.0, 0.0, 0.0), 1.0)), BallWorld.of(((9.0, 0.0, 0.0), 2.0))
    both = CombinedWorld((far, near))
    ahead = np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(both.cast(np.zeros(3), ahead, 50.0), [4.0])
    np.testing.assert_allclose(both.distance_m(np.array([[6.5, 0.0, 0.0]])), [0.5])
    nothing = CombinedWorld(())
    assert np.isinf(nothing.cast(np.zeros(3), ahead, 50.0)).all()
    assert np.isinf(nothing.distance_m(np.zeros((2, 3)))).all()


def test_obstacle_maps_are_worlds():
    balls = [
        Obstacle.ball(center, radius)
        for center, radius in zip(WORLD.centers_m, WORLD.radii_m, strict=True)
    ]
    state = State([1.0, -0.5, 0.3], np.radians([5.0, -10.0, 40.0]))
    lidar = Lidar("x", PATTERN, sigma_m=0.03, dropout=0.05)
    by_map = simulate_scan(lidar, ObstacleMap(balls), state, 3)
    np.testing.assert_allclose(
        by_map.points_m, simulate_scan(lidar, WORLD, state, 3).points_m, atol=1e-7
    )
