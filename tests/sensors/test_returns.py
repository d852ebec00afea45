"""Returns in blocks, by tables of stand-ins, against each on its own by the rule of `grid`."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.compiled import read_only
from clearway.base.grid import AvoidanceGrid
from clearway.sensors.beams.binning import OUTSIDE, cell_at_border, cell_tables
from clearway.sensors.cells.return_block import BEYOND, GROUND, KEPT, OUTSIDE_GRID, Filters
from clearway.sensors.cells.returns import bin_returns

GRIDS = (
    AvoidanceGrid.uniform(),
    AvoidanceGrid.uniform((1.0, 8.0), 3, azimuth_deg=180.0, columns=12, elevation_deg=90.0, rows=6),
    AvoidanceGrid.uniform(
        100.0, 4, azimuth_deg=(-10.0, 100.0), columns=1, elevation_deg=(-90.0, 0.0), rows=2
    ),
    AvoidanceGrid(
        np.array([0.0, 0.5, 4.0]),
        np.array([-3.0, -0.1, 0.0, 2.0]),
        elevation_edges_rad=np.array([0.1, 1.5]),
    ),
)


def filters(ground: float = -np.inf, max_range: float = np.inf) -> Filters:
    here, up = read_only(np.zeros(3)), read_only(np.array([0.0, 0.0, 1.0]))
    return Filters(read_only(np.eye(3)), here, here, up, ground, 0.0, max_range, 0.0, 0.01)


def about_borders(grid: AvoidanceGrid, seed: int, count: int) -> np.ndarray:
    """Points of which any of the three coordinates may lie on a border, or about its tolerance."""
    rng = np.random.default_rng(seed)
    placed = []
    for edges in grid.edges:
        at = rng.choice(edges, count) + rng.choice([0.0, 1e-9, -1e-9, 1.5e-9, -1.5e-9, 1e-7], count)
        free = rng.random(count) < 0.6
        placed.append(np.where(free, rng.uniform(edges[0], edges[-1], count), at))
    distance, azimuth, elevation = placed
    level = distance * np.cos(elevation)
    points = [level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)]
    return np.stack(points, axis=1)


@pytest.mark.parametrize("grid", GRIDS, ids=repr)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_a_point_at_a_border_is_in_the_cell_of_the_exact_rule(grid, seed):
    points = about_borders(grid, seed, 300)
    tables = cell_tables(grid)
    found = [cell_at_border(x, y, z, tables) for x, y, z in points]
    expected = grid.cell_of(points)
    assert np.array_equal(found, np.where(expected < 0, OUTSIDE, expected))


@pytest.mark.parametrize("grid", GRIDS, ids=repr)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 1_500),
    outside=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
    has_ground=st.booleans(),
)
@settings(max_examples=20, deadline=None)
def test_returns_in_blocks_are_counted_as_one_by_one(grid, seed, count, outside, has_ground):
    """Whatever share of them is beside the grid, and in whatever order they come."""
    rng = np.random.default_rng(seed)
    points = about_borders(grid, seed, count)
    points[rng.random(count) < outside] *= rng.choice([-1.0, 3.0])
    points += 0.0  # As they are placed: the origin's azimuth is that of no negative zero.
    points = points[np.lexsort(points.T)] if seed % 2 else points
    low, far = -0.2 * grid.range_m if has_ground else -np.inf, 0.9 * grid.range_m
    found = bin_returns(read_only(points), filters(low, far), cell_tables(grid))

    squared = points[:, 0] ** 2 + points[:, 1] ** 2 + points[:, 2] ** 2
    ground = (squared <= far**2) & (points[:, 2] <= low)
    kept = (squared <= far**2) & ~ground
    cells = grid.cell_of(points)
    hit = kept & (cells >= 0)
    hits, sums = np.zeros(grid.cells, dtype=int), np.zeros(grid.cells)
    np.add.at(hits, cells[hit], 1)
    np.add.at(sums, cells[hit], squared[hit])
    assert np.array_equal(found.hits, hits)
    assert np.array_equal(found.squared_ranges_m2, sums)
    counted = found.counts
    assert counted[GROUND] == np.count_nonzero(ground)
    assert counted[BEYOND] == np.count_nonzero(squared > far**2)
    assert counted[KEPT] == np.count_nonzero(kept)
    assert counted[OUTSIDE_GRID] == np.count_nonzero(kept & (cells < 0))
