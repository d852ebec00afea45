"""Rays of the spread model: how much fewer of them cost, and which are not followed at all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.frames import cartesian_from_spherical
from clearway.base.grid import BORDER_TOLERANCE, AvoidanceGrid
from clearway.traffic import Intruder, line_cells, spread_cells
from clearway.traffic.models.beyond import ball_around, passes_by
from clearway.traffic.models.borders import CELL, ENTRY, LEAVE, compute_borders, scratch
from clearway.traffic.models.half_lines import BUNCH, room_for_lines, tell
from clearway.traffic.models.spread import NODES, cone_axes, disc_nodes
from clearway.traffic.models.traverse import cut_lines, pieces_of
from intruders_for_tests import KINDS, random_intruder

UP = np.array([0.0, 0.0, 1.0])
GRIDS = [
    AvoidanceGrid.uniform(),
    AvoidanceGrid.uniform(layers=4, azimuth_deg=20.0, columns=3, elevation_deg=10.0, rows=3),
    AvoidanceGrid.uniform(layers=3, azimuth_deg=60.0, columns=3, elevation_deg=40.0, rows=2),
    AvoidanceGrid.uniform(layers=2, azimuth_deg=110.0, columns=6, elevation_deg=40.0, rows=4),
    AvoidanceGrid.uniform(layers=1, azimuth_deg=180.0, columns=24, elevation_deg=85.0, rows=12),
]


@pytest.mark.parametrize("kind", KINDS)
def test_twenty_times_the_rays_tell_hardly_more(kind: str) -> None:
    grid = AvoidanceGrid.uniform()
    intruders = [random_intruder(kind, seed) for seed in range(40)]
    fast = spread_cells(grid, intruders, UP)
    fine = spread_cells(grid, intruders, UP, "fine")
    assert sum(NODES["fine"]) > 20 * sum(NODES["fast"])
    assert fast.meeting is not None
    assert fine.meeting is not None
    of_time = np.abs(fast.probability - fine.probability)
    of_meeting = np.abs(fast.meeting - fine.meeting)
    assert of_time.max() <= 0.017
    assert of_time.mean(axis=1).max() <= 0.0015
    assert of_meeting.max() <= 0.025
    assert of_meeting.mean(axis=1).max() <= 0.0035


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
def test_all_cells_are_in_the_ball_around_them(grid: AvoidanceGrid) -> None:
    middle_m, radius_m = ball_around(compute_borders(grid))
    ranges, azimuths, elevations = np.meshgrid(
        *(np.linspace(edges[0], edges[-1], 41) for edges in grid.edges), indexing="ij"
    )
    level = ranges * np.cos(elevations)
    x, y, z = level * np.cos(azimuths), level * np.sin(azimuths), ranges * np.sin(elevations)
    off_m = np.sqrt((x - middle_m) ** 2 + y**2 + z**2)
    assert off_m.max() <= radius_m * (1.0 + 1e-12)
    assert 0.0 <= middle_m <= radius_m <= grid.range_m


def aimed(seed: int) -> Intruder:
    """One that flies near the grid, past it or away from it."""
    rng = np.random.default_rng(seed)
    away = rng.normal(size=3)
    place = np.exp(rng.uniform(0.0, 5.0)) * away / np.linalg.norm(away)
    towards = rng.normal(scale=8.0, size=3) - place
    velocity = rng.choice([-1.0, 1.0]) * towards * np.exp(rng.uniform(-3.0, 1.0))
    return Intruder(place, velocity, spread_rad=rng.uniform(0.0, rng.choice([0.05, 0.4, 1.5]), 2))


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
@given(seed=st.integers(0, 100_000))
@settings(max_examples=100, deadline=None)
def test_rays_that_are_not_followed_meet_no_cell(grid: AvoidanceGrid, seed: int) -> None:
    intruder, borders = aimed(seed), compute_borders(grid)
    position, velocity = intruder.position_m.copy(), intruder.velocity_mps.copy()
    sine, ball = np.sin(intruder.spread_rad), ball_around(borders)
    if not passes_by(position, velocity, float(sine.max()), *ball):
        return
    _, level, across = cone_axes(velocity, UP)
    wide, narrow = level * intruder.speed_mps * sine[0], across * intruder.speed_mps * sine[1]
    nodes, lines, pieces = disc_nodes(*NODES["fine"]), room_for_lines(borders), scratch(borders)
    for u, w in zip(nodes.wide[::7], nodes.narrow[::7], strict=True):
        ray = velocity + u * wide + w * narrow
        start, way = (position[0], position[1], position[2]), (ray[0], ray[1], ray[2])
        tell(lines, 0, start, way, np.inf)
        cut_lines(lines, 1, borders)
        assert pieces_of(lines, 0, borders, pieces) == 0


def test_about_all_cones_that_miss_the_ball_are_told_so() -> None:
    """Against rays to points all over the ball: some of them lie within the cone."""
    grid = AvoidanceGrid.uniform()
    middle_m, radius_m = ball_around(compute_borders(grid))
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points *= radius_m / np.linalg.norm(points, axis=1, keepdims=True)
    points[:, 0] += middle_m
    told = missed = 0
    for seed in range(600):
        intruder = aimed(seed)
        position, velocity = intruder.position_m.copy(), intruder.velocity_mps.copy()
        tangent = float(np.sin(intruder.spread_rad).max())
        to_points = points - position
        along = to_points @ velocity / np.linalg.norm(velocity)
        beside = np.sqrt(np.maximum(np.sum(to_points**2, axis=1) - along**2, 0.0))
        misses = not np.any((along > 0.0) & (beside <= tangent * along))
        by = passes_by(position, velocity, tangent, middle_m, radius_m)
        # Thin cones, and those from within, pass between the points.
        assert misses or not by
        told, missed = told + by, missed + misses
    assert told > 150
    assert told > 0.8 * missed


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
def test_lines_that_are_cut_together_pass_what_each_passes_alone(grid: AvoidanceGrid) -> None:
    """More than a bunch of them, so that some follow others in the same places."""
    intruders = [aimed(seed) for seed in range(2 * BUNCH + 9)]
    together = line_cells(grid, intruders)
    for n, intruder in enumerate(intruders):
        alone = line_cells(grid, [intruder]).of(0)
        for name in ("probability", "entry_s", "leave_s", "dwell_s"):
            np.testing.assert_array_equal(getattr(together, name)[n], getattr(alone, name))
    assert np.any(together.probability[BUNCH:])


NEAR_BORDER = 2.0 * BORDER_TOLERANCE


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
@given(seed=st.integers(0, 100_000))
@settings(max_examples=100, deadline=None)
def test_lines_are_where_the_grid_says_that_their_points_are(
    grid: AvoidanceGrid, seed: int
) -> None:
    """Also those that keep to a border, or nearly so: which row that is, no crossing tells. Where a
    line crosses one, either side will do within its tolerance."""
    rng = np.random.default_rng(seed)
    edge = rng.choice(grid.elevation_edges_rad) + rng.choice([0.0, 1e-12, 5e-9, -5e-9, 1e-3])
    azimuth, away = rng.uniform(*grid.azimuth_edges_rad[[0, -1]]), rng.uniform(0.1, 0.9)
    along = cartesian_from_spherical(np.array([1.0, azimuth, edge]))
    level = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    way = along if rng.random() < 0.5 else along + rng.choice([1e-12, 1e-3, 1.0]) * level
    start = away * grid.range_m * along
    borders = compute_borders(grid)
    lines, pieces = room_for_lines(borders), scratch(borders)
    tell(lines, 0, tuple(start), tuple(way), np.inf)
    cut_lines(lines, 1, borders)
    for piece in range(pieces_of(lines, 0, borders, pieces)):
        times_s = pieces.times[[ENTRY, LEAVE], piece]
        middle = start + np.mean(times_s) * way
        allowed = [int(grid.cell_of(middle))]
        elevation = np.arctan2(middle[2], np.hypot(middle[0], middle[1]))
        if way is not along and np.abs(grid.elevation_edges_rad - elevation).min() < NEAR_BORDER:
            heading = np.arctan2(middle[1], middle[0])
            for turned in (elevation - NEAR_BORDER, elevation + NEAR_BORDER):
                beside = np.array([np.linalg.norm(middle), heading, turned])
                allowed.append(int(grid.cell_of(cartesian_from_spherical(beside))))
        assert pieces.places[CELL, piece] in allowed


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
@given(seed=st.integers(0, 100_000))
@settings(max_examples=100, deadline=None)
def test_lines_begin_where_they_start(grid: AvoidanceGrid, seed: int) -> None:
    """Whatever border they cross first, and to which side."""
    rng = np.random.default_rng(seed)
    low, high = np.array([[each[0], each[-1]] for each in grid.edges]).T
    start = cartesian_from_spherical(rng.uniform(low, high))
    way = rng.normal(size=3)
    borders = compute_borders(grid)
    lines, pieces = room_for_lines(borders), scratch(borders)
    tell(lines, 0, tuple(start), tuple(way), np.inf)
    cut_lines(lines, 1, borders)
    count = pieces_of(lines, 0, borders, pieces)
    if grid.cell_of(start) == grid.cell_of(start + 1e-6 * way):
        assert count > 0
        assert pieces.times[ENTRY, 0] == 0.0
        assert pieces.places[CELL, 0] == grid.cell_of(start)
