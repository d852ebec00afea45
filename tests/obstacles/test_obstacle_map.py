"""The obstacle map against asking every obstacle in turn, and its grid-frame copies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.frames import FloatArray, world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.obstacle import Obstacle, local_distance
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.rounded_box import ray_rounded_box


def random_map(seed: int, count: int, extent_m: float) -> ObstacleMap:
    rng = np.random.default_rng(seed)
    obstacles = []
    for number in range(count):
        position = rng.uniform(-extent_m, extent_m, 3)
        turn = rng.uniform(-np.pi, np.pi, 3)
        size = rng.uniform(0.5, 6.0, 3)
        radius = float(rng.uniform(0.05, 1.0))
        obstacles.append(
            (
                Obstacle.ball(position, radius),
                Obstacle.line(position, size[0], radius_m=radius, orientation_rad=turn),
                Obstacle.plane(position, (size[0], size[1]), radius_m=radius, orientation_rad=turn),
                Obstacle.cuboid(
                    position, (size[0], size[1], size[2]), radius_m=0.0, orientation_rad=turn
                ),
            )[number % 4]
        )
    return ObstacleMap(obstacles)


def distances_to_each(world: ObstacleMap, point: FloatArray) -> FloatArray:
    """Signed distance [n] of a point to every obstacle, written out."""
    s = world.shapes
    local = np.einsum("nij,ni->nj", s.rotation, point - s.center_m)
    outside = np.abs(local) - s.half_m
    beyond = np.linalg.norm(np.maximum(outside, 0.0), axis=1)
    result: FloatArray = beyond + np.minimum(outside.max(axis=1), 0.0) - s.radius_m
    return result


def test_ten_thousand_obstacles_equal_asking_each() -> None:
    world = random_map(1, 10_000, 150.0)
    points = np.random.default_rng(2).uniform(-160.0, 160.0, (100, 3))
    distances, nearest = world.nearest(points)
    for point, distance, index in zip(points, distances, nearest, strict=True):
        each = distances_to_each(world, point)
        assert distance == pytest.approx(each.min(), abs=1e-9)
        assert each[index] == pytest.approx(distance, abs=1e-9)
        assert world.near(point, 20.0).tolist() == np.flatnonzero(each <= 20.0).tolist()


def test_rays_equal_asking_each() -> None:
    world = random_map(3, 400, 20.0)
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(300, 3))
    directions[0] = [1.0, 0.0, 0.0]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origin = np.array([0.5, -0.3, 0.2])
    s = world.shapes
    each = np.array(
        [
            min(
                ray_rounded_box(
                    *origin, *u, s.center_m[n], s.rotation[n], s.half_m[n], s.radius_m[n]
                )
                for n in range(len(world))
            )
            for u in directions
        ]
    )
    np.testing.assert_array_equal(
        world.cast(origin, directions, 15.0), np.where(each <= 15.0, each, np.inf)
    )


def test_empty_map() -> None:
    world = ObstacleMap()
    assert len(world) == 0
    assert np.all(world.distance_m(np.zeros((2, 3))) == np.inf)
    assert np.all(world.cast(np.zeros(3), np.eye(3), 100.0) == np.inf)
    assert len(world.near([0.0, 0.0, 0.0], 1e9)) == 0
    assert len(world.in_grid(np.zeros(3), np.eye(3), AvoidanceGrid.uniform()).radius_m) == 0


def test_a_ray_that_starts_inside_returns_zero() -> None:
    world = ObstacleMap([Obstacle.cuboid([0, 0, 0], (2.0, 2.0, 2.0))])
    assert world.cast([0.0, 0.5, 0.0], [[1.0, 0.0, 0.0]], 10.0).tolist() == [0.0]


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_distances_do_not_depend_on_the_frame(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_map(seed, 60, 12.0)
    position = rng.uniform(-5.0, 5.0, 3)
    world_from_grid = world_from_body(rng.uniform(-np.pi, np.pi, 3))
    grid = AvoidanceGrid.uniform()
    shapes = world.in_grid(position, world_from_grid, grid, margin_m=1.0)
    assert shapes.source.tolist() == world.near(position, grid.range_m + 1.0).tolist()
    point = rng.uniform(-4.0, 4.0, 3)
    in_world = world_from_grid @ point + position
    from_grid = local_distance(*point, shapes)
    if from_grid < 3.0:
        assert from_grid == pytest.approx(world.distance_m(in_world)[0], abs=1e-9)


def test_label_names_the_obstacle() -> None:
    world = ObstacleMap([Obstacle.ball([0, 0, 0], 1.0), Obstacle.ball([9, 0, 0], 1.0, name="mast")])
    assert world.label(0) == "obstacle 0 (ball)"
    assert world.label(1) == "obstacle 1 'mast' (ball)"
