"""Volumes of obstacles in cells: published arrays, exact volumes, unions, and coating."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.frames import attitude_from_rotation, cartesian_from_spherical, world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.cell_share import half_space_share
from clearway.obstacles.cells import VolumeMode, base_probability, inflate_shapes
from clearway.obstacles.obstacle import Obstacle, local_distance, shapes_of
from clearway.obstacles.obstacle_map import ObstacleMap

GRID = AvoidanceGrid.uniform()
TOLERANCE = {"fast": (0.03, 0.004), "fine": (0.005, 0.001), "reference": (1e-5, 1e-6)}
QUARTER = np.pi / 2

KNOWN = {
    "ball_center": [Obstacle.ball([5, 0, 0], 1.0)],
    "line_y": [Obstacle.line([6, 0, 0], 4.0, radius_m=0.3, orientation_rad=[0, 0, QUARTER])],
    "cuboid_axis": [Obstacle.cuboid([6, 1, 0], (2.0, 2.0, 2.0), radius_m=0.1)],
    "U_two_overlapping_balls": [Obstacle.ball([5, 0, 0], 1.0), Obstacle.ball([5.5, 0.8, 0.3], 1.0)],
}

INSIDE = {
    "wire": Obstacle.line([7.0, 0.3, 0.2], 4.0, radius_m=0.0075, orientation_rad=[0.1, 0.3, -0.9]),
    "sharp box": Obstacle.cuboid(
        [6.5, 0.3, 0.0], (2.0, 1.5, 1.2), radius_m=0.0, orientation_rad=[0.5, -0.4, 0.8]
    ),
    "rounded box": Obstacle.cuboid(
        [6.5, 0.3, 0.0], (1.0, 1.5, 1.2), radius_m=0.03, orientation_rad=[0.5, -0.4, 0.8]
    ),
    "sheet": Obstacle.plane(
        [6.5, 0.3, 0.0], (2.0, 2.5), radius_m=0.002, orientation_rad=[0.2, 0.7, 0.4]
    ),
    "small ball": Obstacle.ball([3.3, 0.4, -0.2], 0.05),
}

TRICKY = {
    "same ball three times": [Obstacle.ball([6, 0.13, 0], 1.0)] * 3,
    "same sheet three times": [
        Obstacle.plane([6, 0, 0], (5.0, 5.0), radius_m=0.1, orientation_rad=[0.3, 1.2, 0.2])
    ]
    * 3,
    "boxes side by side": [
        Obstacle.cuboid([6, -0.87, 0], (4.0, 2.0, 6.0)),
        Obstacle.cuboid([6, 1.13, 0], (4.0, 2.0, 6.0)),
    ],
    "boxes in a row": [
        Obstacle.cuboid([5.13, 0, 0], (2.0, 6.0, 6.0)),
        Obstacle.cuboid([7.13, 0, 0], (2.0, 6.0, 6.0)),
    ],
    "stack of sheets": [
        Obstacle.plane([x, 0, 0], (2.5, 2.5), radius_m=0.02, orientation_rad=[0, QUARTER, 0])
        for x in (6.0, 6.2, 6.4)
    ],
    "crossed walls": [
        Obstacle.cuboid([6, 0, 0], (8.0, 0.4, 5.0)),
        Obstacle.cuboid([6, 0, 0], (0.4, 8.0, 5.0), radius_m=0.0, orientation_rad=[0, 0, 0.3]),
    ],
}

QUICK = ("same ball three times", "boxes side by side", "stack of sheets")


def random_obstacles(seed: int, count: int) -> list[Obstacle]:
    rng = np.random.default_rng(seed)
    obstacles = []
    for _ in range(count):
        position = rng.uniform([1, -5, -4], [11, 5, 4])
        turn = rng.uniform(-np.pi, np.pi, 3) * rng.integers(2)
        size = rng.uniform(0.1, 4.0, 3)
        radius = float(np.exp(rng.uniform(np.log(0.005), np.log(1.2))))
        obstacles.append(
            (
                Obstacle.ball(position, radius),
                Obstacle.line(position, size[0], radius_m=radius, orientation_rad=turn),
                Obstacle.plane(position, (size[0], size[1]), radius_m=radius, orientation_rad=turn),
                Obstacle.cuboid(
                    position, (size[0], size[1], size[2]), radius_m=0.0, orientation_rad=turn
                ),
            )[rng.integers(4)]
        )
    return obstacles


@pytest.mark.parametrize("mode", ["fast", "fine", "reference"])
@pytest.mark.parametrize("case", KNOWN)
def test_known_answers(case: str, mode: VolumeMode, known_answers: dict[str, Any]) -> None:
    expected = np.array(known_answers["map_base_probability"][case]["P_OM_B"]).ravel()
    error = np.abs(base_probability(shapes_of(KNOWN[case]), GRID, mode) - expected)
    assert error.max() <= TOLERANCE[mode][0]
    assert error.mean() <= TOLERANCE[mode][1]


@pytest.mark.parametrize("name", INSIDE)
def test_volumes_of_a_whole_shape_add_up(name: str) -> None:
    obstacle = INSIDE[name]
    shares = base_probability(shapes_of([obstacle]), GRID, "reference")
    assert shares @ GRID.volumes_m3 == pytest.approx(obstacle.volume_m3, rel=1e-3)
    fast = base_probability(shapes_of([obstacle]), GRID)
    assert fast @ GRID.volumes_m3 == pytest.approx(obstacle.volume_m3, rel=0.25)
    assert np.all(np.abs(fast - shares) < 0.03)


def test_reference_against_sampling() -> None:
    shapes = shapes_of(random_obstacles(5, 12))
    shares = base_probability(shapes, GRID, "reference")
    rng = np.random.default_rng(0)
    cell = int(np.argmin(np.abs(shares - 0.4)))
    i, j, k = np.unravel_index(cell, GRID.shape)
    low, high = GRID.range_edges_m[i : i + 2] ** 3
    distance = np.cbrt(rng.uniform(low, high, 10_000))
    azimuth = rng.uniform(*GRID.azimuth_edges_rad[j : j + 2], 10_000)
    elevation = np.arcsin(rng.uniform(*np.sin(GRID.elevation_edges_rad[k : k + 2]), 10_000))
    points = cartesian_from_spherical(np.stack([distance, azimuth, elevation], axis=-1))
    inside = np.mean([local_distance(x, y, z, shapes) <= 0.0 for x, y, z in points])
    assert shares[cell] == pytest.approx(inside, abs=0.015)


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=() if case in QUICK else pytest.mark.nightly) for case in TRICKY],
)
def test_fast_is_within_its_tolerance_of_the_reference_where_surfaces_meet(case: str) -> None:
    shapes = shapes_of(TRICKY[case])
    error = np.abs(base_probability(shapes, GRID) - base_probability(shapes, GRID, "reference"))
    assert error.max() <= 0.03
    assert error.mean() <= 0.004


@pytest.mark.parametrize("seed", range(6))
def test_fast_is_within_its_tolerance_of_the_reference_in_random_worlds(seed: int) -> None:
    grid = (
        GRID,
        AvoidanceGrid.uniform((1.0, 12.0), 8, azimuth_deg=60, columns=5, elevation_deg=30, rows=9),
    )[seed % 2]
    shapes = shapes_of(random_obstacles(seed, 2 + seed))
    error = np.abs(base_probability(shapes, grid) - base_probability(shapes, grid, "reference"))
    assert error.max() <= 0.03
    assert error.mean() <= 0.004


def sheets(count: int) -> list[Obstacle]:
    """All through the grid: a fifth of them meet in a cell, and fill it only together."""
    rng = np.random.default_rng(count)
    return [
        Obstacle.plane(
            middle, (30.0, 30.0), radius_m=0.005, orientation_rad=rng.uniform(-np.pi, np.pi, 3)
        )
        for middle in rng.uniform([1, -8, -5], [11, 8, 5], (count, 3))
    ]


@pytest.mark.parametrize(
    ("count", "most", "mean"), [(100, 0.03, 0.004), (300, 0.05, 0.008), (1000, 0.15, 0.04)]
)
def test_where_very_many_meet_fewer_parts_of_a_cell_tell_as_much(
    count: int, most: float, mean: float
) -> None:
    shapes = shapes_of(sheets(count))
    fast, fine = (base_probability(shapes, GRID, mode) for mode in ("fast", "fine"))
    assert fine.mean() > 5e-4 * count
    assert np.abs(fast - fine).max() <= most
    assert np.abs(fast - fine).mean() <= mean


@pytest.mark.parametrize("seed", range(3))
def test_fine_is_near_the_reference_with_few_large_cells_too(seed: int) -> None:
    grid = (
        GRID,
        AvoidanceGrid.uniform(10.0, 1, azimuth_deg=45.0, columns=3, elevation_deg=30.0, rows=2),
    )[seed % 2]
    shapes = shapes_of(random_obstacles(seed, 5))
    fine = base_probability(shapes, grid, "fine")
    error = np.abs(fine - base_probability(shapes, grid, "reference"))
    assert error.max() <= 0.005
    assert error.mean() <= 0.001


def test_a_union_counts_what_overlaps_once() -> None:
    halves = [
        Obstacle.cuboid([6, -0.5, 0], (2.0, 1.0, 1.0)),
        Obstacle.cuboid([6, 0.5, 0], (2.0, 1.0, 1.0)),
    ]
    whole = [Obstacle.cuboid([6, 0, 0], (2.0, 2.0, 1.0))]
    for parts in (halves, halves + whole):
        np.testing.assert_allclose(
            base_probability(shapes_of(parts), GRID, "reference"),
            base_probability(shapes_of(whole), GRID, "reference"),
            atol=1e-5,
        )


@given(seed=st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_shares_grow_with_obstacles_and_stay_within_one(seed: int) -> None:
    obstacles = random_obstacles(seed, 6)
    before = base_probability(shapes_of(obstacles[:-1]), GRID)
    after = base_probability(shapes_of(obstacles), GRID)
    assert np.all(before >= 0.0)
    assert np.all(after <= 1.0)
    assert np.all(after >= before - 1e-12)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_moving_grid_and_obstacles_together_changes_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    obstacles = random_obstacles(seed, 5)
    here = base_probability(ObstacleMap(obstacles).in_grid(np.zeros(3), np.eye(3), GRID), GRID)
    turn, shift = world_from_body(rng.uniform(-1.0, 1.0, 3)), rng.uniform(-50.0, 50.0, 3)
    moved = ObstacleMap(
        [
            Obstacle(
                obstacle.shape,
                turn @ obstacle.position_m + shift,
                orientation_rad=attitude_from_rotation(
                    turn @ world_from_body(obstacle.orientation_rad)
                ),
                size_m=obstacle.size_m,
                radius_m=obstacle.radius_m,
            )
            for obstacle in obstacles
        ]
    )
    there = base_probability(moved.in_grid(shift, turn, GRID), GRID)
    np.testing.assert_allclose(there, here, atol=1e-6)


def test_an_empty_map_fills_nothing() -> None:
    shapes = shapes_of([])
    for mode in ("fast", "reference"):
        assert np.all(base_probability(shapes, GRID, mode) == 0.0)  # type: ignore[arg-type]
    assert not np.any(inflate_shapes(shapes, GRID, 0.6))


def test_a_covered_grid_is_full() -> None:
    shapes = shapes_of([Obstacle.cuboid([0, 0, 0], (50.0, 50.0, 50.0))])
    for mode in ("fast", "reference"):
        assert np.all(base_probability(shapes, GRID, mode) == 1.0)  # type: ignore[arg-type]


def test_an_unknown_mode_is_named() -> None:
    with pytest.raises(ClearwayError, match="fast, fine, reference"):
        base_probability(shapes_of([]), GRID, "slow")  # type: ignore[arg-type]


def test_half_space_share_of_a_unit_cube() -> None:
    assert half_space_share(1.0, 0.0, 0.0, 0.25) == pytest.approx(0.25, abs=2e-6)
    third = 1.0 / np.sqrt(3.0)
    assert half_space_share(third, third, third, 0.0) == pytest.approx(0.5)
    # The corner cut off by the plane through its three neighbours is a sixth of the cube.
    corner = half_space_share(third, third, third, third / 2.0)
    assert corner == pytest.approx(1.0 / 6.0)


@given(seed=st.integers(0, 10_000), margin_m=st.floats(0.0, 2.0))
@settings(max_examples=30, deadline=None)
def test_coating_misses_no_cell_and_few_too_many(seed: int, margin_m: float) -> None:
    rng = np.random.default_rng(seed)
    shapes = shapes_of(random_obstacles(seed, 4))
    coated = inflate_shapes(shapes, GRID, margin_m)
    spherical = rng.uniform([0.0, -np.pi / 4, -np.pi / 6], [10.0, np.pi / 4, np.pi / 6], (800, 3))
    points = cartesian_from_spherical(spherical)
    cells = GRID.cell_of(points)
    distances = np.array([local_distance(x, y, z, shapes) for x, y, z in points])
    assert np.all(coated[cells[distances <= margin_m]])
    # Parts of a cell at 10 m are half a metre wide; no point of a cell is farther off than it.
    centers = np.array([local_distance(x, y, z, shapes) for x, y, z in GRID.centers_m])
    assert not np.any(coated[centers > margin_m + 0.45 + 1.6])


@pytest.mark.parametrize("count", [1, 30, 150])
def test_coating_is_the_same_of_one_shape_and_of_many_on_it_but_where_these_are_very_many(
    count: int,
) -> None:
    """Then a cell may be taken for coated that merely is near."""
    shape = Obstacle.cuboid(
        [6.5, 0.4, 0.1], (1.0, 2.0, 1.5), radius_m=0.05, orientation_rad=[0.3, 0.2, -0.5]
    )
    alone = inflate_shapes(shapes_of([shape]), GRID, 0.6)
    many = inflate_shapes(shapes_of([shape] * count), GRID, 0.6)
    if count <= 30:
        np.testing.assert_array_equal(many, alone)
    else:
        assert np.all(many[alone])
        assert many.sum() < 2 * alone.sum()


def test_a_wire_is_coated() -> None:
    wire = shapes_of(
        [Obstacle.line([6, 0, 0], 8.0, radius_m=0.0075, orientation_rad=[0, 0, QUARTER])]
    )
    coated = GRID.reshape(inflate_shapes(wire, GRID, 0.6))
    assert np.all(coated[5:7, 3, 2])
    assert not np.any(coated[:4])
    assert not np.any(coated[8:, 3])
