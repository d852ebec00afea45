"""A goal that was flown past and is circled is come to again from where there is room."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.live.recovery.run_up import LEAST, MOST, run_up
from clearway.live.routing.seen_planner import SeenPlanner
from clearway.studies.campaigns.families import make_case
from seen_ways_for_tests import RADIUS_M, look, planner

GOAL, HERE = np.zeros(3), np.array([3.8, 0.0, 0.0])


def told_of(returns_m: np.ndarray) -> SeenPlanner:
    return look(planner(heights_m=(-16.0, 16.0)), returns_m, HERE)


def found(routes: SeenPlanner) -> np.ndarray | None:
    return run_up(routes.cells, HERE, GOAL, RADIUS_M, routes.room_m)


def row(start: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    """[n, 3] returns of a tall wall between two places from above."""
    count = int(np.hypot(end[0] - start[0], end[1] - start[1])) + 1
    level = np.linspace(start, end, count)
    return np.concatenate([np.insert(level, 2, z, axis=1) for z in np.arange(-20.0, 20.5, 1.0)])


def street(south_m: float, north_m: float) -> np.ndarray:
    """Walls on both sides of a street along y, 8 m apart."""
    return np.concatenate([row((x, south_m), (x, north_m)) for x in (-4.0, 4.0)])


def test_in_the_open_it_begins_outside_of_the_circle_and_no_farther_than_it_must() -> None:
    place = found(told_of(np.zeros((0, 3))))
    assert place is not None
    away = np.hypot(*place[:2])
    assert LEAST * RADIUS_M <= away <= LEAST * RADIUS_M + 3.0
    assert place[0] > 0.0, "not on the far side"


def test_out_of_a_street_it_begins_beyond_its_end_where_there_is_room_to_turn() -> None:
    routes = told_of(street(-60.0, 16.0))
    place = found(routes)
    assert place is not None
    assert 16.0 < place[1] <= MOST * RADIUS_M
    assert abs(place[0]) < 4.0, "a straight way to the goal leads through the end of the street"


def test_where_no_such_place_is_known_there_is_none() -> None:
    assert found(told_of(street(-60.0, 60.0))) is None


def test_a_goal_high_above_what_is_kept_has_none() -> None:
    routes = told_of(np.zeros((0, 3)))
    for height_m in (40.0, -40.0):
        goal = np.array([0.0, 0.0, height_m])
        assert run_up(routes.cells, HERE, goal, RADIUS_M, routes.room_m) is None


def test_a_goal_beyond_what_is_kept_has_none() -> None:
    routes = told_of(np.zeros((0, 3)))
    goal = np.array([500.0, 0.0, 0.0])
    assert run_up(routes.cells, HERE, goal, RADIUS_M, routes.room_m) is None


def test_a_place_that_was_tried_gives_way_to_another() -> None:
    routes = told_of(street(-16.0, 15.0))
    first = found(routes)
    assert first is not None
    assert first[1] > 0.0
    for _ in range(40):
        place = found(routes)
        if place is None or place[1] < 0.0:
            break
        routes.spend(place)
    assert place is not None
    assert place[1] < 0.0


@pytest.mark.nightly
def test_a_waypoint_at_a_corner_of_streets_is_reached_though_it_was_missed() -> None:
    """Between houses 8 m apart the plane circled it until its time was up."""
    case = make_case("street", 0, {}, {"safety": {"escape": "known"}}, Path())
    run = case.setup.fly_with("clearway")
    assert run.reached
