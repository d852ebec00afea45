"""Point worlds: rays and distances against brute force, real surveys."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ball_world import BallWorld
from clearway.base.errors import ClearwayError
from clearway.obstacles.point_world import PointWorld
from clearway.sensors import BeamPattern


def random_directions(rng: np.random.Generator, count: int) -> np.ndarray:
    directions = rng.normal(size=(count, 3))
    directions[: count // 4, rng.integers(0, 3)] = 0.0
    directions[0] = [0.0, 0.0, -1.0]
    return directions / np.linalg.norm(directions, axis=1)[:, None]


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 200),
    radius=st.floats(0.02, 1.5),
    flat=st.booleans(),
)
def test_rays_and_distances_equal_brute_force(seed, count, radius, flat):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-10.0, 10.0, (count, 3)) * [1.0, 1.0, 0.0 if flat else 0.5]
    world = PointWorld(points, radius)
    balls = BallWorld(points, np.full(count, radius))
    probes = rng.uniform(-15.0, 15.0, (50, 3))
    np.testing.assert_allclose(world.distance_m(probes), balls.distance_m(probes), atol=1e-9)
    outside = probes[balls.distance_m(probes) > 0.0]
    for origin in outside[:3]:
        directions = random_directions(rng, 80)
        np.testing.assert_allclose(
            world.cast(origin, directions, 18.0), balls.cast(origin, directions, 18.0), atol=1e-7
        )


def test_a_ray_from_inside_returns_zero():
    world = PointWorld(np.zeros((1, 3)), 1.0)
    ahead = np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(world.cast(np.array([0.5, 0.0, 0.0]), ahead, 5.0), [0.0])
    np.testing.assert_array_equal(world.distance_m(np.array([[0.5, 0.0, 0.0]])), [-0.5])


def test_a_ball_behind_or_out_of_range_is_not_hit():
    world = PointWorld(np.array([[10.0, 0.0, 0.0]]), 1.0)
    ahead = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(world.cast(np.zeros(3), ahead, 8.9), [np.inf, np.inf])
    np.testing.assert_allclose(world.cast(np.zeros(3), ahead, 9.1), [9.0, np.inf])


def test_an_empty_cloud_is_empty_space():
    world = PointWorld(np.zeros((0, 3)), 0.5)
    assert np.isinf(world.distance_m(np.zeros((2, 3)))).all()
    assert np.isinf(world.cast(np.zeros(3), np.array([[1.0, 0.0, 0.0]]), 10.0)).all()


@pytest.mark.parametrize(
    ("points", "radius", "labels", "message"),
    [
        (np.zeros((4, 2)), 0.1, None, "shape"),
        (np.array([[0.0, np.nan, 0.0]]), 0.1, None, "finite"),
        (np.zeros((4, 3)), 0.0, None, "point_radius_m"),
        (np.zeros((4, 3)), 0.1, np.zeros(3, dtype=np.uint8), "one a point, got .3."),
    ],
)
def test_impossible_clouds_are_refused(points, radius, labels, message):
    with pytest.raises(ClearwayError, match=message):
        PointWorld(points, radius, labels=labels)


def test_a_real_survey_is_seen_and_kept_clear_of(data_dir):
    laspy = pytest.importorskip("laspy")
    survey = laspy.read(data_dir / "lidar" / "aerial" / "ahn_powerline_12AN2_20.laz")
    points = np.asarray(survey.xyz, dtype=np.float64)
    points = points - points.min(axis=0)
    world = PointWorld(points, 0.3, labels=np.asarray(survey.classification))
    above = np.array([70.0, 200.0, 60.0])
    down = BeamPattern.rotating(np.linspace(-80.0, -40.0, 21), 5.0)
    ranges = world.cast(above, down.directions, 120.0)
    hit = np.isfinite(ranges)
    assert hit.mean() > 0.8
    ends = above + ranges[hit, None] * down.directions[hit]
    np.testing.assert_allclose(world.distance_m(ends), 0.0, atol=1e-6)
    halfway = above + 0.5 * ranges[hit, None] * down.directions[hit]
    assert np.all(world.distance_m(halfway) > 0.0)
