"""Coating: a superset of what sampling finds, no larger than the distance allows; thinning."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.grid import RANGE_TOLERANCE, AvoidanceGrid
from clearway.sensors import inflate_points, thin_points

GRIDS = {
    "standard": AvoidanceGrid.uniform(),
    "all round": AvoidanceGrid.uniform(
        12.0, 5, azimuth_deg=180.0, columns=8, elevation_deg=90.0, rows=6
    ),
    "narrow": AvoidanceGrid.uniform(
        (2.0, 9.0), 4, azimuth_deg=(10.0, 40.0), columns=3, elevation_deg=(-50.0, -5.0), rows=4
    ),
    "wide cells": AvoidanceGrid.uniform(
        (2.0, 9.0), 4, azimuth_deg=(-150.0, 150.0), columns=1, elevation_deg=(-50.0, 5.0), rows=4
    ),
    "many layers": AvoidanceGrid.uniform(
        12.0, 130, azimuth_deg=60.0, columns=3, elevation_deg=30.0, rows=2
    ),
}


def cell_distances(grid: AvoidanceGrid, point: np.ndarray) -> np.ndarray:
    """[cells] distance to the nearest of 9^3 samples of each cell, borders included."""
    steps = np.linspace(0.0, 1.0, 9)
    axes = [
        edges[:-1, None] + np.diff(edges)[:, None] * steps
        for edges in (grid.range_edges_m, grid.azimuth_edges_rad, grid.elevation_edges_rad)
    ]
    r = axes[0][:, None, None, :, None, None]
    az = axes[1][None, :, None, None, :, None]
    el = axes[2][None, None, :, None, None, :]
    x, y, z = r * np.cos(el) * np.cos(az), r * np.cos(el) * np.sin(az), r * np.sin(el)
    squared = (x - point[0]) ** 2 + (y - point[1]) ** 2 + (z - point[2]) ** 2
    return np.sqrt(squared.reshape(grid.cells, -1).min(axis=1))


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(sorted(GRIDS)),
    point=st.tuples(*[st.floats(-13.0, 13.0)] * 3),
    radius=st.floats(0.01, 4.0),
)
def test_coating_is_what_the_distance_says(name, point, radius):
    grid = GRIDS[name]
    sampled = cell_distances(grid, np.array(point))
    coated = inflate_points(grid, np.array([point]), radius)
    assert np.all(coated[sampled <= radius])
    # Samples lie at most half a step diagonal from the cell's nearest point.
    step_m = max(
        np.diff(grid.range_edges_m).max() / 8,
        grid.range_m * np.diff(grid.azimuth_edges_rad).max() / 8,
        grid.range_m * np.diff(grid.elevation_edges_rad).max() / 8,
    )
    assert not np.any(coated[sampled > radius + 0.5 * np.sqrt(3.0) * step_m])


def test_ball_around_the_vehicle_coats_the_first_layers_all_round():
    grid = GRIDS["standard"]
    coated = inflate_points(grid, np.zeros((1, 3)), 1.5).reshape(grid.shape)
    assert coated[:2].all()
    assert not coated[2:].any()


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(sorted(GRIDS)),
    seed=st.integers(0, 2**32 - 1),
    count=st.sampled_from([2, 30, 400]),
    largest_m=st.sampled_from([0.1, 0.7, 3.0]),
)
def test_several_points_coat_the_union(name, seed, count, largest_m):
    """In any order: what has nothing to add to those before is passed over."""
    grid, rng = GRIDS[name], np.random.default_rng(seed)
    points = rng.normal(0.0, rng.choice([1.0, 5.0]), (count, 3))
    radii = rng.uniform(0.01, largest_m, count)
    each = [inflate_points(grid, points[n : n + 1], radii[n]) for n in range(count)]
    order = rng.permutation(count)
    together = inflate_points(grid, points[order], radii[order])
    np.testing.assert_array_equal(together, np.any(each, axis=0))


@pytest.mark.parametrize("layers", [10, 62, 63, 130])
def test_a_small_ball_coats_the_cell_that_it_lies_in(layers):
    grid = AvoidanceGrid.uniform(
        12.0, layers, azimuth_deg=60.0, columns=3, elevation_deg=30.0, rows=2
    )
    middles = [
        edges[:-1] + 0.5 * np.diff(edges)
        for edges in (grid.range_edges_m, grid.azimuth_edges_rad, grid.elevation_edges_rad)
    ]
    for cell in range(grid.cells):
        r, az, el = (
            middle[n] for middle, n in zip(middles, np.unravel_index(cell, grid.shape), strict=True)
        )
        point = r * np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
        coated = inflate_points(grid, point[None], 1e-3 * grid.range_m / layers)
        assert np.flatnonzero(coated).tolist() == [cell]


def test_the_border_of_what_fits_a_number_is_one_like_any_other():
    """Layers are marked 62 at a time; a ball that touches their end by rounding alone does so."""
    grid = AvoidanceGrid.uniform(63.0, 63, azimuth_deg=20.0, columns=1, elevation_deg=20.0, rows=1)
    radius, az, el = 0.52, -0.23, 0.07
    along = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    away = 62.0 + radius + RANGE_TOLERANCE * grid.range_m
    coated = inflate_points(grid, away * along[None], radius)
    assert np.flatnonzero(coated).tolist() == [61, 62]


def test_nothing_coats_nothing():
    assert not inflate_points(GRIDS["standard"], np.zeros((0, 3)), 0.6).any()
    points, radii = thin_points(np.zeros((0, 3)), np.zeros(0), 0.5)
    assert points.shape == (0, 3)
    assert radii.shape == (0,)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 300),
    voxel=st.floats(0.05, 5.0),
)
def test_thinned_balls_cover_every_ball(seed, count, voxel):
    rng = np.random.default_rng(seed)
    points, radii = rng.normal(0.0, 3.0, (count, 3)), rng.uniform(0.0, 0.3, count)
    kept, grown = thin_points(points, radii, voxel)
    assert len(kept) == len(np.unique(np.floor(points / voxel), axis=0))
    reach = np.linalg.norm(points[:, None] - kept, axis=-1) + radii[:, None]
    assert np.all((reach <= grown + 1e-9).any(axis=1))
    assert np.all(grown <= radii.max() + np.sqrt(3.0) * voxel)


def test_single_points_stay_as_they_are():
    points = np.array([[0.1, 0.1, 0.1], [5.3, -2.7, 1.9]])
    kept, grown = thin_points(points, 0.2, 0.5)
    np.testing.assert_array_equal(kept, points)
    np.testing.assert_array_equal(grown, [0.2, 0.2])
