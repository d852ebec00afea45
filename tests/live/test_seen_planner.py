"""Ways through seen space: round walls, through doors, and what is kept of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.arrays import FloatArray
from clearway.live.routing.field.cell_prices import (
    PriceRule,
    cell_holding,
    middle_of_cell,
    prices_of,
)
from clearway.live.routing.field.known_space import PROVES_EVERY
from clearway.live.routing.field.route_levels import Levels
from clearway.live.routing.seen_planner import (
    HARDLY_ROOM,
    NO_ROOM_TO_TURN,
    SeenPlanner,
    SeenRoute,
)
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from seen_ways_for_tests import MARGIN_M, RADIUS_M, REACH_M, START, look, planner, wall

GOAL = np.array([30.0, 0.0, 0.0])


def within(returns_m: FloatArray, place_m: FloatArray, reach_m: float = REACH_M) -> FloatArray:
    return returns_m[np.linalg.norm(returns_m - place_m, axis=1) <= reach_m]


def places_along(route: SeenRoute, start_m: FloatArray) -> FloatArray:
    corners = np.concatenate([start_m[None], route.corners_m])
    share = np.linspace(0.0, 1.0, 50)[:, None]
    return np.concatenate([a + share * (b - a) for a, b in pairwise(corners)])


def crossed_m(route: SeenRoute, x_m: float, start_m: FloatArray = START) -> float:
    """Where along y a way first comes past some x."""
    places = places_along(route, start_m)
    return float(places[np.argmax(places[:, 0] >= x_m), 1])


def price_at(routes: SeenPlanner, place_m: list[float]) -> float:
    cells = routes.cells
    return float(cells.price[cell_holding(cells.levels, *place_m)])


# Ways --------------------------------------------------------------------------------------


@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
def test_a_way_through_the_open_is_straight_and_ends_at_the_goal(turning_m: float) -> None:
    goal = np.array([20.0, 8.0, 0.0])
    route = look(planner(turning_m), np.zeros((0, 3)), seen=True).find_seen_route(START, goal)
    assert route.reaches
    np.testing.assert_allclose(route.corners_m[-1], goal)
    assert route.length_m == pytest.approx(np.linalg.norm(goal), rel=0.02)
    assert route.in_vain_m == 0.0


@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
@pytest.mark.parametrize("door_m", [-9.0, 12.0])
def test_a_way_leads_through_the_one_door_of_a_wall(turning_m: float, door_m: float) -> None:
    returns = np.concatenate(
        [wall((12.0, -60.0), (12.0, door_m - 3.0)), wall((12.0, door_m + 3.0), (12.0, 60.0))]
    )
    route = look(planner(turning_m), returns, seen=True).find_seen_route(START, GOAL)
    assert abs(crossed_m(route, 12.0) - door_m) < 3.0 - MARGIN_M


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_no_way_over_cells_is_much_shorter_than_the_one_that_is_found(seed: int) -> None:
    """Among columns on one level; against the least sum of steps from cell to cell, which lie
    askew: up to 8 % longer than what they go round."""
    rng = np.random.default_rng(seed)
    columns = rng.uniform([3.0, -18.0], [27.0, 18.0], (40, 2))
    returns = np.column_stack([columns, np.zeros(len(columns))])
    routes = planner(0.0, heights_m=(0.0, 0.0))
    route = look(routes, returns, seen=True).find_seen_route(START, GOAL)
    assert route.reaches
    least = _least_m(routes)
    assert route.length_m <= 1.03 * least + 1.0
    away = np.linalg.norm(places_along(route, START)[:, None, :2] - columns, axis=2)
    assert away.min() > 0.5 * MARGIN_M


def _least_m(routes: SeenPlanner) -> float:
    """Length of the shortest way over open cells of the finest level, by looking at all."""
    levels, price = routes.cells.levels, routes.cells.price
    n = levels.n
    open_cells = np.isfinite(price[: n * n * levels.layers].reshape(n, n, levels.layers)[:, :, 0])
    far = np.full((n, n), np.inf)
    start = tuple(np.floor(START[:2] / levels.width_m).astype(int) - levels.low[0])
    goal = tuple(np.floor(GOAL[:2] / levels.width_m).astype(int) - levels.low[0])
    far[start] = 0.0
    steps = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
    for _ in range(4 * n):
        before = far.copy()
        for a, b in steps:
            moved = np.full((n, n), np.inf)
            to = (slice(max(a, 0), n + min(a, 0)), slice(max(b, 0), n + min(b, 0)))
            of = (slice(max(-a, 0), n + min(-a, 0)), slice(max(-b, 0), n + min(-b, 0)))
            moved[to] = far[of] + levels.width_m * np.hypot(a, b)
            far = np.where(open_cells, np.minimum(far, moved), np.inf)
            far[start] = 0.0
        if np.array_equal(before, far):
            break
    return float(far[goal])


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
def test_that_no_way_leads_out_of_what_is_closed_is_known_for_sure(
    turning_m: float, closed: bool
) -> None:
    corners = [(12.0, -12.0), (12.0, 12.0), (-12.0, 12.0), (-12.0, -12.0), (12.0, -12.0)]
    sides = [wall(*ends) for ends in pairwise(corners)]
    if not closed:
        sides[2] = wall((-12.0, 12.0), (-12.0, -6.0))
    route = look(planner(turning_m), np.concatenate(sides)).find_seen_route(START, GOAL)
    assert route.reaches == (not closed)
    if closed:
        assert not len(route.corners_m)
        assert route.length_m == np.inf
    else:
        np.testing.assert_array_equal(route.corners_m[-1], GOAL)


def test_a_way_leads_through_a_maze() -> None:
    rows = []
    for number, x in enumerate(range(6, 24, 6)):
        ends = (-20.0, 12.0) if number % 2 else (-12.0, 20.0)
        rows.append(wall((float(x), ends[0]), (float(x), ends[1])))
    around = [wall((-6.0, y), (24.0, y)) for y in (-20.0, 20.0)]
    around.append(wall((-6.0, -20.0), (-6.0, 20.0)))
    routes = look(planner(0.0), np.concatenate([*rows, *around]), seen=True)
    route = routes.find_seen_route(START, GOAL)
    assert route.reaches
    assert [crossed_m(route, x) > 0.0 for x in (6.0, 12.0, 18.0)] == [False, True, False]


def test_a_gap_too_far_off_to_be_seen_in_coarse_cells_is_not_said_to_be_none() -> None:
    """4 m wide, 50 m off: closed in cells of 4 m, open in the finest."""
    far_m = 50.0
    returns = np.concatenate(
        [
            wall((far_m, -40.0), (far_m, -2.0)),
            wall((far_m, 2.0), (far_m, 40.0)),
            wall((far_m, -40.0), (-40.0, -40.0)),
            wall((far_m, 40.0), (-40.0, 40.0)),
            wall((-40.0, -40.0), (-40.0, 40.0)),
        ]
    )
    goal = np.array([60.0, 0.0, 0.0])
    assert look(planner(0.0), returns, seen=True).find_seen_route(START, goal).reaches


@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
@pytest.mark.parametrize("x_m", [9.9, 10.9, 12.1])
def test_no_way_leads_through_a_wall_that_the_vehicle_is_close_to(
    x_m: float, turning_m: float
) -> None:
    routes = planner(turning_m)
    place = np.array([x_m, 0.3, 0.0])
    look(routes, wall((11.5, -20.0), (11.5, 20.0)), place)
    way = places_along(routes.find_seen_route(place, GOAL), place)
    beyond = way[way[:, 0] > 11.5]
    assert (np.abs(beyond[0, 1]) > 19.0) == (x_m < 11.5)


@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
def test_a_way_to_a_goal_in_what_stands_ends_beside_it(turning_m: float) -> None:
    goal = np.array([20.0, 0.0, 0.0])
    returns = np.concatenate([wall((20.0 + d, -0.5), (20.0 + d, 0.5)) for d in (-0.5, 0.0, 0.5)])
    route = look(planner(turning_m), returns, seen=True).find_seen_route(START, goal)
    assert route.reaches
    assert route.length_m == pytest.approx(20.0, abs=1.0)


def test_a_way_to_a_goal_close_behind_a_wall_leads_round_it() -> None:
    goal = np.array([12.7, 0.0, 0.0])
    routes = look(planner(0.0), wall((12.0, -15.0), (12.0, 15.0)), seen=True)
    assert abs(crossed_m(routes.find_seen_route(START, goal), 12.0)) > 15.0


def test_a_goal_beyond_the_near_cells_is_flown_to_by_the_side_that_costs_least() -> None:
    returns = wall((12.0, -12.0), (12.0, 40.0))
    routes = look(planner(), returns, seen=True)
    route = routes.find_seen_route(START, np.array([65.0, 0.0, 0.0]))
    assert route.reaches
    assert crossed_m(route, 12.0) < -12.0


def test_another_way_is_taken_only_where_it_is_clearly_better() -> None:
    def two_doors(ends_m: float) -> SeenPlanner:
        sides = [wall((12.0, -60.0), (12.0, -ends_m)), wall((12.0, 9.0), (12.0, 60.0))]
        return look(
            planner(0.0), np.concatenate([wall((12.0, -5.0), (12.0, 4.0)), *sides]), seen=True
        )

    left, right = np.array([12.0, 6.5, 0.0]), np.array([12.0, -7.0, 0.0])
    goal = np.array([24.0, 0.0, 0.0])
    open_both = two_doors(9.0)
    assert crossed_m(open_both.find_seen_route(START, goal), 12.0) > 0.0
    assert crossed_m(open_both.find_seen_route(START, goal, (right, goal)), 12.0) < 0.0
    assert crossed_m(open_both.find_seen_route(START, goal, (left, goal)), 12.0) > 0.0
    assert crossed_m(two_doors(5.0).find_seen_route(START, goal, (right, goal)), 12.0) > 0.0


@pytest.mark.parametrize("quarter", range(4))
def test_of_two_alike_the_same_is_taken_whichever_way_the_world_is_turned(quarter: int) -> None:
    """By the compass it would be another for each of them."""
    angle = 0.5 * np.pi * quarter
    c, s = np.round([np.cos(angle), np.sin(angle)])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    goal = np.array([24.0, 0.0, 0.0])
    routes = look(planner(0.0), wall((12.0, -10.0), (12.0, 10.0)) @ turn.T, seen=True)
    corners = routes.find_seen_route(START, turn @ goal).corners_m @ turn
    assert corners[0, 1] < -9.0, "not past the right"


# Prices ------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0.5, 4.0))
def test_a_cell_has_room_where_one_about_it_is_far_enough_from_what_stands(
    seed: int, turning_m: float
) -> None:
    rng = np.random.default_rng(seed)
    n, layers, width, layer_m, closed = 6, 3, 0.3, 0.4, 0.8
    zeros = np.zeros((1, 2), dtype=np.int64)
    levels = Levels(1, n, layers, zeros, zeros, width, 0.0, layer_m)
    clearance = rng.uniform(0.0, 6.0, n * n * layers)
    rule = PriceRule(closed, MARGIN_M, 100.0, turning_m, NO_ROOM_TO_TURN, HARDLY_ROOM)
    blank = np.zeros(len(clearance))
    price = prices_of(levels, clearance, np.ones(len(clearance), dtype=bool), blank, rule)
    middles = np.array([middle_of_cell(levels, cell) for cell in range(len(clearance))])
    away = np.linalg.norm(middles[:, None] - middles, axis=2)
    expected = np.ones(len(clearance))
    for share, times in ((1.0, NO_ROOM_TO_TURN), (0.5, HARDLY_ROOM / NO_ROOM_TO_TURN)):
        wide = clearance >= MARGIN_M + share * turning_m
        has_room = np.any((away <= share * turning_m) & wide, axis=1)
        expected[~has_room & ~wide] *= times
    expected[clearance < closed] = np.inf
    np.testing.assert_allclose(price, expected)


def test_who_passes_a_lone_trunk_beside_open_space_keeps_off_it_no_farther_than_it_must() -> None:
    """The price of no room to turn is for where there is none, not for what stands alone."""
    route = look(planner(), wall((12.0, 0.0), (12.0, 0.5)), seen=True).find_seen_route(START, GOAL)
    assert MARGIN_M < abs(crossed_m(route, 12.0)) < 3.5
    assert route.in_vain_m == 0.0


def test_no_way_leads_through_a_wall_at_a_height_nobody_saw_while_a_door_is_open() -> None:
    """All round the start stands a wall, seen between -3 and 3 m; its door is behind."""
    corners = [(12.0, -12.0), (12.0, 12.0), (-12.0, 12.0), (-12.0, 4.5)]
    corners_below = [(12.0, -12.0), (-12.0, -12.0), (-12.0, -4.5)]
    sides = [*pairwise(corners), *pairwise(corners_below)]
    returns = np.concatenate([wall(start, end) for start, end in sides])
    routes = look(planner(), returns[np.abs(returns[:, 2]) <= 3.0])
    assert abs(crossed_m(routes.find_seen_route(START, GOAL), 12.0)) > 12.0


# What is kept ------------------------------------------------------------------------------


def test_walls_stay_where_they_stand_when_nothing_else_remembers_them() -> None:
    ahead = wall((8.0, -12.0), (8.0, 12.0))
    routes = look(planner(), ahead, reach_m=REACH_M)
    assert abs(crossed_m(routes.find_seen_route(START, GOAL), 8.0)) > 11.0
    away = np.array([-30.0, 0.0, 0.0])
    for x in np.arange(0.0, -30.0, -5.0):
        place = np.array([x, 0.0, 0.0])
        look(routes, within(ahead, place), place, REACH_M)
    for _ in range(PROVES_EVERY):
        look(routes, np.zeros((0, 3)), away, REACH_M)
    assert price_at(routes, [8.0, 0.0, 0.0]) == np.inf
    assert abs(crossed_m(routes.find_seen_route(away, GOAL), 8.0, away)) > 11.0


def test_what_stands_at_the_end_of_a_long_street_is_known_at_its_mouth() -> None:
    """Also by who can stop, whose cells are small: forgotten, it would be flown into for ever."""
    end, routes = wall((8.0, -6.0), (8.0, 6.0)), planner(0.0)
    for x in np.arange(0.0, -50.0, -5.0):
        place = np.array([x, 0.0, 0.0])
        look(routes, within(end, place), place, REACH_M)
    for y in (-5.0, 0.0, 5.0):
        assert price_at(routes, [8.0, y, 0.0]) == np.inf


def test_what_was_seen_to_be_free_is_known_behind_the_vehicle() -> None:
    routes = look(planner(0.0), np.zeros((0, 3)), seen=True)
    for x in np.arange(0.0, 26.0, 5.0):
        look(routes, np.zeros((0, 3)), np.array([x, 0.0, 0.0]))
    assert price_at(routes, [0.0, 0.0, 0.0]) == 1.0
    assert price_at(routes, [50.0, 0.0, 0.0]) > 1.0


def test_what_is_no_longer_seen_in_reach_bars_no_way() -> None:
    routes = look(planner(), wall((8.0, -12.0), (8.0, 12.0)))
    for _ in range(PROVES_EVERY):
        look(routes, np.zeros((0, 3)))
    assert np.isfinite(routes.cells.price).all()


@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
def test_a_map_bars_ways_before_anything_is_seen(turning_m: float) -> None:
    world = ObstacleMap([Obstacle.cuboid((8.0, 0.0, 0.0), (1.0, 24.0, 200.0))])
    route = look(planner(turning_m, world), np.zeros((0, 3))).find_seen_route(START, GOAL)
    assert abs(crossed_m(route, 8.0)) > 11.0


# What came to nothing ----------------------------------------------------------------------


def test_a_door_that_is_never_come_nearer_to_gives_way_to_another() -> None:
    two_doors = np.concatenate(
        [
            wall((12.0, -60.0), (12.0, -18.0)),
            wall((12.0, -10.0), (12.0, 2.0)),
            wall((12.0, 10.0), (12.0, 60.0)),
        ]
    )
    routes = look(planner(), two_doors, seen=True)
    route = routes.find_seen_route(START, GOAL)
    assert 2.0 < crossed_m(route, 12.0) < 10.0
    for _ in range(40):
        routes.aim(route.begins_m)
        assert not routes.came_nearer(START, 6.0)
        route = routes.find_seen_route(START, GOAL, (*route.corners_m, GOAL))
        if crossed_m(route, 12.0) < 0.0:
            break
    assert -18.0 < crossed_m(route, 12.0) < -10.0
    assert routes.cells.in_vain.max() > 0.0
    routes.try_all_again()
    assert routes.cells.in_vain.max() == 0.0
    assert crossed_m(routes.find_seen_route(START, GOAL), 12.0) > 0.0


@pytest.mark.parametrize(("top_m", "above"), [(17.0, True), (4.0, False)])
def test_a_gap_that_came_to_nothing_is_no_other_at_another_height(
    top_m: float, above: bool
) -> None:
    """What was tried in a wall as tall as can be seen costs more at all heights; where the wall was
    seen to end, the way over it costs what it did."""
    sides = [((12.0, -20.0), (12.0, -3.0)), ((12.0, 3.0), (12.0, 20.0))]
    returns = np.concatenate([wall(*ends, top_m=top_m) for ends in sides])
    routes = look(planner(heights_m=(-20.0, 20.0)), returns, seen=True)
    routes.aim(np.array([START, [12.0, 0.0, 0.0]]))
    assert not routes.came_nearer(START, 6.0)
    cells = routes.cells
    at = cell_holding(cells.levels, 12.0, 0.0, 18.0)
    assert (cells.in_vain[at] > 0.0) == above


def test_flying_along_a_way_costs_nothing() -> None:
    routes = look(planner(), wall((12.0, -12.0), (12.0, 12.0)))
    route = routes.find_seen_route(START, GOAL)
    routes.aim(route.begins_m)
    on = route.begins_m[min(2, len(route.begins_m) - 1)]
    assert routes.came_nearer(on, float(np.linalg.norm(on)))
    assert routes.cells.in_vain.max() == 0.0


@pytest.mark.parametrize("turning_m", [0.0, RADIUS_M])
def test_a_way_out_of_a_room_is_found_by_looking(turning_m: float) -> None:
    """The walls show only as far as the sensor sees, and the door is behind the start."""
    sides = [
        ((12.0, -10.0), (12.0, 10.0)),
        ((-14.0, 10.0), (12.0, 10.0)),
        ((-14.0, -10.0), (12.0, -10.0)),
        ((-14.0, -10.0), (-14.0, 0.0)),
    ]
    room = np.concatenate([wall(*ends) for ends in sides])
    routes, place, flown, known = planner(turning_m), START, 0.0, np.zeros((0, 3))
    way: tuple[FloatArray, ...] = ()
    for _ in range(60):
        known = np.unique(np.concatenate([known, within(room, place, 10.0)]), axis=0)
        look(routes, within(known, place), place, REACH_M)
        route = routes.find_seen_route(place, GOAL, way)
        assert route.reaches
        way = (*route.corners_m, GOAL)
        along = places_along(route, place)
        passed = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(along, axis=0), axis=1)))
        step = along[: int(np.searchsorted(passed, 6.0)) + 1]
        away = np.linalg.norm(step[:, None] - known[None, ::3], axis=2).min()
        assert away > 0.5
        place, flown = step[-1], flown + min(6.0, float(passed[-1]))
        if np.linalg.norm(place - GOAL) < 2.0:
            break
    assert np.linalg.norm(place - GOAL) < 2.0
    assert flown < 160.0
