"""Clearances of movements and of circles from shapes, against looking everywhere."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.clear.chord_distance import TERNARY_STEPS, shape_chord_distance
from clearway.avoidance.clear.clearance import (
    CIRCLE_SAMPLES,
    circle_clearance,
    make_span,
    points_clearance,
    shapes_clearance,
)
from clearway.avoidance.clear.hazards import bin_points
from clearway.obstacles.obstacle import Obstacle, shape_distance, shapes_of

UP = np.array([-np.sin(0.1), 0.0, np.cos(0.1)])
NO_BINS = bin_points(np.zeros((0, 3)), np.zeros(0))


def scattered(rng, count):
    """Balls, lines and boxes anywhere within some metres."""
    made = []
    for n in range(count):
        place, turn, size = rng.uniform(-5, 5, 3), rng.uniform(-3, 3, 3), rng.uniform(0.1, 3, 3)
        made.append(
            (
                Obstacle.ball(place, size[0]),
                Obstacle.line(place, size[0], radius_m=0.1, orientation_rad=turn),
                Obstacle.cuboid(place, tuple(size), orientation_rad=turn),
            )[n % 3]
        )
    return shapes_of(made)


def nearest_by_all_cuts(corners, shapes, s):
    """Distance of a way to one shape, by all cuts of every chord."""
    nearest = np.inf
    for a, b in itertools.pairwise(corners):

        def away(share, a=a, b=b):
            return shape_distance(*(a + share * (b - a)), shapes, s)

        low, high = 0.0, 1.0
        for _ in range(TERNARY_STEPS):
            first, second = low + (high - low) / 3.0, high - (high - low) / 3.0
            low, high = (low, second) if away(first) < away(second) else (first, high)
        nearest = min(nearest, away(0.0), away(1.0), away(0.5 * (low + high)))
    return nearest


def segment_distance(a, b, c, d):
    """Between segments a-b and c-d: the best of their ends and of where their lines pass."""

    def to_segment(point, start, end):
        along = end - start
        share = np.clip((point - start) @ along / (along @ along), 0.0, 1.0) if any(along) else 0.0
        return float(np.linalg.norm(point - start - share * along))

    found = [to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)]
    lines = np.stack([b - a, c - d], axis=1)
    if np.linalg.matrix_rank(lines, tol=1e-9) == 2:
        shares = np.linalg.lstsq(lines, c - a, rcond=None)[0]
        if np.all((shares >= 0.0) & (shares <= 1.0)):
            found.append(float(np.linalg.norm(lines @ shares - (c - a))))
    return min(found)


def nearest_of_all_chords(corners, shapes, s):
    """Distance of a way to one shape: exact for balls and lines, by all cuts for boxes."""
    half = shapes.half_m[s]
    if np.count_nonzero(half) > 1:
        return nearest_by_all_cuts(corners, shapes, s)
    reach = shapes.rotation[s] @ half
    ends = shapes.center_m[s] - reach, shapes.center_m[s] + reach
    chords = itertools.pairwise(corners)
    return min(segment_distance(a, b, *ends) for a, b in chords) - shapes.radius_m[s]


@pytest.mark.parametrize("seed", range(8))
def test_a_movement_is_as_far_from_shapes_as_all_cuts_of_all_chords_say(seed):
    rng = np.random.default_rng(seed)
    shapes = scattered(rng, 12)
    corners = np.cumsum(rng.uniform(-0.6, 0.6, (5, 3)), axis=0)
    each = np.array([nearest_of_all_chords(corners, shapes, s) for s in range(12)])
    span = make_span(corners, 0.0, 1.0)
    for enough in (0.3, 2.0, 10.0):
        found, cause, index = shapes_clearance(span, shapes, enough, -np.inf)
        if each.min() < enough:
            assert (found, cause, index) == (pytest.approx(each.min(), abs=1e-12), 2, each.argmin())
        else:
            assert (found, cause, index) == (enough, 0, -1)


ON_A_LATTICE = st.lists(st.integers(-2, 2), min_size=3, max_size=3)
ANYWHERE = st.lists(st.floats(-3.0, 3.0).map(lambda x: round(x, 3)), min_size=3, max_size=3)


@given(
    a=st.one_of(ON_A_LATTICE, ANYWHERE),
    b=st.one_of(ON_A_LATTICE, ANYWHERE),
    turn=st.one_of(st.just([0.0, 0.0, 0.0]), ANYWHERE),
    length=st.one_of(st.just(2.0), st.floats(0.01, 5.0)),
    axis=st.integers(0, 2),
)
@settings(max_examples=300, deadline=None)
def test_chords_and_capsules_are_as_far_apart_as_two_segments_less_the_radius(
    a, b, turn, length, axis
):
    """Crossing, parallel, one inside the other, shrunk to a point; whichever axis is the long one,
    and balls."""
    a, b = np.array(a, float), np.array(b, float)
    capsule = shapes_of(
        [Obstacle.line([0.5, 0.0, 0.0], length, radius_m=0.3, orientation_rad=turn)]
    )
    half = np.roll(capsule.half_m, axis, axis=1)
    capsule = capsule._replace(half_m=half)
    reach = capsule.rotation[0] @ half[0]
    expected = segment_distance(a, b, capsule.center_m[0] - reach, capsule.center_m[0] + reach)
    found = shape_chord_distance(a, b, capsule, 0, np.inf)
    assert found == pytest.approx(expected - 0.3, abs=1e-7)
    ball = shapes_of([Obstacle.ball([0.5, 0.0, 0.0], 0.3)])
    expected = segment_distance(ball.center_m[0], ball.center_m[0], a, b)
    assert shape_chord_distance(a, b, ball, 0, np.inf) == pytest.approx(expected - 0.3, abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_a_circle_is_as_far_from_shapes_as_all_places_on_it_say(seed):
    rng = np.random.default_rng(seed)
    shapes, center, radius = scattered(rng, 12), rng.uniform(-2, 2, 3), rng.uniform(0.5, 3.0)
    angles = 2.0 * np.pi * np.arange(CIRCLE_SAMPLES) / CIRCLE_SAMPLES
    places = center + radius * np.cos(angles)[:, None] * np.array([UP[2], 0.0, -UP[0]])
    places[:, 1] += radius * np.sin(angles)
    spare = radius * np.pi / CIRCLE_SAMPLES
    each = np.array([min(shape_distance(*p, shapes, s) for p in places) for s in range(12)])
    for enough in (0.3, 2.0, 10.0):
        found, cause, index = circle_clearance(center, UP, radius, NO_BINS, shapes, enough)
        if each.min() - spare < enough:
            nearest = pytest.approx(each.min() - spare, abs=1e-12)
            assert (found, cause, index) == (nearest, 2, each.argmin())
        else:
            assert (found, cause, index) == (enough, 0, -1)


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.sampled_from([1, 40, 4000]),
    enough=st.sampled_from([0.1, 0.6, 5.0]),
)
@settings(max_examples=120, deadline=None)
def test_a_way_is_as_far_from_returns_as_the_nearest_of_them_says(seed, count, enough):
    """Among few, and in crowds that it leads through, or beside; stopped at what is nearer than
    asked, or told to the end."""
    rng = np.random.default_rng(seed)
    corners = np.cumsum(rng.normal(0.0, 0.4, (int(rng.integers(2, 7)), 3)), axis=0)
    places = rng.normal(0.0, rng.choice([0.5, 3.0, 8.0]), (count, 3)) + rng.choice([0.0, 4.0])
    radii = rng.uniform(0.0, rng.choice([0.05, 0.5]), count)
    starts, along = corners[:-1, None], np.diff(corners, axis=0)[:, None]
    shares = np.sum((places - starts) * along, axis=2) / np.sum(along**2, axis=2)
    off = places - starts - np.clip(shares, 0.0, 1.0)[..., None] * along
    each = np.sqrt(np.square(off).sum(axis=2)).min(axis=0) - radii
    span, bins = make_span(corners, 0.0, 1.0), bin_points(places, radii)
    found, cause, index = points_clearance(span, bins, enough, -np.inf)
    if each.min() < enough:
        assert (found, cause, index) == (pytest.approx(each.min(), abs=1e-9), 1, each.argmin())
    else:
        assert (found, cause, index) == (enough, 0, -1)
    stop = rng.uniform(-0.5, enough)
    stopped = points_clearance(span, bins, enough, stop)
    if each.min() < stop:
        assert stopped[0] < stop
        assert each[stopped[2]] <= stopped[0] + 1e-9
    else:
        assert stopped == (found, cause, index)


@pytest.mark.parametrize("beside_m", [0.5, 30.0])
@pytest.mark.parametrize("nearer_m", [1e-9, 0.005])
def test_what_lies_off_the_end_of_a_way_is_not_passed_over(beside_m, nearer_m):
    """Hardly nearer than another beside its middle, or than is asked, where nothing is about."""
    corners = np.linspace([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 5)
    enough = 0.6
    end_m = min(beside_m, enough + 0.1) - nearer_m
    places = np.array([[0.0, -beside_m, 0.0], [1.0 + end_m, 0.0, 0.0], [-20.0, -20.0, -20.0]])
    bins = bin_points(places, np.full(3, 0.1))
    found = points_clearance(make_span(corners, 0.0, 1.0), bins, enough, -np.inf)
    assert found == (pytest.approx(end_m - 0.1, abs=1e-12), 1, 1)


@given(
    seed=st.integers(0, 2**32 - 1),
    radius=st.sampled_from([0.5, 3.8, 40.0]),
    enough=st.sampled_from([0.1, 0.6, 5.0]),
)
@settings(max_examples=80, deadline=None)
def test_a_circle_is_as_far_from_returns_as_the_nearest_of_them_says(seed, radius, enough):
    """Among balls about it, above it, within it and without; some that it leads through, and one
    that is just near enough, or just not."""
    rng = np.random.default_rng(seed)
    center, count = rng.uniform(-2, 2, 3), int(rng.choice([1, 300]))
    places = center + rng.normal(0.0, rng.choice([0.3, 1.0]) * radius, (count, 3))
    radii = rng.uniform(0.0, rng.choice([0.1, 1.0]), count)
    ahead, left = np.array([UP[2], 0.0, -UP[0]]), np.array([0.0, 1.0, 0.0])
    round_it, about_it = rng.uniform(0.0, 2.0 * np.pi), rng.choice([0.0, 0.5, 1.0, 1.3]) * np.pi
    outwards = np.cos(round_it) * ahead + np.sin(round_it) * left
    off_m = rng.uniform(0.95, 1.02) * enough + radii[0]
    off = off_m * (np.cos(about_it) * outwards + np.sin(about_it) * UP)
    places[0] = center + radius * outwards + off
    found, cause, index = circle_clearance(
        center, UP, radius, bin_points(places, radii), shapes_of(()), enough
    )
    away = places - center
    height = away @ UP
    level = np.sqrt(np.maximum(0.0, np.square(away).sum(axis=1) - height**2))
    each = np.hypot(level - radius, height) - radii
    if each.min(initial=np.inf) < enough:
        assert (found, cause, index) == (pytest.approx(each.min(), abs=1e-9), 1, each.argmin())
    else:
        assert (found, cause, index) == (enough, 0, -1)
