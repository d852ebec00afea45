"""Vehicle times per cell, radial and of a reach set, and the timed rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.reach import build_reach_set
from clearway.traffic import (
    Intruder,
    VehicleTimes,
    line_cells,
    radial_vehicle_times,
    reach_set_vehicle_times,
)
from clearway.traffic.models.timing import TIMED_RULES
from clearway.vehicle.automaton import MovementAutomaton

GRID = AvoidanceGrid.uniform()


def as_cells(values: Any) -> np.ndarray:
    return np.array(values, dtype=np.float64).ravel()


def test_radial_known_answers(known_answers: dict[str, Any]) -> None:
    times = radial_vehicle_times(GRID, 1.0)
    expected = known_answers["vehicle_times_radial_1mps"]
    np.testing.assert_allclose(times.entry_s, as_cells(expected["t_e"]), atol=1e-12)
    np.testing.assert_allclose(times.leave_s, as_cells(expected["t_l"]), atol=1e-12)


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_radial_needs_a_speed(speed: float) -> None:
    with pytest.raises(ClearwayError, match="speed_mps"):
        radial_vehicle_times(GRID, speed)


@pytest.mark.parametrize(
    ("rule", "key"),
    [
        ("vehicle", "P_timed_5_5"),
        ("future", "future_recommended"),
        ("future-printed", "future_6_8_printed"),
    ],
)
def test_rules_known_answers(known_answers: dict[str, Any], rule: str, key: str) -> None:
    line = line_cells(GRID, [Intruder([6, 8, 0], [0, -1, 0])])
    timed = TIMED_RULES[rule](line, radial_vehicle_times(GRID, 1.0))[0]
    expected = as_cells(known_answers["intruder"]["line"][key])
    np.testing.assert_allclose(timed, expected, atol=1e-8)


def test_fast_intruder_is_capped_by_vehicle_share_only() -> None:
    # In cell (5, 4, 2) for a quarter of the time that the vehicle needs through its layer.
    line = line_cells(GRID, [Intruder([5.5, 240.8, 0], [0, -40, 0])])
    vehicle = radial_vehicle_times(GRID, 1.0)
    cell = GRID.cell_of([[5.5, 0.8, 0]])[0]
    stay_s = line.dwell_s[0, cell]
    assert 5.0 < line.entry_s[0, cell] < line.leave_s[0, cell] < 7.0
    overlap = min(line.leave_s[0, cell], 6.0) - line.entry_s[0, cell]
    for rule, whole in (("vehicle", 1.0), ("intruder", stay_s), ("shorter", min(1.0, stay_s))):
        timed = TIMED_RULES[rule](line, vehicle)[0, cell]
        assert timed == pytest.approx(max(0.0, overlap) / whole)


def test_standing_intruder_is_there_all_the_time() -> None:
    line = line_cells(GRID, [Intruder([5.5, 0, 0], [0, 0, 0])])
    vehicle = radial_vehicle_times(GRID, 1.0)
    cell = GRID.cell_of([[5.5, 0, 0]])[0]
    assert TIMED_RULES["vehicle"](line, vehicle)[0, cell] == 1.0
    assert TIMED_RULES["shorter"](line, vehicle)[0, cell] == 1.0
    assert TIMED_RULES["intruder"](line, vehicle)[0, cell] == 0.0
    assert TIMED_RULES["future"](line, vehicle)[0, cell] == 1.0


def test_without_a_passing_trajectory_nothing_is_timed() -> None:
    line = line_cells(GRID, [Intruder([6, 8, 0], [0, -1, 0])])
    empty = VehicleTimes(np.full(GRID.cells, np.inf), np.full(GRID.cells, -np.inf))
    for rule in TIMED_RULES.values():
        np.testing.assert_array_equal(rule(line, empty), 0.0)


@dataclass
class Tree:
    """What vehicle times need of a reach set."""

    grid: AvoidanceGrid
    parent: np.ndarray
    end_time_s: np.ndarray
    samples_m: np.ndarray
    cell_start: np.ndarray
    cell_index: np.ndarray


def chain(ends_m: np.ndarray, cells: list[list[int]]) -> Tree:
    """One trajectory through given points, two seconds a movement."""
    nodes = len(ends_m)
    starts = np.vstack([np.zeros(3), ends_m[:-1]])
    part = np.array([0.25, 0.5, 0.75, 1.0])[:, None]
    return Tree(
        grid=GRID,
        parent=np.arange(-1, nodes - 1, dtype=np.int32),
        end_time_s=2.0 * np.arange(1, nodes + 1),
        samples_m=starts[:, None, :] + part * (ends_m - starts)[:, None, :],
        cell_start=np.cumsum([0] + [len(each) for each in cells]).astype(np.int32),
        cell_index=np.concatenate(cells).astype(np.int32),
    )


def test_reach_set_times_along_a_straight_flight() -> None:
    ends = np.column_stack([np.arange(1.0, 11.0), np.zeros(10), np.zeros(10)])
    cells = [[int(GRID.cell_of([[i + 0.5, 0, 0]])[0])] for i in range(10)]
    times = reach_set_vehicle_times(chain(ends, cells))
    middle = [cell for node in cells for cell in node]
    np.testing.assert_allclose(times.entry_s[middle], 2.0 * np.arange(10))
    np.testing.assert_allclose(times.leave_s[middle], 2.0 * np.arange(1, 11))
    others = np.setdiff1d(np.arange(GRID.cells), middle)
    assert np.all(np.isinf(times.entry_s[others]) & (times.entry_s[others] > 0))
    assert np.all(np.isinf(times.leave_s[others]) & (times.leave_s[others] < 0))


def test_a_cell_that_only_the_curve_touches_gets_the_whole_movement() -> None:
    beside = int(GRID.cell_of([[1.5, 0.5, 0]])[0])
    straight = [int(GRID.cell_of([[i + 0.5, 0, 0]])[0]) for i in range(2)]
    ends = np.array([[1.0, 0, 0], [2.0, 0, 0]])
    times = reach_set_vehicle_times(chain(ends, [[straight[0]], [straight[1], beside]]))
    assert (times.entry_s[beside], times.leave_s[beside]) == (2.0, 4.0)


def test_times_of_a_real_reach_set() -> None:
    reach_set = build_reach_set(MovementAutomaton.plane(), GRID, method="harmonic")
    times = reach_set_vehicle_times(reach_set)
    passed = np.zeros(GRID.cells, dtype=bool)
    passed[reach_set.cell_index] = True
    assert np.all(np.isfinite(times.entry_s[passed]) & np.isfinite(times.leave_s[passed]))
    assert np.all(times.entry_s[passed] < times.leave_s[passed])
    # At 1 m/s no cell is entered before its layer is in reach.
    near_m = np.repeat(GRID.range_edges_m[:-1], GRID.columns * GRID.rows)
    assert np.all(times.entry_s >= near_m - 0.02)
    shaped = GRID.reshape(times.entry_s)
    np.testing.assert_allclose(shaped, shaped[:, ::-1], atol=1e-6)


def test_times_along_a_turn_are_those_of_the_curve() -> None:
    # Seen from the start of a turn the azimuth grows half as fast as the heading, 7.5 deg/s here.
    heading = np.radians(15.0) * np.array([0.25, 0.5, 0.75, 1.0])
    radius_m = 1.0 / np.radians(15.0)
    turn = np.stack([np.sin(heading), 1.0 - np.cos(heading), np.zeros(4)], axis=1) * radius_m
    ahead, left = (int(cell) for cell in GRID.cell_of([[0.5, 0.0, 0.0], [0.5, 0.1, 0.0]]))
    tree = chain(np.array([[1.0, 0.0, 0.0]]), [[ahead, left]])
    tree.samples_m, tree.end_time_s = turn[None], np.array([1.0])
    times = reach_set_vehicle_times(tree)
    across_s = np.degrees(GRID.azimuth_edges_rad[4]) / 7.5
    assert times.leave_s[ahead] == pytest.approx(across_s, abs=1e-4)
    assert times.entry_s[left] == pytest.approx(across_s, abs=1e-4)
    assert times.leave_s[left] == pytest.approx(1.0)
