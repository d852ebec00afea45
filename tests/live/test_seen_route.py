"""Ways over coarse cells: round walls, through doors, and what is kept of them."""

from __future__ import annotations

import heapq
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from clearway.avoidance.clear.hazards import PointHazards, no_points
from clearway.live.routing.cell_marking import leaves_no_room
from clearway.live.routing.open_way import any_way
from clearway.live.routing.route_map import (
    MOST_FINE,
    TALL_FINE,
    UNOBSERVED_COST,
    WIDEST,
    Cells,
    RouteMap,
)
from clearway.live.routing.seen_route import (
    BARRED,
    ENDS_BESIDE,
    GREEDY,
    MOST_GREEDILY,
    MOST_LOOKED,
    VERTICAL,
    SeenRoute,
    _cheapest,
    seen_route,
)
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors.observed.free_space import SHAPE, FreeSpace
from clearway.sensors.observed.free_voxels import pack_voxels
from clearway.sensors.observed.seen_space import NOTHING_SEEN

MARGIN_M, RADIUS_M, VOXEL_M, REACH_M = 0.6, 3.82, 0.25, 15.0
START, GOAL = np.zeros(3), np.array([30.0, 0.0, 0.0])


def wall(start: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    """[n, 3] returns of a tall wall between two places from above."""
    count = int(2.0 * np.hypot(end[0] - start[0], end[1] - start[1])) + 1
    level = np.linspace(start, end, count)
    heights = np.arange(-17.0, 17.5, 0.5)
    return np.concatenate([np.insert(level, 2, z, axis=1) for z in heights])


def balls(places_m: np.ndarray) -> PointHazards:
    return PointHazards(places_m, np.full(len(places_m), 0.1))


def seen_from(place_m: np.ndarray, returns_m: np.ndarray, reach_m: float = REACH_M) -> PointHazards:
    return balls(returns_m[np.linalg.norm(returns_m - place_m, axis=1) <= reach_m])


def mapped(returns_m: np.ndarray, reach_m: float = 100.0) -> RouteMap:
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M)
    routes.take(NOTHING_SEEN, balls(returns_m), START, reach_m)
    return routes


def places_along(route: SeenRoute, start_m: np.ndarray) -> np.ndarray:
    corners = np.concatenate([start_m[None], route.corners_m])
    share = np.linspace(0.0, 1.0, 50)[:, None]
    return np.concatenate([a + share * (b - a) for a, b in pairwise(corners)])


def crossed_m(route: SeenRoute, x_m: float, start_m: np.ndarray = START) -> float:
    """Where along y a way first comes past some x."""
    places = places_along(route, start_m)
    return float(places[np.argmax(places[:, 0] >= x_m), 1])


def open_cells(shape: tuple[int, int, int] = (20, 20, 3)) -> Cells:
    return Cells(
        np.array([-5.0, -10.0, -1.5]), 1.0, np.ones(shape), np.zeros(shape), np.full(shape, 9.0)
    )


# Ways --------------------------------------------------------------------------------------


def test_a_way_through_the_open_is_straight_and_ends_at_the_goal() -> None:
    goal = np.array([10.0, 4.0, 0.0])
    route = seen_route(open_cells(), START, goal)
    assert route.reaches
    np.testing.assert_allclose(route.corners_m, [goal])
    np.testing.assert_allclose(route.length_m, np.linalg.norm(goal))


def test_a_way_leads_through_the_one_door_of_a_wall() -> None:
    cells = open_cells()
    cells.price[10] = np.inf
    cells.price[10, 17:19] = 1.0
    route = seen_route(cells, START, np.array([10.0, 0.0, 0.0]))
    assert 6.5 <= crossed_m(route, 5.5) <= 9.5


SMALL = (7, 6, 3)


def step_price(price: np.ndarray, here: tuple[int, ...], there: tuple[int, ...]) -> float:
    a, b, c = np.subtract(there, here)
    ends = [BARRED if np.isinf(price[at]) else price[at] for at in (here, there)]
    return float(0.5 * np.sqrt(a * a + b * b + (VERTICAL * c) ** 2) * sum(ends))


def least_price(price: np.ndarray, start: tuple[int, ...], goal: tuple[int, ...]) -> float:
    """By looking at everything; out of barred cells nothing is asked for but that they are left."""
    beyond = not all(0 <= at < size for at, size in zip(goal[:2], SMALL[:2], strict=True))
    ends = ENDS_BESIDE if not beyond and np.isinf(price[goal]) else 0
    found, queue, best = {start: 0.0}, [(0.0, start)], np.inf
    while queue:
        spent, here = heapq.heappop(queue)
        if spent > found[here]:
            continue
        at_side = any(here[k] in (0, SMALL[k] - 1) for k in (0, 1))
        if beyond and at_side:
            best = min(
                best, spent + UNOBSERVED_COST * float(np.linalg.norm(np.subtract(goal, here)))
            )
        if np.abs(np.subtract(goal, here)).max() <= ends:
            best = min(best, spent)
        for step in product((-1, 0, 1), repeat=3):
            there = tuple(int(at) for at in np.add(here, step))
            inside = all(0 <= at < size for at, size in zip(there, SMALL, strict=True))
            if not inside or (np.isinf(price[there]) and not np.isinf(price[here])):
                continue
            cost = spent + step_price(price, here, there)
            if cost < found.get(there, np.inf):
                found[there] = cost
                heapq.heappush(queue, (cost, there))
    return best


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_no_way_is_cheaper_than_the_one_that_is_found(seed: int, is_seen: bool) -> None:
    rng = np.random.default_rng(seed)
    prices = [0.75, 1.0, 1.3, 2.0, 5.0, np.inf] if is_seen else [2.0, 2.0, 5.0, np.inf]
    price = rng.choice(prices, SMALL)
    if is_seen:
        price[:, rng.integers(SMALL[1]) :] = UNOBSERVED_COST
    start = tuple(int(rng.integers(size)) for size in SMALL)
    goal = (int(rng.integers(-3, 12)), int(rng.integers(-3, 12)), int(rng.integers(SMALL[2])))
    room = np.full(SMALL, 9.0)
    way, _ = _cheapest(
        price, room, np.array(start, float), np.array(goal, float), 60.0, 1.0, MOST_LOOKED
    )
    least = least_price(price, start, goal)
    if not len(way):
        assert np.isinf(least)
        return
    cells = [tuple(int(at) for at in cell) for cell in way]
    spent = sum(step_price(price, *ends) for ends in pairwise(cells))
    if not all(0 <= at < size for at, size in zip(goal[:2], SMALL[:2], strict=True)):
        spent += UNOBSERVED_COST * float(np.linalg.norm(way[-1] - goal))
    assert spent == pytest.approx(least)


@given(st.integers(0, 2**32 - 1), st.floats(0.2, 0.8))
def test_any_way_is_found_where_the_cheapest_is(seed: int, filled: float) -> None:
    rng = np.random.default_rng(seed)
    price = np.where(rng.uniform(size=SMALL) < filled, np.inf, 1.0)
    nearest = rng.choice([0.3, 0.6, 9.0], SMALL)
    start = np.array([rng.integers(size) for size in SMALL], dtype=np.float64)
    goal = np.array([rng.integers(-2, 10), rng.integers(-2, 10), rng.integers(SMALL[2])], float)
    way, _ = _cheapest(price, nearest, start, goal, np.inf, 1.0, MOST_LOOKED)
    some = any_way(price, nearest, start, goal, ENDS_BESIDE)
    assert bool(len(some)) == bool(len(way))
    if len(some):
        np.testing.assert_array_equal(some[0], start)
        assert len(some) <= len(way)
        assert (np.abs(np.diff(some, axis=0)).max(axis=1, initial=1.0) == 1.0).all()
        begins_barred = np.isinf(price[tuple(start.astype(int))])
        assert begins_barred or np.isfinite(price[tuple(some.astype(int).T)]).all()


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("world", ["open", "clutter", "maze"])
def test_no_search_looks_at_more_cells_than_its_bound(world: str, closed: bool) -> None:
    """Wherever the goal is, in a box or behind what nobody has seen, a way that leads there is
    found, and that none does is known for sure."""
    price, rng = np.ones(WIDEST), np.random.default_rng(3)
    if world == "clutter":
        price[rng.uniform(size=WIDEST) < 0.2] = np.inf
        price[:3, :3] = 1.0
    elif world == "maze":
        for number, x in enumerate(range(4, 112, 6)):
            price[x] = np.inf
            price[x, -3:] = price[x, :3] = 1.0
            price[x, slice(3) if number % 2 else slice(-3, None)] = np.inf
    price[115:124, 50:70] = np.inf if closed else TALL_FINE
    price[118:121, 54:66] = 1.0
    nearest = np.where(np.isinf(price), 0.3, 9.0)
    cells = Cells(np.zeros(3), 1.0, price, np.zeros(WIDEST), nearest, MOST_FINE)
    start, goal = np.array([1.5, 1.5, 8.5]), np.array([119.5, 60.5, 8.5])
    begin, at = cells.cell_of(start), cells.cell_of(goal)
    for greed, most in ((1.0, MOST_LOOKED), (GREEDY, MOST_GREEDILY), (1.0, 100)):
        way, looked = _cheapest(price, cells.nearest_m, begin, at, cells.most, greed, most)
        assert looked <= most
        assert not (closed and len(way))
    route = seen_route(cells, start, goal)
    assert route.reaches == (not closed)
    if closed:
        assert not route.was_cut_off
    else:
        np.testing.assert_array_equal(route.corners_m[-1], goal)


def test_no_way_leads_out_of_what_is_closed() -> None:
    cells = open_cells()
    cells.price[10] = np.inf
    route = seen_route(cells, START, np.array([10.0, 0.0, 0.0]))
    assert not route.reaches
    assert not len(route.corners_m)
    assert route.length_m == np.inf


@pytest.mark.parametrize("x_m", [9.9, 10.9, 12.1])
def test_no_way_leads_through_a_wall_that_the_vehicle_is_close_to(x_m: float) -> None:
    routes = mapped(wall((11.5, -20.0), (11.5, 20.0)))
    place = np.array([x_m, 0.3, 0.0])
    way = places_along(seen_route(routes.cells(), place, GOAL), place)
    beyond = way[way[:, 0] > 11.5]
    assert (np.abs(beyond[0, 1]) > 19.0) == (x_m < 11.5)


def test_a_goal_beyond_the_cells_is_flown_to_over_the_side_that_costs_least() -> None:
    cells = open_cells()
    cells.price[12, 4:] = np.inf
    route = seen_route(cells, START, np.array([60.0, 0.0, 0.0]))
    assert route.reaches
    assert crossed_m(route, 7.5) < -5.5


def test_another_way_is_taken_only_where_it_is_clearly_better() -> None:
    cells = open_cells()
    cells.price[10] = np.inf
    cells.price[10, 3] = cells.price[10, 17] = 1.0
    left, right = np.array([5.5, 7.5, 0.0]), np.array([5.5, -6.5, 0.0])
    goal = np.array([10.0, 0.4, 0.0])
    shorter = crossed_m(seen_route(cells, START, goal), 5.5)
    assert shorter < 0.0
    assert crossed_m(seen_route(cells, START, goal, (left, goal)), 5.5) > 0.0
    assert crossed_m(seen_route(cells, START, goal, (right, goal)), 5.5) < 0.0
    cells.price[10, 17] = np.inf
    assert crossed_m(seen_route(cells, START, goal, (left, goal)), 5.5) < 0.0


# What is kept ------------------------------------------------------------------------------


def test_walls_stay_where_they_stand_when_nothing_else_remembers_them() -> None:
    ahead = wall((8.0, -12.0), (8.0, 12.0))
    routes = mapped(ahead, REACH_M)
    before = seen_route(routes.cells(), START, GOAL)
    assert abs(crossed_m(before, 8.0)) > 11.0

    away = np.array([-30.0, 0.0, 0.0])
    for x in np.arange(0.0, -30.0, -5.0):
        place = np.array([x, 0.0, 0.0])
        routes.take(NOTHING_SEEN, seen_from(place, ahead), place, REACH_M)
    routes.take(NOTHING_SEEN, no_points(), away, REACH_M)
    cells = routes.cells()
    at = cells.cell_of(np.array([8.0, 0.0, 0.0])).astype(int)
    assert cells.price[tuple(at)] == np.inf
    assert abs(crossed_m(seen_route(cells, away, GOAL), 8.0, away)) > 11.0


def test_what_stands_at_the_end_of_a_long_street_is_known_at_its_mouth() -> None:
    """Also by who can stop, whose cells are small: forgotten, it would be flown into for ever."""
    end = wall((8.0, -6.0), (8.0, 6.0))
    routes = RouteMap(VOXEL_M, MARGIN_M, 0.0)
    for x in np.arange(0.0, -50.0, -5.0):
        place = np.array([x, 0.0, 0.0])
        routes.take(NOTHING_SEEN, seen_from(place, end), place, REACH_M)
    cells = routes.cells()
    for y in (-5.0, 0.0, 5.0):
        at = cells.cell_of(np.array([8.0, y, 0.0])).astype(int)
        assert cells.price[tuple(at)] == np.inf


def test_what_is_no_longer_seen_in_reach_bars_no_way() -> None:
    routes = mapped(wall((8.0, -12.0), (8.0, 12.0)))
    routes.take(NOTHING_SEEN, no_points(), START, 100.0)
    assert np.isfinite(routes.cells().price).all()


def test_a_map_bars_ways_before_anything_is_seen() -> None:
    shape = Obstacle.cuboid((8.0, 0.0, 0.0), (1.0, 24.0, 200.0))
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M, ObstacleMap([shape]))
    routes.take(NOTHING_SEEN, no_points(), START, REACH_M)
    assert abs(crossed_m(seen_route(routes.cells(), START, GOAL), 8.0)) > 11.0


def test_a_door_that_is_never_come_nearer_to_gives_way_to_another() -> None:
    two_doors = np.concatenate(
        [
            wall((12.0, -30.0), (12.0, -18.0)),
            wall((12.0, -10.0), (12.0, 2.0)),
            wall((12.0, 10.0), (12.0, 30.0)),
        ]
    )
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M)
    seen = FreeSpace(VOXEL_M, START).seen
    routes.take(seen._replace(free=pack_voxels(np.ones(SHAPE))), balls(two_doors), START, 100.0)
    route = seen_route(routes.cells(), START, GOAL)
    assert 2.0 < crossed_m(route, 12.0) < 10.0
    for _ in range(40):
        routes.aim(route.begins_m)
        assert not routes.came_nearer(START, 6.0)
        route = seen_route(routes.cells(), START, GOAL, (*route.corners_m, GOAL))
        if crossed_m(route, 12.0) < 0.0:
            break
    assert -18.0 < crossed_m(route, 12.0) < -10.0
    assert routes.cells().in_vain.max() > 0.0


@given(
    nearest=hnp.arrays(np.float64, (5, 6, 4), elements=st.floats(0.0, 6.0)),
    room=st.floats(1.0, 5.0),
    within=st.floats(0.0, 4.0),
)
def test_a_cell_has_room_where_one_about_it_is_far_enough_from_what_stands(
    nearest: np.ndarray, room: float, within: float
) -> None:
    barred, width = 0.8, 1.5
    at = np.stack(np.indices(nearest.shape), axis=-1).reshape(-1, 3)
    wide = at[nearest.ravel() >= room]
    none = np.zeros(len(at), dtype=bool)
    for n, cell in enumerate(at):
        away = np.linalg.norm((wide - cell) * width, axis=1)
        none[n] = nearest.ravel()[n] >= barred and not np.any(away <= within)
    assert np.array_equal(leaves_no_room(nearest, barred, room, within, width).ravel(), none)


def test_who_passes_a_lone_trunk_beside_open_space_keeps_off_it_no_farther_than_it_must() -> None:
    """The price of no room to turn is for where there is none, not for what stands alone."""
    trunk = wall((12.0, 0.0), (12.0, 0.5))
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M, sees_m=15.0)
    seen = FreeSpace(VOXEL_M, START).seen
    routes.take(seen._replace(free=pack_voxels(np.ones(SHAPE))), balls(trunk), START, 100.0)
    route = seen_route(routes.cells(), START, GOAL)
    assert MARGIN_M < abs(crossed_m(route, 12.0)) < 3.0
    assert route.in_vain_m == 0.0


@pytest.mark.parametrize(("top_m", "above"), [(17.0, True), (4.0, False)])
def test_a_gap_that_came_to_nothing_is_no_other_at_another_height(
    top_m: float, above: bool
) -> None:
    """What was tried in a wall as tall as can be seen costs more at all heights; where the wall was
    seen to end, the way over it costs what it did."""
    returns = np.concatenate([wall((12.0, -20.0), (12.0, -3.0)), wall((12.0, 3.0), (12.0, 20.0))])
    returns = returns[returns[:, 2] <= top_m]
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M)
    seen = FreeSpace(VOXEL_M, START).seen
    routes.take(seen._replace(free=pack_voxels(np.ones(SHAPE))), balls(returns), START, 100.0)
    routes.aim(np.array([START, [12.0, 0.0, 0.0]]))
    assert not routes.came_nearer(START, 6.0)
    cells = routes.cells()
    at = cells.cell_of(np.array([12.0, 0.0, 15.0])).astype(np.int64)
    assert (cells.in_vain[tuple(at)] > 0.0) == above


def test_no_way_leads_through_a_wall_at_a_height_nobody_saw_while_a_door_is_open() -> None:
    """All round the start stands a wall, seen between -3 and 3 m; its door is behind."""
    corners = [(12.0, -12.0), (12.0, 12.0), (-12.0, 12.0), (-12.0, 4.5)]
    corners_below = [(12.0, -12.0), (-12.0, -12.0), (-12.0, -4.5)]
    sides = [*pairwise(corners), *pairwise(corners_below)]
    returns = np.concatenate([wall(start, end) for start, end in sides])
    routes = mapped(returns[np.abs(returns[:, 2]) <= 3.0])
    assert abs(crossed_m(seen_route(routes.cells(), START, GOAL), 12.0)) > 12.0


def test_flying_along_a_way_costs_nothing() -> None:
    routes = mapped(wall((12.0, -12.0), (12.0, 12.0)))
    route = seen_route(routes.cells(), START, GOAL)
    routes.aim(route.begins_m)
    on = route.begins_m[min(2, len(route.begins_m) - 1)]
    assert routes.came_nearer(on, float(np.linalg.norm(on)))
    assert routes.cells().in_vain.max() == 0.0


def test_a_way_out_of_a_room_is_found_by_looking() -> None:
    """The walls show only as far as the sensor sees, and the door is behind the start."""
    room = np.concatenate(
        [
            wall((12.0, -10.0), (12.0, 10.0)),
            wall((-14.0, 10.0), (12.0, 10.0)),
            wall((-14.0, -10.0), (12.0, -10.0)),
            wall((-14.0, -10.0), (-14.0, 0.0)),
        ]
    )
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M)
    place, flown, known = START, 0.0, np.zeros((0, 3))
    way: tuple[np.ndarray, ...] = ()
    for _ in range(60):
        fresh = room[np.linalg.norm(room - place, axis=1) <= 10.0]
        known = np.unique(np.concatenate([known, fresh]), axis=0)
        routes.take(NOTHING_SEEN, seen_from(place, known), place, REACH_M)
        route = seen_route(routes.cells(), place, GOAL, way)
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
