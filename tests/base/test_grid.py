"""The avoidance grid: borders, volumes, errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.frames import cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid

GRID = AvoidanceGrid.uniform()


def cell(grid, i, j, k):
    return (i * grid.columns + j) * grid.rows + k


def at(distance, azimuth_deg=0.0, elevation_deg=0.0):
    return cartesian_from_spherical([distance, *np.radians([azimuth_deg, elevation_deg])])


def test_standard_grids():
    assert GRID.shape == (10, 7, 5)
    assert AvoidanceGrid.uniform(15.0, 15).cells == 525


def test_index_order_is_layer_column_row():
    assert GRID.cell_of(at(9.5, 44.0, -29.0)) == cell(GRID, 9, 6, 0)
    assert GRID.cell_of(at(0.5, -44.0, 29.0)) == cell(GRID, 0, 0, 4)


@given(st.integers(1, 10), st.floats(-0.9e-9, 0.9e-9))
def test_a_layer_border_belongs_to_the_nearer_layer(border, off):
    assert GRID.cell_of(at(border + off, 1.0, 1.0)) == cell(GRID, border - 1, 3, 2)


@given(st.integers(1, 6), st.floats(-0.9e-9, 0.9e-9))
def test_an_azimuth_border_belongs_to_the_cell_nearer_the_axis(border, off):
    edge = GRID.azimuth_edges_rad[border]
    column = border if edge < 0 else border - 1
    point = cartesian_from_spherical([5.0, edge + off, 0.0])
    assert GRID.cell_of(point) == cell(GRID, 4, column, 2)


def test_outer_borders_are_closed_and_beyond_is_outside():
    np.testing.assert_array_equal(
        GRID.cell_of([at(10.0, 45.0, 30.0), at(10.0, -45.0, -30.0)]),
        [cell(GRID, 9, 6, 4), cell(GRID, 9, 0, 0)],
    )
    outside = [at(10.001), at(5.0, 45.001), at(5.0, 0.0, -30.001), [np.nan, 0, 0], [np.inf, 0, 0]]
    np.testing.assert_array_equal(GRID.cell_of(outside), -1)


def test_even_counts_break_the_tie_left_and_up():
    even = AvoidanceGrid.uniform(columns=6, rows=4)
    for point in ([5.0, 0.0, 0.0], [5.0, -1e-10, -1e-10], [5.0, 1e-10, 1e-10]):
        assert even.cell_of(point) == cell(even, 4, 3, 2)


def test_volumes_fill_the_sector():
    solid_angle = np.pi / 2 * 2 * np.sin(np.pi / 6)
    assert GRID.volumes_m3.sum() == pytest.approx(1000.0 / 3.0 * solid_angle)


def test_volume_agrees_with_sampling():
    rng = np.random.default_rng(1)
    box = rng.uniform([0, -8, -6], [10, 8, 6], (400_000, 3))
    cells = GRID.cell_of(box)
    chosen = cell(GRID, 8, 2, 1)
    share = np.mean(cells == chosen) * 10 * 16 * 12
    assert share == pytest.approx(GRID.volumes_m3[chosen], rel=0.05)


def test_patch_area(known_answers):
    for case in known_answers["patch_area_5_44"]:
        grid = AvoidanceGrid(
            np.array([0.0, 1.0]),
            np.array([case["t0"], case["t1"]]),
            elevation_edges_rad=np.array([case["p0"], case["p1"]]),
        )
        assert grid.patch_area_m2(case["r"])[0, 0] == pytest.approx(case["A"], rel=1e-8)


@given(st.lists(st.floats(0.1, 5.0), min_size=1, max_size=8))
def test_every_cell_holds_its_centre(steps):
    grid = AvoidanceGrid(
        np.concatenate([[0.5], 0.5 + np.cumsum(steps)]),
        np.radians([-170.0, -20.0, 3.0, 100.0]),
        elevation_edges_rad=np.radians([-80.0, 0.0, 10.0]),
    )
    np.testing.assert_array_equal(grid.cell_of(grid.centers_m), np.arange(grid.cells))


@pytest.mark.parametrize(
    ("edges", "said"),
    [
        (([0.0, 1.0, 1.0], [0.0, 1.0], [0.0, 1.0]), "range_edges_m: edges must ascend"),
        (([0.0, 1.0], [0.0, 4.0], [0.0, 1.0]), "azimuth_edges_rad: edges must lie within"),
        (([0.0, 1.0], [0.0, 1.0], [0.0, np.nan]), "elevation_edges_rad: edges must be finite"),
        (([-1.0, 1.0], [0.0, 1.0], [0.0, 1.0]), "range_edges_m: edges must lie within"),
        (([1.0], [0.0, 1.0], [0.0, 1.0]), "range_edges_m: at least two edges"),
    ],
)
def test_impossible_grids_are_refused(edges, said):
    with pytest.raises(ClearwayError, match=said):
        AvoidanceGrid(*edges[:2], elevation_edges_rad=edges[2])


def test_an_infinite_range_is_refused_without_a_warning():
    with pytest.raises(ClearwayError, match="range_edges_m: edges must be finite"):
        AvoidanceGrid.uniform(np.inf)


def test_no_cells_are_refused():
    with pytest.raises(ClearwayError, match=r"columns: .* from 1 to 100,000 "):
        AvoidanceGrid.uniform(columns=0)
