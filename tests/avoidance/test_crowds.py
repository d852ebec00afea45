"""Clearance of movements among very many shapes, against looking at each of them."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.clear.clearance import make_span, shapes_clearance
from clearway.avoidance.clear.crowds import ALIKE_M, FEW, ROUNDING_M, clearance_among, crowd_of
from clearway.avoidance.clear.faces_crossed import own_axes_bound
from clearway.obstacles.obstacle import Obstacle, Shapes, shape_distance, shapes_of


def movement(rng, step_m=0.4):
    """A bent way of four chords."""
    turned = np.cumsum(rng.normal(scale=0.3, size=(5, 3)), axis=0) + rng.normal(size=3)
    return np.cumsum(step_m * turned / np.linalg.norm(turned, axis=1, keepdims=True), axis=0)


def crowd(rng, count, apart_m, largest_m):
    """Shapes of all kinds, some of them twice, as far apart as told."""
    told = []
    for place in rng.uniform(-apart_m, apart_m, (count, 3)):
        size, turn = np.exp(rng.uniform(np.log(0.01), np.log(largest_m), 3)), rng.normal(size=3)
        told.append(
            (
                Obstacle.ball(place, 0.3 * size[0]),
                Obstacle.line(place, size[0], radius_m=0.05, orientation_rad=turn),
                Obstacle.plane(place, (size[0], size[1]), radius_m=0.02, orientation_rad=turn),
                Obstacle.cuboid(
                    place, tuple(size), radius_m=rng.choice([0.0, 0.1]), orientation_rad=turn
                ),
            )[rng.integers(4)]
        )
    return shapes_of([*told, *told[: count // 4]])


def left(span, shapes, enough):
    """How many could be nearer than the one nearest to the middle."""
    off_m = np.array(
        [shape_distance(*span.middle_m, shapes, s) for s in range(len(shapes.bound_m))]
    )
    nearest = Shapes(*(column[[off_m.argmin()]] for column in shapes))
    best = shapes_clearance(span, nearest, enough, -np.inf)[0]
    return int(np.sum(off_m - span.reach_m < best))


def bound(corners, shapes, s):
    """No point of a movement is nearer to one shape."""
    return own_axes_bound(corners, shapes, s, np.empty_like(corners))


@given(
    seed=st.integers(0, 10_000),
    count=st.sampled_from([5, FEW, 60, 200]),
    apart_m=st.sampled_from([2.0, 8.0, 20.0]),
    enough=st.sampled_from([0.1, 0.65, 5.0]),
)
@settings(max_examples=150, deadline=None)
def test_it_tells_what_looking_at_each_tells_or_where_very_many_are_hardly_less(
    seed, count, apart_m, enough
):
    rng = np.random.default_rng(seed)
    shapes, span = (
        crowd(rng, count, apart_m, rng.choice([1.0, 30.0])),
        make_span(movement(rng), 0, 1),
    )
    expected = shapes_clearance(span, shapes, enough, -np.inf)
    found = clearance_among(span, shapes, crowd_of(shapes, 5), enough, -np.inf)
    if left(span, shapes, enough) <= FEW:
        assert found == expected
    else:
        assert expected[0] - ALIKE_M <= found[0] <= expected[0]
        assert (found[1], found[2] >= 0) == (expected[1], expected[2] >= 0)
        assert (found[0] < enough) == (expected[0] < enough)
    # Below where it may stop, only that it is below counts.
    stop = expected[0] + rng.choice([-0.01, 0.01])
    stopped = clearance_among(span, shapes, crowd_of(shapes, 5), enough, stop)
    assert (stopped[0] < stop) == (found[0] < stop)


@pytest.mark.parametrize("thick_m", [1e-4, 0.01, 0.3])
def test_through_a_stack_of_walls_it_is_as_deep_as_half_of_one(thick_m):
    """Walls 2 mm apart, all flown through: each is left at its other side."""
    places = np.arange(-1.0, 1.0, 0.002)
    walls = [Obstacle.cuboid([x, 0.0, 0.0], (thick_m, 40.0, 40.0)) for x in places]
    shapes, span = shapes_of(walls), make_span(np.linspace([-1, 0, 0], [1, 0.2, 0.1], 5), 0, 1)
    found, cause, _ = clearance_among(span, shapes, crowd_of(shapes, 5), 0.65, -np.inf)
    assert (found, cause) == (pytest.approx(-0.5 * thick_m, abs=ALIKE_M), 2)
    assert found <= -0.5 * thick_m + 1e-4


@given(seed=st.integers(0, 10_000), thick_m=st.sampled_from([1e-4, 0.01, 0.3, 2.0]))
@settings(max_examples=60, deadline=None)
def test_what_is_flown_through_is_told_to_the_bit(seed, thick_m):
    """Large walls through a movement: some through its corners, some along it, some at places where
    a search could as well go the other way."""
    rng = np.random.default_rng(seed)
    corners = np.linspace([0, 0, 0], [1, 0, 0], 5) if seed % 2 else movement(rng)
    told = []
    for _ in range(FEW - 10):
        q, share = rng.integers(4), rng.choice([0.0, 0.5, 0.25, 1e-7, rng.uniform(-0.5, 1.5)])
        turn = rng.normal(size=3) * rng.choice([0.0, 1e-9, 1.0])
        place = corners[q] + share * (corners[q + 1] - corners[q])
        size = np.roll([thick_m, rng.uniform(3, 40), rng.uniform(0.5, 40)], rng.integers(3))
        told.append(
            Obstacle.cuboid(
                place, tuple(size), radius_m=rng.choice([0.0, 0.05]), orientation_rad=turn
            )
        )
    told += [Obstacle.ball([0, 0, 9.0], 0.1)] * 20  # Many, but few of them matter.
    shapes, span = shapes_of(told), make_span(corners, 0, 1)
    expected = shapes_clearance(span, shapes, 0.65, -np.inf)
    found = clearance_among(span, shapes, crowd_of(shapes, 5), 0.65, -np.inf)
    assert left(span, shapes, 0.65) <= FEW < len(shapes.radius_m)
    assert found == expected


@given(seed=st.integers(0, 10_000))
@settings(max_examples=100, deadline=None)
def test_no_point_of_a_movement_is_nearer_than_the_box_around_it(seed):
    rng = np.random.default_rng(seed)
    shapes, corners = crowd(rng, 8, 2.0, 10.0), movement(rng)
    shares = np.linspace(0.0, 1.0, 20)[:, None]
    points = np.concatenate([a + shares * (b - a) for a, b in itertools.pairwise(corners)])
    for s in range(8):
        nearest = min(shape_distance(*point, shapes, s) for point in points)
        assert bound(corners, shapes, s) <= nearest + ROUNDING_M


def test_the_box_around_a_movement_is_tight_beside_a_wall():
    wall = shapes_of([Obstacle.cuboid([2.0, 0.0, 0.0], (0.2, 40.0, 40.0), radius_m=0.1)])
    corners = np.linspace([0, 0, 0], [1, 0.5, 0.3], 5)
    assert bound(corners, wall, 0) == pytest.approx(0.8)
