"""Obstacle map: near obstacles into the grid frame, volumes in cells, coating, rays."""

from __future__ import annotations

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from clearway.frames import FloatArray
from clearway.grid import AvoidanceGrid
from clearway.map_cells import base_probability, coated_cells
from clearway.obstacle_map import ObstacleMap
from clearway.obstacles import Obstacle
from clearway.route import Route, find_route

GRID = AvoidanceGrid.uniform()
HERE, LEVEL = np.zeros(3), np.eye(3)


def obstacle_at(position: FloatArray, rng: np.random.Generator) -> Obstacle:
    turn = rng.uniform(-np.pi, np.pi, 3)
    size = rng.uniform(0.5, 4.0, 3)
    radius = float(rng.uniform(0.05, 1.0))
    return (
        Obstacle.ball(position, radius),
        Obstacle.line(position, size[0], radius, turn),
        Obstacle.plane(position, (size[0], size[1]), radius, turn),
        Obstacle.cuboid(position, (size[0], size[1], size[2]), 0.0, turn),
    )[rng.integers(4)]


def map_with_twenty_near(count: int) -> ObstacleMap:
    """Twenty obstacles in the field of view, the others well beyond its range."""
    rng = np.random.default_rng(0)
    obstacles = []
    while len(obstacles) < count:
        near = len(obstacles) < 20
        position = rng.uniform([3, -4, -3], [9.5, 4, 3]) if near else rng.uniform(-200.0, 200.0, 3)
        if near or np.linalg.norm(position) > 16.0:
            obstacles.append(obstacle_at(position, rng))
    return ObstacleMap(obstacles)


@pytest.mark.parametrize("count", [1_000, 10_000])
def test_base_probability_of_twenty_near(benchmark: BenchmarkFixture, count: int) -> None:
    world = map_with_twenty_near(count)
    shares = benchmark(lambda: base_probability(world.in_grid(HERE, LEVEL, GRID), GRID))
    assert np.count_nonzero(shares) > 50


def test_base_probability_of_three_balls(benchmark: BenchmarkFixture) -> None:
    world = ObstacleMap([Obstacle.ball([5, y, 0.3], 0.8) for y in (-2.0, 0.0, 2.0)])
    shares = benchmark(lambda: base_probability(world.in_grid(HERE, LEVEL, GRID), GRID))
    assert np.count_nonzero(shares) > 10


def test_coated_cells_of_twenty_near(benchmark: BenchmarkFixture) -> None:
    shapes = map_with_twenty_near(1_000).in_grid(HERE, LEVEL, GRID, 0.6)
    assert benchmark(coated_cells, shapes, GRID, 0.6).sum() > 50


def test_reference_volumes_of_two_balls(benchmark: BenchmarkFixture) -> None:
    world = ObstacleMap([Obstacle.ball([5, 0, 0], 1.0), Obstacle.ball([5.5, 0.8, 0.3], 1.0)])
    shapes = world.in_grid(HERE, LEVEL, GRID)
    assert benchmark(base_probability, shapes, GRID, "reference").sum() > 1.0


def test_seven_thousand_rays_among_ten_thousand(benchmark: BenchmarkFixture) -> None:
    world = map_with_twenty_near(10_000)
    beams = np.random.default_rng(1).normal(size=(7_000, 3))
    beams /= np.linalg.norm(beams, axis=1, keepdims=True)
    assert np.isfinite(benchmark(world.cast, HERE, beams, 50.0)).any()


def test_route_through_ten_thousand(benchmark: BenchmarkFixture) -> None:
    world = map_with_twenty_near(10_000)
    start, goal = np.array([-20.0, 0.0, 0.0]), np.array([25.0, 0.0, 0.0])
    route = benchmark(lambda: find_route(world.distance_m, start, goal, 0.6, voxels=6_000))
    assert isinstance(route, Route)
