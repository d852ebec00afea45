"""The body model: exact contact, filled share, tube; known answers and laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.frames import cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.traffic import Intruder, body_cells, line_cells
from clearway.traffic.models.ball_cell import cell_distance, cell_parts, compute_filled_share
from clearway.traffic.models.borders import compute_borders
from clearway.traffic.models.tube import tube_cells
from intruders_for_tests import KINDS, random_intruder

GRID = AvoidanceGrid.uniform()
ROUND = AvoidanceGrid.uniform(
    (0.5, 10.0), 4, azimuth_deg=180.0, columns=5, elevation_deg=85.0, rows=3
)
FLANK = Intruder([6, 8, 0], [0, -1, 0], radius_m=1.0, name="flank")
CASES = {
    "flank": FLANK,
    "oblique": Intruder([9, 5, 3], [-1, -0.7, -0.4], radius_m=0.6),
    "vertical": Intruder([6, 1, 9], [0, 0, -2], radius_m=1.5),
    "very fast": Intruder([300, 100, 20], [-240, -80, -16], radius_m=0.4),
    "head-on": Intruder([15, 0, 0], [-3, 0, 0], radius_m=0.8),
    "starts inside": Intruder([5.2, 0.3, 0.1], [0.5, 0.5, 0.2], radius_m=0.7),
    "large": Intruder([8, 9, 1], [-0.2, -1, 0], radius_m=4.0),
    "stands still": Intruder([5, 1, 0], [0, 0, 0], radius_m=1.0),
}


def as_cells(values: Any) -> npt.NDArray[np.float64]:
    return np.array(values, dtype=np.float64).ravel()


def points_in(grid: AvoidanceGrid, cell: int, count: int, seed: int) -> npt.NDArray[np.float64]:
    """Points spread evenly by volume in one cell."""
    i, j, k = np.unravel_index(cell, grid.shape)
    part = np.random.default_rng(seed).random((count, 3))
    ranges, azimuths, elevations = grid.edges
    cube = ranges[i] ** 3 + part[:, 0] * (ranges[i + 1] ** 3 - ranges[i] ** 3)
    azimuth = azimuths[j] + part[:, 1] * (azimuths[j + 1] - azimuths[j])
    low, high = np.sin(elevations[k : k + 2])
    sine = low + part[:, 2] * (high - low)
    return cartesian_from_spherical(np.stack([np.cbrt(cube), azimuth, np.arcsin(sine)], axis=-1))


def test_known_answers(known_answers: dict[str, Any]) -> None:
    expected = known_answers["intruder"]["body_radius_1"]
    body = body_cells(GRID, [FLANK]).of(0)
    np.testing.assert_array_equal(body.indicator, as_cells(expected["indicator"]))
    error = np.abs(body.probability - as_cells(expected["volume_ratio_6_10"]))
    assert error.max() < 0.02
    assert error.mean() < 0.003
    np.testing.assert_allclose(body.entry_s, as_cells(expected["i_e"]), atol=1e-6)
    np.testing.assert_allclose(body.leave_s, as_cells(expected["i_l"]), atol=1e-6)


def test_reference_known_answers(known_answers: dict[str, Any]) -> None:
    expected = known_answers["intruder"]["body_radius_1"]["volume_ratio_6_10"]
    body = body_cells(GRID, [FLANK], "reference").of(0)
    np.testing.assert_allclose(body.probability, as_cells(expected), atol=1e-4)


def test_wider_body_of_the_paper() -> None:
    body = body_cells(GRID, [Intruder([6, 8, 0], [0, -1, 0], radius_m=2.0)]).of(0)
    assert body.indicator is not None
    assert body.indicator.sum() == 137
    assert body.probability.sum() == pytest.approx(68.435, abs=0.5)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("grid", [GRID, ROUND], ids=["usual", "round"])
def test_fast_holds_to_the_reference(case: str, grid: AvoidanceGrid) -> None:
    fast = body_cells(grid, [CASES[case]])
    slow = body_cells(grid, [CASES[case]], "reference")
    error = np.abs(fast.probability - slow.probability)
    assert error.max() < 0.02
    assert error.mean() < 0.003
    np.testing.assert_array_equal(fast.indicator, slow.indicator)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("grid", [GRID, ROUND], ids=["usual", "round"])
def test_fast_holds_to_the_reference_for_random_bodies(kind: str, grid: AvoidanceGrid) -> None:
    intruders = [random_intruder(kind, seed) for seed in (2, 3)]
    fast = body_cells(grid, intruders)
    slow = body_cells(grid, intruders, "reference")
    error = np.abs(fast.probability - slow.probability)
    assert error.max() <= 0.02
    assert error.mean(axis=1).max() <= 0.003
    assert not np.any((fast.indicator != slow.indicator) & (slow.probability >= 1e-6))


@given(st.lists(st.floats(-11, 11), min_size=3, max_size=3), st.integers(0, 10**6))
@settings(max_examples=80, deadline=None)
def test_distance_is_to_the_nearest_point_of_the_cell(point: list[float], seed: int) -> None:
    for grid in (GRID, ROUND):
        cell = seed % grid.cells
        i, j, k = (int(n) for n in np.unravel_index(cell, grid.shape))
        exact = cell_distance(*point, i, j, k, compute_borders(grid))
        sampled = np.linalg.norm(points_in(grid, cell, 4000, seed) - point, axis=1).min()
        assert exact <= sampled + 1e-6
        assert sampled - exact < 1.2
        if grid.cell_of(point) == cell:
            assert exact < 1e-6


@given(
    st.integers(0, 349),
    st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3),
    st.floats(0.2, 4.0),
)
@settings(max_examples=60, deadline=None)
def test_filled_share_is_the_share_of_points_in_the_ball(
    cell: int, offset: list[float], radius: float
) -> None:
    i, j, k = (int(n) for n in np.unravel_index(cell, GRID.shape))
    x, y, z = (float(v) for v in GRID.centers_m[cell] + offset)
    parts = cell_parts(GRID, 5000)
    share, _ = compute_filled_share(x, y, z, radius, (1.0, 0.0, 0.0), (i, j, k), parts)
    inside = np.linalg.norm(points_in(GRID, cell, 20_000, cell) - [x, y, z], axis=1) < radius
    assert share == pytest.approx(inside.mean(), abs=0.02)


@given(
    st.lists(st.floats(-12, 12), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    st.floats(0.01, 5.0),
)
@settings(max_examples=60, deadline=None)
def test_laws(position: list[float], velocity: list[float], radius: float) -> None:
    intruder = Intruder(position, velocity, radius_m=radius)
    body = body_cells(GRID, [intruder]).of(0)
    line = line_cells(GRID, [intruder]).of(0)
    assert body.indicator is not None
    touched = body.indicator > 0
    assert np.all((body.probability >= 0) & (body.probability <= 1))
    assert np.all(body.probability <= 4.19 * radius**3 / GRID.volumes_m3 + 1e-12)
    assert np.all(body.probability[~touched] == 0)
    assert np.all(touched[line.dwell_s > 1e-3])
    assert np.all(body.entry_s[touched] <= body.leave_s[touched])
    assert not np.any(np.isnan(body.entry_s[touched]))
    both = touched & (line.dwell_s > 1e-3)
    assert np.all(body.entry_s[both] <= line.entry_s[both] + 1e-9)
    assert np.all(body.leave_s[both] >= line.leave_s[both] - 1e-9)
    mirrored = Intruder(
        np.multiply(position, [1, -1, 1]), np.multiply(velocity, [1, -1, 1]), radius_m=radius
    )
    other = body_cells(GRID, [mirrored]).of(0)
    np.testing.assert_allclose(
        GRID.reshape(body.probability)[:, ::-1], GRID.reshape(other.probability), atol=0.01
    )


def test_a_point_fills_nothing_but_touches_its_line() -> None:
    point = Intruder([6, 8, 0], [0, -1, 0])
    body = body_cells(GRID, [point])
    np.testing.assert_array_equal(body.indicator, line_cells(GRID, [point]).probability)
    np.testing.assert_array_equal(body.probability, 0.0)


@pytest.mark.nightly
def test_a_half_shell_may_be_filled_most_at_once() -> None:
    # The ball leaves a cell half round the vehicle, and comes back to its other end later.
    shell = AvoidanceGrid.uniform(
        (38.75, 42.5), 1, azimuth_deg=180.0, columns=2, elevation_deg=(-60.0, 0.0), rows=1
    )
    ball = Intruder([-25.0, 4.1, -3.5], [9.9, -0.7, 1.2], radius_m=20.0)
    slow = body_cells(shell, [ball], "reference").of(0)
    assert slow.probability.max() == pytest.approx(0.097, abs=0.01)
    for accuracy in ("fast", "fine"):
        found = body_cells(shell, [ball], accuracy).of(0).probability
        assert np.abs(found - slow.probability).max() <= 0.02


def test_a_body_meets_both_ends_of_a_cell_all_round() -> None:
    # Short contacts on either side of the vehicle, far apart on the way.
    rings = AvoidanceGrid.uniform(
        (1.0, 10.0), 24, azimuth_deg=180.0, columns=1, elevation_deg=10.0, rows=1
    )
    cells = body_cells(rings, [Intruder([0.2, 30.0, 0.1], [0.0, -20.0, 0.0], radius_m=0.05)]).of(0)
    ranges = rings.range_edges_m
    # The ball's nearest point leads its centre; it passes 0.22 m beside the vehicle.
    expected = (30.0 - ranges[1:] - 0.05) / 20.0, (30.0 + ranges[1:] + 0.05) / 20.0
    np.testing.assert_allclose(cells.entry_s, expected[0], atol=0.002)
    np.testing.assert_allclose(cells.leave_s, expected[1], atol=0.002)


def test_a_standing_body_fills_what_it_fills() -> None:
    body = body_cells(GRID, [Intruder([5, 0, 0], [0, 0, 0], radius_m=0.5)]).of(0)
    halves = GRID.cell_of([[4.9, 0, 0], [5.1, 0, 0]])
    half_ball = 2 / 3 * np.pi * 0.5**3 / GRID.volumes_m3[halves]
    np.testing.assert_allclose(body.probability[halves], half_ball, atol=0.06)
    assert body.indicator is not None
    touched = body.indicator > 0
    np.testing.assert_array_equal(body.entry_s[touched], 0.0)
    np.testing.assert_array_equal(body.leave_s[touched], np.inf)


@pytest.mark.parametrize("case", ["flank", "oblique", "vertical", "large"])
def test_tube_is_within_the_body_and_around_the_line(case: str) -> None:
    intruder = CASES[case]
    tube = tube_cells(GRID, [intruder]).of(0)
    body = body_cells(GRID, [intruder]).of(0)
    line = line_cells(GRID, [intruder]).of(0)
    assert body.indicator is not None
    assert np.all(tube.probability <= body.indicator)
    assert np.all(tube.probability[line.dwell_s > 0.3] == 1)
    met = tube.probability > 0
    assert np.all(tube.entry_s[met] >= body.entry_s[met] - 1e-6)
    assert np.all(tube.leave_s[met] <= body.leave_s[met] + 1e-6)
    slow = tube_cells(GRID, [intruder], "reference").of(0)
    assert np.all(tube.probability <= slow.probability)
    assert (slow.probability - tube.probability).sum() <= 0.05 * slow.probability.sum()
