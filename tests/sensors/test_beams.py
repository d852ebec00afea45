"""Beam patterns: directions, beams per column, sensors on sale, estimates from measured scans."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.frames import (
    cartesian_from_spherical,
    spherical_from_cartesian,
    world_from_body,
)
from clearway.base.grid import AvoidanceGrid
from clearway.sensors import BeamPattern, estimate_pattern, find_pattern
from clearway.sensors.beams.binning import count_beams


def beams_by_grid(grid: AvoidanceGrid, directions: np.ndarray) -> np.ndarray:
    """Beams per column by the grid's own rule, for a radius inside the grid."""
    middle = 0.5 * (grid.range_edges_m[0] + grid.range_edges_m[-1])
    cells = grid.cell_of(directions * middle)
    columns = grid.columns * grid.rows
    return np.bincount(cells[cells >= 0] % columns, minlength=columns)


def test_directions_are_unit_vectors_at_the_stated_angles():
    pattern = BeamPattern.from_angles(np.radians([-30, 0, 120]), np.radians([-80, 10]))
    spherical = spherical_from_cartesian(pattern.directions)
    np.testing.assert_allclose(spherical[:, 0], 1.0)
    np.testing.assert_allclose(np.degrees(spherical[:, 1]), [-30, -30, 0, 0, 120, 120], atol=1e-12)
    np.testing.assert_allclose(np.degrees(spherical[:, 2]), [-80, 10] * 3)


def test_per_cell_pattern_has_the_same_beams_in_every_column():
    grid = AvoidanceGrid.uniform()
    pattern = BeamPattern.per_cell(grid)
    assert pattern.beams == 7000
    assert set(count_beams(grid, pattern, np.eye(3)).tolist()) == {200}
    # Rows are 12 deg high in 10 parts, columns 90/7 deg wide in 20: the wider step counts.
    assert pattern.spacing_rad == pytest.approx(np.radians(1.2))


def test_per_cell_pattern_follows_uneven_edges():
    grid = AvoidanceGrid(
        np.array([0.0, 2.0, 9.0]),
        np.radians([-170.0, -20.0, -10.0, 60.0]),
        elevation_edges_rad=np.radians([-85.0, 0.0, 5.0]),
    )
    pattern = BeamPattern.per_cell(grid, 3, elevations_per_cell=4)
    np.testing.assert_array_equal(count_beams(grid, pattern, np.eye(3)), np.full(6, 12))


def test_rotating_pattern_covers_its_span_evenly():
    pattern = BeamPattern.rotating([-1.0, 1.0], 0.5, azimuth_span_deg=90.0)
    azimuths = np.unique(np.degrees(pattern.azimuth_rad))
    assert pattern.beams == 360
    assert azimuths[0] == pytest.approx(-44.75)
    assert azimuths[-1] == pytest.approx(44.75)


@settings(max_examples=30, deadline=None)
@given(
    attitude=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    azimuth=st.sampled_from([45.0, 90.0, 180.0]),
    elevation=st.sampled_from([30.0, 90.0]),
)
def test_rotated_beams_are_counted_as_the_grid_counts_points(attitude, azimuth, elevation):
    grid = AvoidanceGrid.uniform(
        10.0, 3, azimuth_deg=azimuth, columns=8, elevation_deg=elevation, rows=5
    )
    pattern = BeamPattern.rotating(np.linspace(-60.0, 60.0, 13), 7.5)
    rotation = world_from_body(attitude)
    np.testing.assert_array_equal(
        count_beams(grid, pattern, rotation), beams_by_grid(grid, pattern.directions @ rotation.T)
    )


@pytest.mark.parametrize("columns", [6, 7, 8])
def test_beams_on_borders_fall_where_the_grid_puts_them(columns):
    grid = AvoidanceGrid.uniform(
        10.0, 10, azimuth_deg=45.0, columns=columns, elevation_deg=30.0, rows=5
    )
    pattern = BeamPattern.from_angles(grid.azimuth_edges_rad, grid.elevation_edges_rad)
    counts = count_beams(grid, pattern, np.eye(3))
    np.testing.assert_array_equal(counts, beams_by_grid(grid, pattern.directions))
    assert counts.sum() == pattern.beams


def test_behind_the_vehicle_all_azimuths_of_pi_are_inside():
    grid = AvoidanceGrid.uniform(10.0, 2, azimuth_deg=180.0, columns=4, elevation_deg=30.0, rows=1)
    pattern = BeamPattern.from_angles([np.pi, -np.pi], [0.0])
    assert count_beams(grid, pattern, np.eye(3)).sum() == 2


@pytest.mark.parametrize(
    ("name", "beams", "lowest_deg", "highest_deg"),
    [
        ("vlp16", 16 * 1800, -15.0, 15.0),
        ("vls128", 128 * 1800, -25.0, 15.0),
        ("os1-128", 128 * 1024, -22.5, 22.5),
        ("os0-128", 128 * 1024, -45.0, 45.0),
    ],
)
def test_sensors_on_sale(name, beams, lowest_deg, highest_deg):
    pattern = find_pattern(name)
    assert pattern.beams == beams
    assert np.degrees(pattern.elevation_rad.min()) == pytest.approx(lowest_deg)
    assert np.degrees(pattern.elevation_rad.max()) == pytest.approx(highest_deg)
    assert 0.0 < pattern.min_range_m < pattern.max_range_m < np.inf


def test_unknown_sensor_lists_the_known_ones():
    with pytest.raises(ClearwayError, match=r"'hdl32'.*vlp16, vls128, os1-128, os0-128"):
        find_pattern("hdl32")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"azimuth_rad": [], "elevation_rad": []}, "at least one"),
        ({"azimuth_rad": [0.0, 1.0], "elevation_rad": [0.0]}, "as many elevations"),
        ({"azimuth_rad": [np.nan], "elevation_rad": [0.0]}, "azimuth_rad must be finite"),
        (
            {"azimuth_rad": [0.0], "elevation_rad": [0.0], "min_range_m": 3.0, "max_range_m": 2.0},
            "min_range_m < max_range_m",
        ),
        ({"azimuth_rad": [0.0], "elevation_rad": [0.0], "spacing_rad": -1.0}, "spacing_rad"),
    ],
)
def test_impossible_patterns_are_refused(arguments, message):
    with pytest.raises(ClearwayError, match=message):
        BeamPattern("broken", **arguments)


def test_impossible_constructions_are_refused():
    with pytest.raises(ClearwayError, match="azimuth_step_deg"):
        BeamPattern.rotating([0.0], 0.0)
    with pytest.raises(ClearwayError, match="at least one azimuth"):
        BeamPattern.per_cell(AvoidanceGrid.uniform(), 0)


def scan_of(pattern: BeamPattern, seed: int = 0, share: float = 1.0) -> np.ndarray:
    """Returns of a share of the beams at random ranges."""
    rng = np.random.default_rng(seed)
    kept = rng.random(pattern.beams) < share
    return pattern.directions[kept] * rng.uniform(2.0, 40.0, (np.count_nonzero(kept), 1))


@pytest.mark.parametrize("name", ["vlp16", "vls128", "os1-128", "os0-128"])
def test_sensors_on_sale_are_recognised(name):
    stated = find_pattern(name)
    guess = estimate_pattern(scan_of(stated, share=0.8))
    assert guess.name.startswith(f"estimated: {name} recognised")
    assert guess.beams == pytest.approx(stated.beams, rel=0.01)
    assert (guess.min_range_m, guess.max_range_m) == (stated.min_range_m, stated.max_range_m)


def test_rings_of_an_unknown_sensor_are_found():
    stated = BeamPattern.from_angles(
        np.radians(np.arange(-60.0, 60.1, 0.4)), np.radians([-31.0, -17.0, -4.0, 3.0, 22.0])
    )
    guess = estimate_pattern(scan_of(stated, share=0.9))
    assert "5 rings, azimuth step 0.4 deg, azimuth -60 to 60 deg" in guess.name
    assert guess.beams == pytest.approx(stated.beams, abs=10)
    np.testing.assert_allclose(
        np.unique(guess.elevation_rad), np.unique(stated.elevation_rad), atol=1e-6
    )


def test_a_field_of_view_across_the_rear_is_found():
    stated = BeamPattern.from_angles(np.radians(np.arange(120.0, 240.1, 1.0)), np.radians([0, 5]))
    guess = estimate_pattern(scan_of(stated))
    assert guess.beams == stated.beams
    np.testing.assert_allclose(guess.directions.min(axis=0), stated.directions.min(axis=0))


@pytest.mark.parametrize(("count", "seed"), [(300, 0), (20_000, 1)])
def test_scattered_returns_get_a_raster_as_dense(count, seed):
    rng = np.random.default_rng(seed)
    azimuth, elevation = np.radians(rng.uniform([-40, -20], [40, 25], (count, 2))).T
    spherical = np.stack([rng.uniform(3.0, 30.0, count), azimuth, elevation], axis=-1)
    guess = estimate_pattern(cartesian_from_spherical(spherical))
    assert "no rings found, raster of" in guess.name
    assert guess.beams == pytest.approx(count, rel=0.35)
    assert np.degrees(guess.azimuth_rad.min()) == pytest.approx(-40, abs=1)
    assert np.degrees(guess.elevation_rad.max()) == pytest.approx(25, abs=1)


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_a_few_returns_give_some_pattern(count):
    points = np.random.default_rng(count).normal(0.0, 5.0, (count, 3))
    assert estimate_pattern(points).beams >= 1


def test_bad_points_are_left_out_and_nothing_else_is_refused():
    points = scan_of(find_pattern("vlp16"))
    spoilt = np.concatenate([points, [[np.nan, 0, 0], [np.inf, 1, 1], [0, 0, 0]]])
    assert estimate_pattern(spoilt).name == estimate_pattern(points).name
    with pytest.raises(ClearwayError, match="no point is finite"):
        estimate_pattern(np.full((3, 3), np.nan))


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("vlp16_1673400472138016708.pcd", "vlp16 recognised by 15 of 16 rings"),
        ("vls128_1585897255376374245.pcd", "vls128 recognised by 127 of 128 rings"),
    ],
)
def test_real_scans_are_recognised(data_dir, file, name):
    pypcd4 = pytest.importorskip("pypcd4")
    cloud = pypcd4.PointCloud.from_path(data_dir / "lidar" / "pcd" / file)
    points = cloud.numpy(("x", "y", "z")).astype(np.float64)
    guess = estimate_pattern(points)
    assert name in guess.name
    assert "azimuth step 0.2 deg measured, full turn assumed" in guess.name
    assert guess.beams > len(points)


@pytest.mark.parametrize("beams", [(20, 2**31), (2**62, 1)])
def test_more_beams_than_there_is_room_for_are_refused(beams):
    with pytest.raises(ClearwayError, match="beams; at most 5,000,000"):
        BeamPattern.per_cell(AvoidanceGrid.uniform(), beams[0], elevations_per_cell=beams[1])
    with pytest.raises(ClearwayError, match="at most"):
        BeamPattern.from_angles(np.zeros(5000), np.zeros(5000))
