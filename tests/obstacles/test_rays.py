"""Rays in bundles against asking every obstacle for every ray, to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.rounded_box import ray_rounded_box

COLUMN = np.radians(np.linspace(-40.0, 40.0, 25))
LATTICE = np.array(
    [
        (np.cos(up) * np.cos(left), np.cos(up) * np.sin(left), np.sin(up))
        for left in np.radians(np.linspace(-175.0, 180.0, 16))
        for up in COLUMN
    ]
)
AXES = np.concatenate([np.eye(3), -np.eye(3)])


def world_of(rng: np.random.Generator, count: int, extent_m: float) -> ObstacleMap:
    """Shapes of all kinds and of sizes that differ much, some of them there twice."""
    shapes: list[Obstacle] = []
    for number in range(count):
        place, turn = rng.uniform(-extent_m, extent_m, 3), rng.uniform(-np.pi, np.pi, 3)
        size, radius = 10.0 ** rng.uniform(-2.0, 1.0, 3), float(10.0 ** rng.uniform(-2.0, 0.5))
        named: dict[str, Any] = {"orientation_rad": turn if number % 3 else np.zeros(3)}
        kinds = (
            Obstacle.ball(place, radius),
            Obstacle.line(place, size[0], radius_m=radius, **named),
            Obstacle.plane(place, (size[0], size[1]), radius_m=radius, **named),
            Obstacle.cuboid(place, (size[0], size[1], size[2]), **named),
        )
        shapes += [kinds[number % 4]] * (2 if number % 7 == 0 else 1)
    return ObstacleMap(shapes)


def asked_one_by_one(
    world: ObstacleMap, origin: FloatArray, directions: FloatArray, max_range_m: float
) -> FloatArray:
    s = world.shapes
    each = [
        [
            ray_rounded_box(*origin, *u, s.center_m[n], s.rotation[n], s.half_m[n], s.radius_m[n])
            for n in range(len(world))
        ]
        for u in directions
    ]
    nearest = np.array(each).reshape(len(directions), -1).min(axis=1, initial=np.inf)
    return np.where(nearest <= max_range_m, nearest, np.inf)


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.sampled_from([0, 1, 3, 5, 12, 40]),
    max_range_m=st.sampled_from([0.5, 6.0, 25.0, np.inf]),
    order=st.sampled_from(["lattice", "shuffled", "any"]),
)
@settings(max_examples=60, deadline=None)
def test_every_ray_meets_what_it_meets_alone(
    seed: int, count: int, max_range_m: float, order: str
) -> None:
    rng = np.random.default_rng(seed)
    world = world_of(rng, count, float(rng.choice([3.0, 12.0])))
    directions = LATTICE[:: int(rng.integers(1, 4))]
    if order == "shuffled":
        directions = rng.permutation(directions)
    if order == "any":
        towards = rng.normal(size=(90, 3))
        directions = np.concatenate(
            [AXES, towards / np.linalg.norm(towards, axis=1, keepdims=True)]
        )
    origin = rng.uniform(-6.0, 6.0, 3)
    if count and rng.random() < 0.3:
        origin = world.shapes.center_m[0] + 1e-3  # Inside one.
    np.testing.assert_array_equal(
        world.cast(origin, directions, max_range_m),
        asked_one_by_one(world, origin, directions, max_range_m),
    )


def test_thousands_of_shapes_all_round() -> None:
    rng = np.random.default_rng(5)
    world = world_of(rng, 2_500, 40.0)
    origin, some = np.array([0.3, -0.2, 0.1]), slice(None, None, 7)
    ranges = world.cast(origin, LATTICE, 30.0)
    assert np.isfinite(ranges).mean() > 0.1
    np.testing.assert_array_equal(
        ranges[some], asked_one_by_one(world, origin, LATTICE[some], 30.0)
    )


@pytest.mark.parametrize("lateral", [0.9999999, 1.0, 1.0000001])
def test_a_ray_that_grazes_a_ball_meets_it_or_not_as_it_does_alone(lateral: float) -> None:
    world = ObstacleMap([Obstacle.ball([5.0, lateral, 0.0], 1.0)])
    ahead = np.array([[1.0, 0.0, 0.0]])
    ranges = world.cast(np.zeros(3), ahead, 10.0)
    np.testing.assert_array_equal(ranges, asked_one_by_one(world, np.zeros(3), ahead, 10.0))
    assert np.isfinite(ranges[0]) == (lateral <= 1.0)


def test_a_range_ends_at_the_surface() -> None:
    world = ObstacleMap([Obstacle.ball([5.0, 0.0, 0.0], 1.0)])
    ahead = np.array([[1.0, 0.0, 0.0]])
    assert world.cast(np.zeros(3), ahead, 4.0).tolist() == [4.0]
    assert world.cast(np.zeros(3), ahead, np.nextafter(4.0, 0.0)).tolist() == [np.inf]
