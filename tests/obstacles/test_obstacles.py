"""Rounded boxes: analytic distances, volumes and ray entries, sampling, bad input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.obstacles.obstacle import Obstacle, local_distance, shapes_of
from clearway.obstacles.rounded_box import measure_rounded_box_distance, ray_rounded_box


def random_obstacle(rng: np.random.Generator, spread_m: float = 5.0) -> Obstacle:
    """One of the four shapes, in any pose."""
    position = rng.uniform(-spread_m, spread_m, 3)
    turn = rng.uniform(-np.pi, np.pi, 3)
    size = rng.uniform(0.3, 4.0, 3)
    radius = float(rng.uniform(0.01, 1.0))
    kind = rng.integers(4)
    if kind == 0:
        return Obstacle.ball(position, radius)
    if kind == 1:
        return Obstacle.line(position, size[0], radius_m=radius, orientation_rad=turn)
    if kind == 2:
        return Obstacle.plane(position, (size[0], size[1]), radius_m=radius, orientation_rad=turn)
    return Obstacle.cuboid(
        position,
        (size[0], size[1], size[2]),
        radius_m=radius * rng.integers(2),
        orientation_rad=turn,
    )


def distance(obstacle: Obstacle, point: Any) -> float:
    shapes = shapes_of([obstacle])
    x, y, z = np.asarray(point, dtype=np.float64)
    return measure_rounded_box_distance(
        x, y, z, shapes.center_m[0], shapes.rotation[0], shapes.half_m[0], shapes.radius_m[0]
    )


def entry(obstacle: Obstacle, origin: Any, direction: Any) -> float:
    shapes = shapes_of([obstacle])
    x, y, z = np.asarray(origin, dtype=np.float64)
    ux, uy, uz = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
    return ray_rounded_box(
        x,
        y,
        z,
        ux,
        uy,
        uz,
        shapes.center_m[0],
        shapes.rotation[0],
        shapes.half_m[0],
        shapes.radius_m[0],
    )


def box_samples(obstacle: Obstacle, per_axis: int) -> Any:
    """Points of the box before inflation, in the world."""
    shapes = shapes_of([obstacle])
    ticks = [np.linspace(-h, h, per_axis if h else 1) for h in shapes.half_m[0]]
    local = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    return local @ shapes.rotation[0].T + shapes.center_m[0]


def test_distances_of_simple_shapes() -> None:
    assert distance(Obstacle.ball([1, 2, 3], 0.5), [1, 2, 5]) == pytest.approx(1.5)
    assert distance(Obstacle.ball([1, 2, 3], 0.5), [1, 2, 3]) == pytest.approx(-0.5)
    wire = Obstacle.line([0, 0, 0], 4.0, radius_m=0.1)
    assert distance(wire, [1.5, 0.0, 1.0]) == pytest.approx(0.9)
    assert distance(wire, [5.0, 4.0, 0.0]) == pytest.approx(4.9)
    plate = Obstacle.plane([0, 0, 0], (4.0, 2.0), radius_m=0.25)
    assert distance(plate, [1.0, 0.5, 3.0]) == pytest.approx(2.75)
    assert distance(plate, [0.0, 5.0, 3.0]) == pytest.approx(4.75)
    box = Obstacle.cuboid([0, 0, 0], (2.0, 4.0, 6.0))
    assert distance(box, [0.5, 0.0, 0.0]) == pytest.approx(-0.5)
    assert distance(box, [4.0, 6.0, 3.0]) == pytest.approx(5.0)


def test_rotation_follows_3_37() -> None:
    left = Obstacle.line([0, 0, 0], 4.0, radius_m=0.1, orientation_rad=[0.0, 0.0, np.pi / 2])
    assert distance(left, [0.0, 1.9, 0.0]) == pytest.approx(-0.1)
    nose_down = Obstacle.line([0, 0, 0], 4.0, radius_m=0.1, orientation_rad=[0.0, np.pi / 4, 0.0])
    assert distance(nose_down, [1.0, 0.0, -1.0]) == pytest.approx(-0.1)
    rolled = Obstacle.plane(
        [0, 0, 0], (4.0, 2.0), radius_m=0.1, orientation_rad=[np.pi / 2, 0.0, 0.0]
    )
    assert distance(rolled, [0.0, 0.0, 0.9]) == pytest.approx(-0.1)


def test_line_between_runs_from_end_to_end() -> None:
    start, end = np.array([1.0, -2.0, 3.0]), np.array([4.0, 1.0, -5.0])
    wire = Obstacle.line_between(start, end, radius_m=0.2)
    for share in (0.0, 0.3, 1.0):
        assert distance(wire, start + share * (end - start)) == pytest.approx(-0.2)
    beyond = end + (end - start) / np.linalg.norm(end - start)
    assert distance(wire, beyond) == pytest.approx(0.8)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_distance_outside_is_to_the_nearest_point_of_the_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    obstacle = random_obstacle(rng)
    samples = box_samples(obstacle, 21)
    spacing = max(obstacle.half_m) / 10.0
    point = rng.uniform(-8.0, 8.0, 3)
    sampled = np.min(np.linalg.norm(samples - point, axis=1))
    plain = distance(obstacle, point) + obstacle.radius_m
    if sampled > 2.0 * spacing:
        assert plain <= sampled + 1e-9
        assert plain >= sampled - np.sqrt(0.75) * spacing - 1e-9


@given(seed=st.integers(0, 10_000))
@settings(max_examples=100, deadline=None)
def test_a_ray_enters_where_the_distance_is_zero(seed: int) -> None:
    rng = np.random.default_rng(seed)
    obstacle = random_obstacle(rng)
    origin = rng.uniform(-8.0, 8.0, 3)
    direction = rng.normal(size=3) + 0.5 * (obstacle.position_m - origin)
    direction /= np.linalg.norm(direction)
    hit = entry(obstacle, origin, direction)
    ticks = np.linspace(0.0, min(hit, 30.0), 200)
    along = np.array([distance(obstacle, origin + t * direction) for t in ticks])
    if distance(obstacle, origin) <= 0.0:
        assert hit == 0.0
    elif np.isfinite(hit):
        assert abs(along[-1]) < 1e-9
        assert np.all(along[:-1] > 0.0)
    else:
        assert np.all(along > 0.0)


def test_ray_answers() -> None:
    box = Obstacle.cuboid([5, 0, 0], (2.0, 2.0, 2.0), radius_m=0.5)
    assert entry(box, [0, 0, 0], [1, 0, 0]) == pytest.approx(3.5, abs=1e-9)
    assert entry(box, [0, 0, 0], [-1, 0, 0]) == np.inf
    assert entry(box, [0, 1.6, 0], [1, 0, 0]) == np.inf
    # Through the rounded edge, at 45 degrees to it.
    corner = entry(box, [0.0, 5.0, 0.0], [4.0, -4.0, 0.0])
    assert corner == pytest.approx(4.0 * np.sqrt(2.0) - 0.5, abs=1e-9)
    graze = entry(Obstacle.cuboid([5, 0, 0], (2.0, 2.0, 2.0)), [0, 1.0, 0], [1, 0, 0])
    assert graze == pytest.approx(4.0, abs=1e-9)


def test_volumes() -> None:
    assert Obstacle.ball([0, 0, 0], 2.0).volume_m3 == pytest.approx(32.0 / 3.0 * np.pi)
    assert Obstacle.cuboid([0, 0, 0], (1.0, 2.0, 3.0)).volume_m3 == pytest.approx(6.0)
    capsule = Obstacle.line([0, 0, 0], 5.0, radius_m=1.0).volume_m3
    assert capsule == pytest.approx(np.pi * (5.0 + 4.0 / 3.0))
    rng = np.random.default_rng(0)
    plate = Obstacle.plane([0, 0, 0], (2.0, 1.0), radius_m=0.5)
    points = rng.uniform(-1, 1, (100_000, 3)) * [1.5, 1.0, 0.5]
    shapes = shapes_of([plate])
    inside = np.mean([local_distance(x, y, z, shapes) <= 0.0 for x, y, z in points])
    assert plate.volume_m3 == pytest.approx(inside * 6.0, rel=0.01)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"shape": "pyramid"}, "ball, line, plane, cuboid"),
        ({"position_m": [0.0, 1.0]}, "position_m"),
        ({"position_m": [0.0, np.nan, 1.0]}, "position_m"),
        ({"orientation_rad": [0.0, np.inf, 1.0]}, "orientation_rad"),
        ({"size_m": (1.0,)}, "a plane needs 2 lengths, got 1"),
        ({"size_m": (1.0, -2.0)}, "size_m: lengths must be positive"),
        ({"size_m": (1.0, np.inf)}, "size_m: lengths must be positive"),
        ({"radius_m": -0.1}, "radius_m"),
        ({"radius_m": np.nan}, "radius_m"),
        ({"radius_m": 0.0}, "a plane needs a radius > 0"),
    ],
)
def test_bad_fields_are_named(changes: dict[str, Any], named: str) -> None:
    fields: dict[str, Any] = {
        "shape": "plane",
        "position_m": [0.0, 0.0, 0.0],
        "size_m": (1.0, 2.0),
        "radius_m": 0.1,
        "name": "shed",
    }
    with pytest.raises(InputError, match=r"'shed'") as caught:
        Obstacle(**(fields | changes))
    assert named in str(caught.value)


def test_all_problems_are_reported_at_once() -> None:
    with pytest.raises(InputError) as caught:
        Obstacle("line", np.array([0.0, np.nan, 0.0]), size_m=(1.0, 2.0), radius_m=-1.0)
    assert len(caught.value.problems) == 3
