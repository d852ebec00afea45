"""Columns: rays and distances against geometry of the test's own, and what a map makes of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.obstacles.columns import Columns
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar
from clearway.sensors.beams.simulate import simulate_scan

Array = npt.NDArray[np.float64]


def distances_to(points: Array, rows: Array, ground: float) -> Array:
    """The test's own: the least of the ways to the flat-ended cylinders and down to the ground."""
    x, y, radius, low, high = rows.T
    east, north, up = points[:, :, None].transpose(1, 0, 2)
    beside = np.hypot(east - x, north - y) - radius
    above = np.maximum(low - up, up - high)
    inside = (beside <= 0.0) & (above <= 0.0)
    outside = np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
    found = np.where(inside, np.maximum(beside, above), outside)
    return np.minimum(found.min(axis=1, initial=np.inf), points[:, 2] - ground)


def first_met(origin: Array, ways: Array, rows: Array, ground: float, far: float) -> Array:
    """The test's own: steps as long as what is surely free, until something is met."""
    at, met = np.zeros(len(ways)), np.full(len(ways), np.inf)
    under_way = np.arange(len(ways))
    while len(under_way):
        here = at[under_way]
        free = distances_to(origin + here[:, None] * ways[under_way], rows, ground)
        ends = free < 1e-7
        met[under_way[ends]] = here[ends]
        at[under_way] += free
        under_way = under_way[~ends & (at[under_way] <= far)]
    return met


def some_columns(seed: int, count: int) -> Array:
    rng = np.random.default_rng(seed)
    rows = rng.uniform([-15, -15, 0.05, -3, 0], [15, 15, 2.0, 0, 6], (count, 5))
    rows[:, 4] = np.maximum(rows[:, 4], rows[:, 3] + 0.1)
    return rows


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 40),
    ground=st.sampled_from([-np.inf, -3.0, -1.0]),
    sweep=st.booleans(),
)
def test_rays_and_distances_are_those_worked_out_step_by_step(
    seed: int, count: int, ground: float, sweep: bool
) -> None:
    rng, rows = np.random.default_rng(seed), some_columns(seed, count)
    world = Columns(rows, ground_m=ground)
    probes = rng.uniform(-18.0, 18.0, (30, 3)) * [1.0, 1.0, 0.4]
    expected = distances_to(probes, rows, ground)
    np.testing.assert_allclose(world.distance_m(probes), expected, atol=1e-9)
    outside = probes[expected > 0.01][:2]
    for origin in outside:
        if sweep:
            # As a scanner lists its beams: azimuth by azimuth, tilted anyhow.
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            ways = BeamPattern.rotating(np.linspace(-40, 40, 9), 15.0).directions @ turn
        else:
            ways = rng.normal(size=(60, 3))
            ways[:20, rng.integers(3)] = 0.0
            ways[0] = [0.0, 0.0, -1.0]
            ways /= np.linalg.norm(ways, axis=1)[:, None]
        found = world.cast(origin, ways, 20.0)
        wanted = first_met(origin, ways, rows, ground, 20.0)
        # A ray that grazes a side may be counted either way.
        grazed = np.isinf(found) != np.isinf(wanted)
        assert np.count_nonzero(grazed) <= 1
        np.testing.assert_allclose(found[~grazed], wanted[~grazed], atol=2e-3)


def test_a_ray_from_inside_returns_zero_and_none_goes_backwards() -> None:
    world = Columns([[5.0, 0.0, 1.0, 0.0, 4.0]])
    ahead = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(world.cast([5.0, 0.2, 1.0], ahead, 9.0), [0.0, 0.0])
    np.testing.assert_array_equal(world.cast([0.0, 0.0, 1.0], ahead, 9.0), [4.0, np.inf])
    np.testing.assert_array_equal(world.cast([0.0, 0.0, 1.0], ahead, 3.9), [np.inf, np.inf])
    np.testing.assert_array_equal(world.cast([0.0, 0.0, 4.1], ahead, 9.0), [np.inf, np.inf])


def test_a_map_of_columns_holds_them() -> None:
    rows = some_columns(3, 25)
    world = Columns(rows, ground_m=-3.0)
    probes = np.random.default_rng(3).uniform([-18.0, -18.0, -3.0], [18.0, 18.0, 9.0], (400, 3))
    charted = ObstacleMap(world.charted)
    assert np.all(charted.distance_m(probes) <= world.distance_m(probes) + 1e-9)


def test_moved_columns_are_as_far_from_moved_places() -> None:
    world = Columns(some_columns(5, 20), ground_m=-2.0)
    shift, yaw = np.array([12.0, -40.0, 7.0]), 0.8
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    probes = np.random.default_rng(5).uniform(-15.0, 15.0, (50, 3))
    moved = world.move(shift, yaw)
    np.testing.assert_allclose(
        moved.distance_m(shift + probes @ turn.T), world.distance_m(probes), atol=1e-9
    )


@pytest.mark.parametrize(
    "row", [[0, 0, 0, 0, 1], [0, 0, -1, 0, 1], [0, 0, 1, 1, 1], [0, np.nan, 1, 0, 1]]
)
def test_what_is_no_column_is_refused_with_its_row(row: list[float]) -> None:
    with pytest.raises(ClearwayError, match="row 1"):
        Columns([[0.0, 0.0, 1.0, 0.0, 1.0], row])


@pytest.mark.parametrize("every", [95, pytest.param(19, marks=pytest.mark.nightly)])
def test_a_scan_among_columns_has_what_brute_force_finds(every: int) -> None:
    """Hundreds of columns on level ground, a turned and tilted scanner: no return is missed."""
    rng = np.random.default_rng(7)
    rows = np.column_stack(
        [
            rng.uniform(-40, 40, (300, 2)),
            rng.uniform(0.1, 0.6, 300),
            np.zeros(300),
            rng.uniform(1.0, 8.0, 300),
        ]
    )
    world = Columns(rows, ground_m=0.0)
    pattern = BeamPattern.from_angles(
        np.radians(np.arange(-179.5, 180.0, 4.0)),
        np.radians(np.arange(-24.5, 25.0)),
        max_range_m=30.0,
    )
    state = State(np.array([0.3, -0.2, 1.5]), np.array([0.1, -0.2, 1.1]))
    assert world.distance_m(state.position_m[None])[0] > 0.1
    scan = simulate_scan(Lidar("lidar", pattern), world, state)
    ways = pattern.directions @ state.world_from_body.T
    wanted = first_met(state.position_m, ways[::every], rows, 0.0, 30.0)
    found = world.cast(state.position_m, ways, 30.0)
    assert len(scan.points_m) == np.isfinite(found).sum()
    assert np.count_nonzero(np.isinf(found[::every]) != np.isinf(wanted)) <= 2 * 19 // every
    both = np.isfinite(found[::every]) & np.isfinite(wanted)
    np.testing.assert_allclose(found[::every][both], wanted[both], atol=2e-3)
