"""What own code may hand over by mistake: refused by name, never taken for something else."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clearway as cw
from clearway.base.checks import check_points
from clearway.base.errors import ClearwayError
from clearway.live import AvoidanceSystem
from worlds_for_tests import GRID, LIDAR, mission, planner

LEVEL = [[20.0, 0.0], [30.0, 5.0], [40.0, 0.0]]
"""Three places from above: six numbers, which are two places too."""
HERE = cw.State(np.zeros(3))


def system(**changed: object) -> AvoidanceSystem:
    there = AvoidanceSystem(planner(), mission((40.0, 0.0, 0.0)), **changed)
    there.update(HERE)
    there.decide(0.0)  # Readings wait for a question.
    return there


@pytest.mark.parametrize(
    ("takes", "named"),
    [
        (lambda: cw.Mission("m", HERE, waypoints_m=LEVEL), "waypoints_m: must have shape [n, 3]"),
        (
            lambda: cw.Mission("m", HERE, waypoints_m=[[9.0, 0.0, 0.0]], landing_m=LEVEL),
            "landing_m: must have shape [n, 3], got [3, 2]",
        ),
        (lambda: cw.Mission("m", HERE, waypoints_m=["a"]), "waypoints_m: places [n, 3]"),
        (lambda: cw.Mission("m", [0, 0, 0], waypoints_m=[[9.0, 0, 0]]), "takes a State, got list"),
        (lambda: system().fly_to(LEVEL, 0.0), "fly_to: must have shape [n, 3]"),
        (lambda: cw.ObstacleMap().distance_m(LEVEL), "must have shape [n, 3]"),
        (lambda: cw.ObstacleMap(None), "takes a sequence of obstacles, got NoneType"),
        (lambda: cw.ObstacleMap(cw.Obstacle.ball([0, 0, 0], 1.0)), "a sequence of obstacles"),
        (lambda: cw.ObstacleMap([1.0]), "takes an Obstacle, got float"),
        (lambda: GRID.cell_of(LEVEL), "must have shape [n, 3]"),
        (lambda: cw.AvoidanceGrid.uniform("10"), "range_m: a number or two are needed"),
        (lambda: cw.AvoidanceGrid.uniform((0.0, 5.0, 10.0)), "range_m: a number or two"),
        (lambda: cw.AvoidanceGrid.uniform(layers=2.5), "layers: a whole number from 1"),
        (lambda: cw.Lidar("l", None), "pattern: takes a BeamPattern, got NoneType"),
        (lambda: system(lidars=[LIDAR, LIDAR]), "is there twice"),
        (lambda: planner(ground_height_m=np.inf), "ground_height_m: must be a number"),
        (
            lambda: AvoidanceSystem(mission((9.0, 0.0, 0.0)), planner()),
            "takes a Planner, got Miss",
        ),
        (lambda: AvoidanceSystem(planner(), LEVEL), "mission: takes a Mission, got list"),
        (lambda: planner(ground_height_m=np.nan), "ground_height_m: must be a number"),
        (lambda: planner(scan_s=-1.0), "scan_s: must be a number from 0"),
        (lambda: planner(patience_turns=np.nan), "patience_turns: must be a number"),
    ],
)
def test_what_is_no_such_value_is_refused_by_name(takes: Callable[[], object], named: str) -> None:
    with pytest.raises(ClearwayError, match=re.escape(named)):
        takes()


def test_a_goal_may_be_a_list() -> None:
    there = system()
    there.fly_to([10.0, 5.0, 0.0], 0.0)
    assert there.mission.goals_m.tolist() == [[10.0, 5.0, 0.0]]


def test_masked_points_of_a_scan_are_no_points() -> None:
    points = np.ma.array(np.full((4, 3), 5.0), mask=[[False] * 3, [True] * 3] * 2)
    assert np.isnan(cw.Scan(points).points_m[:, 0]).tolist() == [False, True, False, True]


@given(shape=st.lists(st.integers(0, 4), max_size=3).map(tuple))
def test_places_are_never_laid_out_anew(shape: tuple[int, ...]) -> None:
    values = np.arange(float(np.prod(shape, dtype=int))).reshape(shape)
    if shape == (3,):
        assert check_points("there", values).tolist() == [values.tolist()]
    elif shape == (0,) or (len(shape) == 2 and shape[1] == 3):
        assert check_points("there", values).tolist() == values.tolist()
    else:
        with pytest.raises(ClearwayError, match="there: must have shape"):
            check_points("there", values)


@pytest.mark.parametrize("kind", [int, np.float32, np.int64, np.array, bool])
def test_numbers_of_an_own_state_are_of_one_kind(kind: Callable[..., object]) -> None:
    """Margins are made of them: numbers of 4 bytes would be added with other roundings."""
    one = kind(1)
    state = cw.State(np.zeros(3), time_s=one, position_std_m=one, attitude_std_rad=one)
    numbers = (state.time_s, state.position_std_m, state.attitude_std_rad)
    assert numbers == (1.0, 1.0, 1.0)
    assert {type(number) for number in numbers} == {float}


@pytest.mark.parametrize("height_m", [np.nan, 1e10, None, "low"])
def test_a_floor_that_is_no_height_is_refused(height_m: object) -> None:
    flown = system()
    with pytest.raises(ClearwayError, match="floor_m: must be a number up to 1e"):
        flown.floor_m = height_m
    assert flown.floor_m == -np.inf
