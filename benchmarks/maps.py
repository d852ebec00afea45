"""Speed of the obstacle map: near obstacles into the grid frame, volumes, coating, rays, routes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.references import brute_force_distance
from benchmarks.table import Benchmark, Row
from benchmarks.timing import timed
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.live.routing.route import find_route
from clearway.obstacles.cells import base_probability, inflate_shapes
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

GRID = AvoidanceGrid.uniform()
HERE, LEVEL = np.zeros(3), np.eye(3)


def obstacle_at(position: FloatArray, rng: np.random.Generator) -> Obstacle:
    turn = rng.uniform(-np.pi, np.pi, 3)
    size = rng.uniform(0.5, 4.0, 3)
    radius = float(rng.uniform(0.05, 1.0))
    return (
        Obstacle.ball(position, radius),
        Obstacle.line(position, size[0], radius_m=radius, orientation_rad=turn),
        Obstacle.plane(position, (size[0], size[1]), radius_m=radius, orientation_rad=turn),
        Obstacle.cuboid(position, (size[0], size[1], size[2]), radius_m=0.0, orientation_rad=turn),
    )[rng.integers(4)]


def map_with_twenty_near(number: int) -> ObstacleMap:
    """Twenty obstacles in the field of view, the others well beyond its range."""
    rng = np.random.default_rng(0)
    obstacles: list[Obstacle] = []
    while len(obstacles) < number:
        near = len(obstacles) < 20
        position = rng.uniform([3, -4, -3], [9.5, 4, 3]) if near else rng.uniform(-200.0, 200.0, 3)
        if near or np.linalg.norm(position) > 16.0:
            obstacles.append(obstacle_at(position, rng))
    return ObstacleMap(obstacles)


def volumes(number: int, target_s: float | None = None) -> Callable[[bool], Row]:
    """Near obstacles found, turned into the grid frame, their share of every cell."""

    def measure(quick: bool) -> Row:
        world = map_with_twenty_near(number)
        return timed(lambda: base_probability(world.in_grid(HERE, LEVEL, GRID), GRID), quick).row(
            f"{number:,} map obstacles, 20 of them near: volume shares of 350 cells",
            target_s=target_s,
        )

    return measure


def reference_volumes(quick: bool) -> Row:
    world = ObstacleMap([Obstacle.ball([5, 0, 0], 1.0), Obstacle.ball([5.5, 0.8, 0.3], 1.0)])
    shapes = world.in_grid(HERE, LEVEL, GRID)
    return timed(lambda: base_probability(shapes, GRID, "reference"), quick, warm_up=1).row(
        "two balls that overlap, volume shares to 1e-5"
    )


def coating(quick: bool) -> Row:
    shapes = map_with_twenty_near(1_000).in_grid(HERE, LEVEL, GRID, 0.6)
    return timed(lambda: inflate_shapes(shapes, GRID, 0.6), quick).row(
        f"cells within 0.6 m of {len(shapes.radius_m)} near obstacles"
    )


def near(quick: bool) -> Row:
    world = map_with_twenty_near(10_000)
    expected = np.flatnonzero(brute_force_distance(world.shapes, HERE) <= 10.0)
    assert np.array_equal(world.near(HERE, 10.0), expected)
    other = timed(lambda: brute_force_distance(world.shapes, HERE) <= 10.0, quick)
    return timed(lambda: world.near(HERE, 10.0), quick).row(
        "those of 10,000 map obstacles within 10 m", reference=(other, "NumPy over all")
    )


def rays(quick: bool) -> Row:
    world = map_with_twenty_near(10_000)
    beams = np.random.default_rng(1).normal(size=(7_000, 3))
    beams /= np.linalg.norm(beams, axis=1, keepdims=True)
    return timed(lambda: world.cast(HERE, beams, 50.0), quick).row(
        "7,000 rays of 50 m among 10,000 map obstacles"
    )


def route(quick: bool) -> Row:
    world = map_with_twenty_near(10_000)
    start, goal = np.array([-20.0, 0.0, 0.0]), np.array([25.0, 0.0, 0.0])
    return timed(
        lambda: find_route(world.distance_m, start, goal, 0.6, voxels=6_000), quick, warm_up=1
    ).row("a way of 45 m round what 10,000 map obstacles show")


BENCHMARKS = (
    Benchmark("map of 1,000", volumes(1_000, target_s=2e-3), headline=True),
    Benchmark("map of 10,000", volumes(10_000)),
    Benchmark("map, reference volumes", reference_volumes),
    Benchmark("map, coating", coating),
    Benchmark("map, near", near),
    Benchmark("map, rays", rays),
    Benchmark("map, route", route),
)
