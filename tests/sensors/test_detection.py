"""Detection: hits, P_OL, visibility, hit counts; poses; returns that are no obstacles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ball_world import BallWorld
from clearway.base.errors import ClearwayError
from clearway.base.frames import world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.sensors import (
    BeamPattern,
    Ground,
    Lidar,
    Mounting,
    Scan,
    combine_detections,
    compute_expected_hits,
    detect,
    detect_nothing,
    simulate_scan,
    swipe_area_m2,
    visibility,
)

GRID = AvoidanceGrid.uniform()
PATTERN = BeamPattern.per_cell(GRID, max_range_m=10.0)
LIDAR = Lidar("front", PATTERN)
HERE = State(np.zeros(3))
UNEVEN = AvoidanceGrid(
    np.array([0.5, 2.0, 3.0, 11.0]),
    np.radians([-180.0, -20.0, 0.0, 60.0, 180.0]),
    elevation_edges_rad=np.radians([-90.0, -3.0, 5.0, 90.0]),
)


def cell(layer: int, column: int, row: int, grid: AvoidanceGrid = GRID) -> int:
    return (layer * grid.columns + column) * grid.rows + row


def along(distance: float, azimuth_deg: float = 0.0, elevation_deg: float = 0.0) -> np.ndarray:
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    return distance * np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )


def test_two_balls_of_the_known_answers(known_answers):
    expected = {
        name: np.array(known_answers["lidar_scene"][name]).ravel()
        for name in ("hits", "P_OL", "P_V")
    }
    world = BallWorld.of(((5.0, 0.0, 0.0), 1.0), ((7.5, 1.5, 0.4), 1.0))
    found = detect(GRID, LIDAR, simulate_scan(LIDAR, world, HERE))
    np.testing.assert_array_equal(found.hits, expected["hits"])
    np.testing.assert_allclose(found.probability, expected["P_OL"], atol=1e-12)
    np.testing.assert_allclose(found.hindrance, expected["P_OL"], atol=1e-12)
    np.testing.assert_allclose(found.visibility, expected["P_V"], atol=1e-12)


def test_visibility_of_the_papers_example(known_answers):
    grid = AvoidanceGrid.uniform(10.0, 10, azimuth_deg=45.0, columns=1, elevation_deg=30.0, rows=1)
    hindrance = np.zeros(10)
    for time, (layer, share) in enumerate([(None, 0.0), (2, 0.25), (4, 0.15), (6, 0.20)]):
        if layer is not None:
            hindrance[layer] = share
        expected = known_answers["visibility_example"][f"t{time}"]
        seen = visibility(grid, hindrance, np.array([7]))
        np.testing.assert_allclose(seen, expected, atol=1e-12)
    np.testing.assert_allclose(seen, [1, 1, 1, 0.75, 0.75, 0.6, 0.6, 0.4, 0.4, 0.4], atol=1e-12)


def test_hit_counts_of_the_known_answers(known_answers):
    for case in known_answers["lidar_hit_formula_5_45"]:
        swipe = swipe_area_m2(case["r"], (-np.pi / 4, np.pi / 4), (-np.pi / 6, np.pi / 6))
        middle = GRID.patch_area_m2(case["r"])[3, 2]
        hits = compute_expected_hits(case["PS"], case["AO"], middle, swipe)
        assert hits == pytest.approx(case["value"], rel=1e-8)
    for case in known_answers["patch_area_5_44"]:
        area = swipe_area_m2(case["r"], (case["t0"], case["t1"]), (case["p0"], case["p1"]))
        assert area == pytest.approx(case["A"], rel=1e-8)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    grid=st.sampled_from(
        [
            GRID,
            UNEVEN,
            AvoidanceGrid.uniform(
                (1.0, 8.0), 7, azimuth_deg=90.0, columns=6, elevation_deg=80.0, rows=4
            ),
        ]
    ),
    count=st.integers(0, 1500),
)
def test_hits_are_the_grids_own_cells(seed, grid, count):
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, 5.0, (count, 3))
    found = detect(grid, Lidar("any", BeamPattern.from_angles([0.0], [0.0])), Scan(points))
    cells = grid.cell_of(points)
    np.testing.assert_array_equal(found.hits, np.bincount(cells[cells >= 0], minlength=grid.cells))
    np.testing.assert_array_equal(found.points_m, points)
    assert found.counts["kept"] == count
    assert found.counts["outside"] == np.count_nonzero(cells < 0)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    grid=st.sampled_from(
        [
            GRID,
            UNEVEN,
            AvoidanceGrid.uniform(
                (1.0, 8.0), 7, azimuth_deg=90.0, columns=6, elevation_deg=80.0, rows=4
            ),
        ]
    ),
    far_m=st.sampled_from([3.0, 30.0, 300.0]),
    max_range_m=st.sampled_from([6.0, 40.0, 1000.0]),
    ground=st.booleans(),
)
def test_every_return_is_counted_as_one_by_one(seed, grid, far_m, max_range_m, ground):
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, far_m, (rng.integers(0, 1500), 3))
    points[: len(points) // 3] *= rng.uniform(0.0, 0.2, (len(points) // 3, 1))
    points[rng.random(len(points)) < 0.02] = rng.choice([np.nan, np.inf, -np.inf])
    mounting = Mounting(rng.normal(0.0, 1.0, 3), rng.uniform(-1.0, 1.0, 3))
    pattern = BeamPattern.per_cell(grid, max_range_m=max_range_m, min_range_m=0.5)
    lidar = Lidar("any", pattern, mounting=mounting, airframe_radius_m=1.5)
    level = Ground(np.array([0.0, 0.0, 1.0]), -2.0, 0.3) if ground else None
    found = detect(grid, lidar, Scan(points), ground=level)

    with np.errstate(invalid="ignore"):
        away = np.linalg.norm(points, axis=1)
        finite = np.isfinite(points).all(axis=1)
        placed = np.where(finite[:, None], points, 0.0) @ mounting.body_from_sensor.T
        placed += mounting.position_m
        left, reasons = finite.copy(), {"nonfinite": ~finite}
        for reason, those in (
            ("beyond", away > max_range_m),
            ("blind", away < 0.5),
            ("airframe", np.linalg.norm(placed, axis=1) < 1.5),
            ("ground", placed[:, 2] <= (-1.7 if ground else -np.inf)),
        ):
            reasons[reason] = left & those
            left &= ~those
    cells = grid.cell_of(placed)
    inside = cells[left & (cells >= 0)]
    np.testing.assert_array_equal(found.hits, np.bincount(inside, minlength=grid.cells))
    counted = {name: np.count_nonzero(those) for name, those in reasons.items()}
    counted |= {"kept": left.sum(), "outside": left.sum() - len(inside)}
    assert dict(found.counts) == counted
    np.testing.assert_allclose(found.points_m, placed[left], atol=1e-9 * far_m)
    np.testing.assert_allclose(found.radius_m, 0.5 * pattern.spacing_rad * away[left])


def test_returns_on_borders_fall_where_the_grid_puts_them():
    edges = np.meshgrid(
        GRID.range_edges_m[1:], GRID.azimuth_edges_rad, GRID.elevation_edges_rad, indexing="ij"
    )
    r, az, el = (axis.ravel() for axis in edges)
    corners = np.stack([r * np.cos(el) * np.cos(az), r * np.cos(el) * np.sin(az), r * np.sin(el)])
    points = np.ascontiguousarray(corners.T)
    found = detect(GRID, Lidar("any", BeamPattern.per_cell(GRID)), Scan(points))
    assert found.hits.sum() == len(points)
    np.testing.assert_array_equal(
        found.hits, np.bincount(GRID.cell_of(points), minlength=GRID.cells)
    )


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 4000))
def test_visibility_falls_along_every_row(seed, count):
    rng = np.random.default_rng(seed)
    found = detect(GRID, LIDAR, Scan(rng.uniform([0, -7, -5], [10, 7, 5], (count, 3))))
    seen = found.visibility.reshape(GRID.shape)
    assert np.all(np.diff(seen, axis=0) <= 0.0)
    assert seen.min() >= 0.0
    np.testing.assert_array_equal(seen[0], 1.0)
    assert np.all((found.probability >= 0.0) & (found.probability <= 1.0))


def test_more_returns_than_beams_stay_within_one():
    found = detect(GRID, LIDAR, Scan(np.tile(along(5.5), (500, 1))))
    here = cell(5, 3, 2)
    assert found.hits[here] == 500
    assert found.probability[here] == 1.0
    assert found.visibility[cell(6, 3, 2)] == 0.0


def test_empty_scan_sees_everything_free():
    found = detect(GRID, LIDAR, Scan(np.zeros((0, 3)), 3.5, sensor="front"))
    assert found.time_s == 3.5
    assert not found.probability.any()
    np.testing.assert_array_equal(found.visibility, 1.0)
    assert found.seen.all()
    assert found.points_m.shape == (0, 3)


def test_nan_and_infinite_points_are_counted_and_skipped():
    bad = [[np.nan, 0, 0], [1, np.inf, 0], [1, 0, -np.inf], [np.inf, np.nan, 2], [3e200, 0, 0]]
    found = detect(GRID, LIDAR, Scan(np.array([*bad, along(5.5)], dtype=float)))
    assert found.counts["nonfinite"] == 5
    assert found.hits.sum() == 1
    assert len(found.points_m) == 1
    assert np.all(np.isfinite(found.visibility))


def test_columns_without_beams_are_unseen():
    # A VLP-16 looks +-15 deg up and down; the outer rows of the grid begin at 18 deg.
    lidar = Lidar("puck", BeamPattern.rotating(np.linspace(-15.0, 15.0, 16), 0.2))
    found = detect(GRID, lidar, Scan(np.array([along(5.5, elevation_deg=25.0)])))
    seen = found.seen.reshape(GRID.shape)
    assert seen[:, :, 1:4].all()
    assert not seen[:, :, [0, 4]].any()
    assert not found.visibility.reshape(GRID.shape)[:, :, [0, 4]].any()
    assert not found.probability.any()
    assert found.hits.sum() == 1


def test_beyond_its_range_a_sensor_sees_nothing():
    lidar = Lidar("short", BeamPattern.per_cell(GRID, max_range_m=6.0))
    found = detect(GRID, lidar, Scan(np.array([along(5.5), along(7.0)])))
    seen = found.visibility.reshape(GRID.shape)
    assert found.counts["beyond"] == 1
    assert np.all(seen[:5] == 1.0)
    assert not seen[6:].any()


def test_blind_and_airframe_returns_hide_what_is_behind_them():
    lidar = Lidar(
        "low",
        BeamPattern.per_cell(GRID, min_range_m=0.4, max_range_m=10.0),
        mounting=Mounting([0.0, 0.0, -0.2]),
        airframe_radius_m=0.8,
    )
    near = np.tile(along(0.3), (50, 1))
    leg = np.tile(along(0.7), (100, 1))
    found = detect(GRID, lidar, Scan(np.concatenate([near, leg])))
    assert found.counts["blind"] == 50
    assert found.counts["airframe"] == 100
    assert not found.hits.any()
    assert len(found.points_m) == 0
    np.testing.assert_allclose(found.visibility.reshape(GRID.shape)[:, 3, 2], 0.25)
    assert found.visibility[cell(9, 0, 0)] == 1.0


def test_ground_is_no_obstacle_but_hides_what_is_below():
    ground = Ground.at_height(State([0.0, 0.0, 2.0]), 0.0, clearance_m=0.3)
    down = along(2.0 / np.sin(np.radians(24.0)), 0.0, -24.0)
    up = np.array([0.0, 0.0, 1.0])
    low, high = down + 0.2 * up, down + 0.8 * up
    found = detect(GRID, LIDAR, Scan(np.array([down, low, high])), ground=ground)
    assert found.counts["ground"] == 2
    np.testing.assert_allclose(found.points_m, [high])
    assert found.hits.sum() == 1
    assert found.visibility[cell(9, 3, 0)] == pytest.approx(1.0 - 2 / 200)


def test_ground_follows_the_attitude():
    nose_down = State([0.0, 0.0, 2.0], [0.0, np.radians(20.0), 0.0])
    ground = Ground.at_height(nose_down, 0.0, clearance_m=0.1)
    on_ground = nose_down.world_from_body.T @ np.array([4.0, 1.0, -2.0])
    above = nose_down.world_from_body.T @ np.array([4.0, 1.0, -1.0])
    found = detect(GRID, LIDAR, Scan(np.array([on_ground, above])), ground=ground)
    assert found.counts["ground"] == 1
    np.testing.assert_allclose(found.points_m, [above])


def test_mounting_places_returns_in_the_body_frame():
    mounting = Mounting([0.3, -0.1, 0.2], np.radians([10.0, -20.0, 35.0]))
    lidar = Lidar("tilted", BeamPattern.rotating(np.linspace(-45, 45, 61), 1.0), mounting=mounting)
    world = BallWorld.of(((6.0, 1.0, 0.5), 1.0))
    found = detect(GRID, lidar, simulate_scan(lidar, world, HERE))
    assert found.hits.sum() > 50
    np.testing.assert_allclose(world.distance_m(found.points_m), 0.0, atol=1e-9)
    turned = lidar.pattern.directions @ mounting.body_from_sensor.T
    counted = np.bincount(
        np.maximum(GRID.cell_of(5.5 * turned) - cell(5, 0, 0), -1) + 1, minlength=36
    )
    np.testing.assert_array_equal(found.beams, counted[1:36])


def test_scan_of_an_earlier_pose_lands_in_the_present_grid():
    earlier = State([0.0, 0.0, 0.0], np.radians([0.0, 5.0, -15.0]))
    now = State([1.0, 0.5, 0.0], np.radians([0.0, 0.0, 15.0]))
    world = BallWorld.of(((6.0, 1.0, 0.5), 1.0))
    scan = simulate_scan(LIDAR, world, earlier)
    rotation = now.world_from_body.T @ earlier.world_from_body
    translation = now.world_from_body.T @ (earlier.position_m - now.position_m)
    found = detect(GRID, LIDAR, scan, grid_from_body=(rotation, translation))
    in_world = found.points_m @ now.world_from_body.T + now.position_m
    np.testing.assert_allclose(world.distance_m(in_world), 0.0, atol=1e-9)
    # 30 deg of yaw: the pattern no longer covers the left of the grid.
    assert found.seen.reshape(GRID.shape)[0, 0].all()
    assert not found.seen.reshape(GRID.shape)[0, 6].any()


def test_equal_surfaces_rate_equally_at_any_distance():
    # 2.1.1: the same ball at 5 and at 10 m, in one wide cell either time.
    grid = AvoidanceGrid.uniform(12.0, 4, azimuth_deg=20.0, columns=1, elevation_deg=20.0, rows=1)
    lidar = Lidar("fine", BeamPattern.per_cell(grid, 400, elevations_per_cell=400))
    rated = {}
    for rule in ("ratio", "surface"):
        for x in (5.0, 10.0):
            scan = simulate_scan(lidar, BallWorld.of(((x, 0.0, 0.0), 0.4)), HERE)
            found = detect(grid, lidar, scan, rule=rule)
            rated[rule, x] = 1.0 - np.prod(1.0 - found.probability)
    assert rated["ratio", 5.0] > 3.0 * rated["ratio", 10.0]
    assert rated["surface", 10.0] == pytest.approx(rated["surface", 5.0], rel=0.08)
    # A ball of 0.4 m against the reference of 0.5 m.
    assert rated["surface", 5.0] == pytest.approx(0.4**2 / 0.5**2, rel=0.15)


def test_surface_of_the_reference_size_rates_one_and_a_full_cell_too():
    full = np.repeat(PATTERN.directions * 5.5, 1, axis=0)
    found = detect(GRID, LIDAR, Scan(full), rule="surface")
    np.testing.assert_array_equal(found.probability.reshape(GRID.shape)[5], 1.0)
    near = detect(GRID, LIDAR, Scan(full[:20] / 5.5 * 1.5), rule="surface")
    # Nearby, a cell is smaller than the reference: the share of the cell counts.
    np.testing.assert_allclose(near.probability, near.hindrance)


def test_several_sensors_combine():
    half = Lidar("left", BeamPattern.rotating(np.linspace(-30, 30, 31), 1.0, azimuth_span_deg=30.0))
    one = detect(GRID, LIDAR, Scan(np.tile(along(5.5), (50, 1))))
    two = detect(GRID, half, Scan(np.tile(along(5.5), (10, 1))))
    both = combine_detections([one, two])
    here = cell(5, 3, 2)
    assert both.detected[here] == pytest.approx(
        1.0 - (1.0 - one.probability[here]) * (1.0 - two.probability[here])
    )  # (5.38)
    np.testing.assert_array_equal(both.visibility, np.maximum(one.visibility, two.visibility))
    np.testing.assert_array_equal(both.hits, one.hits + two.hits)
    assert both.seen.all()
    assert not two.seen.all()


def test_a_sensor_without_scan_adds_nothing():
    one = detect(GRID, LIDAR, Scan(np.tile(along(5.5), (50, 1))))
    both = combine_detections([detect_nothing(GRID, LIDAR), one])
    np.testing.assert_allclose(both.detected, one.probability, atol=1e-15)
    np.testing.assert_array_equal(both.visibility, one.visibility)
    assert not detect_nothing(GRID, LIDAR).seen.any()
    with pytest.raises(ClearwayError, match="at least one"):
        combine_detections([])


def test_radius_is_half_the_beam_spacing():
    found = detect(GRID, LIDAR, Scan(np.array([along(4.0), along(8.0)])))
    np.testing.assert_allclose(found.radius_m, np.array([2.0, 4.0]) * PATTERN.spacing_rad)


def test_scan_is_not_changed_and_repeats():
    points = np.random.default_rng(3).normal(0.0, 4.0, (600, 3))
    copy = points.copy()
    rotation = world_from_body([0.1, 0.2, 0.3])
    first, second = (
        detect(GRID, LIDAR, Scan(points), grid_from_body=(rotation, np.zeros(3))) for _ in range(2)
    )
    np.testing.assert_array_equal(points, copy)
    np.testing.assert_array_equal(first.hits, second.hits)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Scan(np.zeros((3, 2))), r"shape \[n, 3\], got \[3, 2\]"),
        (lambda: Lidar("x", PATTERN, dropout=1.0), r"dropout must be in \[0, 1\)"),
        (lambda: Lidar("x", PATTERN, false_returns=-0.1), r"false_returns must be in \[0, 1\)"),
        (lambda: Lidar("x", PATTERN, sigma_m=-0.1), "sigma_m must be"),
        (lambda: Lidar("x", PATTERN, airframe_radius_m=np.nan), "airframe_radius_m must be"),
        (lambda: Mounting([0.0, np.inf, 0.0]), "position_m must be three finite"),
    ],
)
def test_impossible_sensors_are_refused(build, message):
    with pytest.raises(ClearwayError, match=message):
        build()


def test_an_unknown_rule_lists_the_known_ones():
    with pytest.raises(ClearwayError, match="'area': valid detection rules are ratio or surface"):
        detect(GRID, LIDAR, Scan(np.zeros((0, 3))), rule="area")
