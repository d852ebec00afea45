"""The line model: exact traversal against sampling, degenerate lines, known answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.grid import AvoidanceGrid
from clearway.traffic import Intruder, ModelCells, line_cells

GRID = AvoidanceGrid.uniform()
EVEN = AvoidanceGrid.uniform(columns=6, rows=4)
ROUND = AvoidanceGrid.uniform(
    (0.5, 10.0), 5, azimuth_deg=180.0, columns=7, elevation_deg=90.0, rows=6
)
ONE = AvoidanceGrid.uniform(10.0, 2, azimuth_deg=45.0, columns=1, elevation_deg=30.0, rows=1)


def line(grid: AvoidanceGrid, position: npt.ArrayLike, velocity: npt.ArrayLike) -> ModelCells:
    return line_cells(grid, [Intruder(position, velocity)]).of(0)


def as_cells(values: Any) -> npt.NDArray[np.float64]:
    return np.array(values, dtype=np.float64).ravel()


def met(grid: AvoidanceGrid, cells: ModelCells) -> list[tuple[int, ...]]:
    places = np.unravel_index(np.flatnonzero(cells.probability), grid.shape)
    return [tuple(int(i) for i in place) for place in zip(*places, strict=True)]


def test_known_answers(known_answers: dict[str, Any]) -> None:
    expected = known_answers["intruder"]["line"]
    cells = line(GRID, [6, 8, 0], [0, -1, 0])
    for values, key in (
        (cells.probability, "P"),
        (cells.entry_s, "i_e"),
        (cells.leave_s, "i_l"),
        (cells.dwell_s, "dwell"),
    ):
        np.testing.assert_allclose(values, as_cells(expected[key]), rtol=0, atol=1e-8)


@pytest.mark.parametrize("grid", [GRID, EVEN, ROUND, ONE], ids=["usual", "even", "round", "one"])
@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-12, 12), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(
        lambda v: float(np.linalg.norm(v)) > 0.1
    ),
)
def test_dwell_is_what_sampling_finds(
    grid: AvoidanceGrid, position: list[float], velocity: list[float]
) -> None:
    # Off the borders, where sampling and traversal may take different sides.
    position = [x + offset for x, offset in zip(position, (0.0123, 0.0231, 0.0317), strict=True)]
    velocity = [x + offset for x, offset in zip(velocity, (3e-3, 1e-3, 2e-3), strict=True)]
    cells = line(grid, position, velocity)
    speed = float(np.linalg.norm(velocity))
    step = 2e-3
    time = np.arange(0.5 * step, 40.0, step) / speed
    inside = grid.cell_of(np.array(position) + np.array(velocity) * time[:, None])
    sampled = np.bincount(inside[inside >= 0], minlength=grid.cells) * step / speed
    # A cell is entered and left at most three times, each within one sample.
    np.testing.assert_allclose(cells.dwell_s, sampled, rtol=0, atol=6 * step / speed)
    found = cells.probability > 0
    assert np.all(cells.dwell_s[found] <= (cells.leave_s - cells.entry_s)[found] + 1e-9)
    assert np.all(cells.entry_s[found] >= 0.0)
    assert np.all(np.isnan(cells.entry_s[~found]))


def test_zero_velocity_stays_in_its_cell() -> None:
    cells = line(GRID, [5.5, 0, 0], [0, 0, 0])
    assert met(GRID, cells) == [(5, 3, 2)]
    place = GRID.cell_of([[5.5, 0, 0]])[0]
    assert (cells.entry_s[place], cells.leave_s[place]) == (0.0, np.inf)
    assert cells.dwell_s[place] == np.inf
    assert met(GRID, line(GRID, [-5, 0, 0], [0, 0, 0])) == []


def test_head_on_through_the_origin() -> None:
    cells = line(GRID, [12, 0, 0], [-1, 0, 0])
    assert met(GRID, cells) == [(i, 3, 2) for i in range(10)]
    np.testing.assert_allclose(GRID.reshape(cells.entry_s)[:, 3, 2], np.arange(11.0, 1.0, -1.0))
    behind = line(ROUND, [12, 0, 0.0], [-1, 0, 0])
    assert behind.dwell_s.sum() == pytest.approx(19.0)


def test_in_a_border_the_grid_decides_and_no_cell_counts_twice() -> None:
    # Along x an even grid has its middle edges: the tie goes left and up.
    assert met(EVEN, line(EVEN, [12, 0, 0], [-1, 0, 0])) == [(i, 3, 2) for i in range(10)]
    # Along the cone at 18 degrees: the cell nearer the axis.
    direction = np.array([np.cos(np.radians(18.0)), 0.0, np.sin(np.radians(18.0))])
    assert met(GRID, line(GRID, 12 * direction, -direction)) == [(i, 3, 3) for i in range(10)]


def test_touching_a_sphere_or_a_cone_does_not_count() -> None:
    assert (5, 3, 2) not in met(GRID, line(GRID, [6, 8, 0], [0, -1, 0]))
    assert met(GRID, line(GRID, [10, 8, 0], [0, -1, 0])) == []
    # A level line at this height touches the cone at 18 degrees from below where x = 5.
    height = 5.0 * np.tan(np.radians(18.0))
    rows = {place[2] for place in met(GRID, line(GRID, [5, 9, height], [0, -1, 0]))}
    assert rows == {2, 3} or rows == {3}


def test_vertical_lines() -> None:
    cells = line(GRID, [5, 0, 20], [0, 0, -2])
    assert {place[1] for place in met(GRID, cells)} == {3}
    assert cells.dwell_s.sum() == pytest.approx(2 * 5 * np.tan(np.radians(30)) / 2)
    on_axis = line(ROUND, [0, 0, 20], [0, 0, -1])
    assert on_axis.dwell_s.sum() == pytest.approx(19.0)


def test_very_fast_keeps_its_times() -> None:
    slow = line(GRID, [6, 8, 1], [0.1, -1, 0.05])
    fast = line(GRID, [6, 8, 1], [1e4, -1e5, 5e3])
    np.testing.assert_array_equal(slow.probability, fast.probability)
    np.testing.assert_allclose(slow.dwell_s, fast.dwell_s * 1e5, atol=1e-9)


def test_reentry_keeps_hull_and_dwell() -> None:
    # At x = 4 the sphere at 5 m is entered at y = 3 and left at -3, the column at y = -4.
    cells = line(ONE, [4, 3.5, 0], [0, -1, 0])
    np.testing.assert_allclose(cells.dwell_s, [6.0, 1.5])
    np.testing.assert_allclose(cells.entry_s, [0.5, 0.0])
    np.testing.assert_allclose(cells.leave_s, [6.5, 7.5])


def test_mirrored_lines_have_mirrored_cells() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        position, velocity = rng.normal(size=3) * 6, rng.normal(size=3)
        flip = np.array([1, -1, 1])
        one = GRID.reshape(line(GRID, position, velocity).dwell_s)
        other = GRID.reshape(line(GRID, position * flip, velocity * flip).dwell_s)
        np.testing.assert_allclose(one, other[:, ::-1, :], atol=1e-9)


def test_rounding_does_not_scatter_what_flies_along_a_border() -> None:
    noise = 2e-16
    level = met(EVEN, line(EVEN, [6, 8, -noise], [0, -0.5, 0.1 * noise]))
    assert level == met(EVEN, line(EVEN, [6, 8, 0], [0, -0.5, 0]))
    assert {row for _, _, row in level} == {2}
    falling = met(EVEN, line(EVEN, [6, -noise, 9], [0.1 * noise, noise, -1]))
    assert falling == met(EVEN, line(EVEN, [6, 0, 9], [0, 0, -1]))
    assert {column for _, column, _ in falling} == {3}
