"""The route field against closed answers of the eikonal equation, and what holds of any field."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.rate.route_field import Pace, RouteField, straight_time, time_to_go
from clearway.avoidance.rules import Rule
from clearway.avoidance.rules.airspace import keep_out, near_route
from clearway.base.arrays import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.live.routing.field.clearance_speed import speeds_of
from clearway.live.routing.field.known_space import PROVES_EVERY
from clearway.live.routing.field.marching import BUCKET, begin_march, let_time_pass
from clearway.live.routing.route_planner import RoutePlanner, RouteSettings, route_cells_for
from clearway.live.routing.timed_route import find_known_clearance
from clearway.obstacles.obstacle import Obstacle
from clearway.reach.store import ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton

MARGIN_M = 0.4
WIDTH_M = 0.4
GAP_M = 0.25
STEADY = Pace(10.0, np.inf, 1.0, 4.0, 2.0)


@cache
def library() -> ReachLibrary:
    """Built when a test asks for it: every process collects this module."""
    copter = MovementAutomaton.multirotor(speed_mps=5.0)
    return ReachLibrary.load_or_build(copter, AvoidanceGrid.uniform(range_m=20.0))


def planner(pace: Pace = STEADY, *, slow_mps: float = 10.0, top_m: float = 1.0) -> RoutePlanner:
    """Of a vehicle that is as fast near things, unless told otherwise."""
    settings = RouteSettings(pace, MARGIN_M, 1.0, 30.0, slow_mps, 1.2)
    return RoutePlanner(settings, route_cells_for(WIDTH_M, 100.0, 1.0, top_m, 1.0))


def wall(x_m: float, low_m: float, high_m: float, top_m: float = 3.0) -> FloatArray:
    """[n, 3] points of a wall across the x axis."""
    y, z = np.arange(low_m, high_m, GAP_M), np.arange(0.0, top_m, GAP_M)
    return np.stack([each.ravel() for each in np.meshgrid([x_m], y, z)], axis=-1)


def field_round(
    points_m: FloatArray, target_m: FloatArray, of: RoutePlanner | None = None
) -> tuple[RouteField, bool]:
    used = of or planner()
    start = np.array([0.0, 0.0, 1.0])
    used.take(start, points_m)
    return used.field(start, target_m)


def seconds_at(field: RouteField, place_m: FloatArray) -> float:
    return float(time_to_go(field, *place_m.tolist())[0])


def random_places(count: int, within_m: float, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-within_m, within_m, (count, 2)), np.full(count, 1.0)])


@pytest.mark.parametrize("pace", [STEADY, Pace(20.0, 8.0, 0.8, 4.0, 4.0)])
def test_in_empty_space_the_straight_way_counts(pace: Pace) -> None:
    target = np.array([70.0, -31.0, 1.0])
    field, found = field_round(np.zeros((0, 3)), target, planner(pace, slow_mps=pace.fastest_mps))
    assert found
    for place in random_places(200, 10.0, 1):
        seconds, *way, speed = time_to_go(field, *place.tolist())
        straight, *along, _ = straight_time(pace, *(target - place).tolist())
        assert seconds == pytest.approx(straight, rel=0.002)
        assert np.dot(way, along) > 0.998
        assert speed == pytest.approx(pace.fastest_mps)


def test_climbing_takes_longer_than_sinking() -> None:
    target = np.array([20.0, 0.0, 5.0])
    field, _ = field_round(np.zeros((0, 3)), target, planner(top_m=9.0))
    low, high = np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 8.0])
    assert seconds_at(field, low) == pytest.approx(np.hypot(20.0 / 10.0, 3.0 / 4.0), rel=0.05)
    assert seconds_at(field, high) == pytest.approx(np.hypot(20.0 / 10.0, 3.0 / 2.0), rel=0.05)
    assert time_to_go(field, *low.tolist())[3] > 0.0 > time_to_go(field, *high.tolist())[3]


@pytest.mark.parametrize("seed", range(6))
def test_past_the_end_of_a_wall_the_way_bends_at_its_corner(seed: int) -> None:
    """A half-plane: from its shadow the shortest way is by the edge, a margin off."""
    rng = np.random.default_rng(seed)
    x, end = rng.uniform(4.0, 12.0), rng.uniform(2.0, 8.0)
    target = np.array([x + rng.uniform(10.0, 40.0), rng.uniform(-6.0, 0.0), 1.0])
    field, found = field_round(wall(x, -60.0, end), target)
    assert found
    corner = np.array([x, end + MARGIN_M, 1.0])
    way_m = np.linalg.norm(corner - [0.0, 0.0, 1.0]) + np.linalg.norm(target - corner)
    seconds, dx, dy, *_ = time_to_go(field, 0.0, 0.0, 1.0)
    assert seconds * 10.0 == pytest.approx(way_m, abs=2.0 * WIDTH_M + 0.02 * float(way_m))
    to_corner = np.arctan2(corner[1], corner[0])
    assert abs(np.arctan2(dy, dx) - to_corner) < np.radians(15.0)


@pytest.mark.parametrize("width_m", [1.7, 2.4, 3.5])
@pytest.mark.parametrize("seed", range(4))
def test_through_a_gap_or_not_at_all(width_m: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, middle = rng.uniform(3.0, 10.0), rng.uniform(-8.0, 8.0)
    low, high = middle - 0.5 * width_m, middle + 0.5 * width_m
    walls = np.concatenate([wall(x, -70.0, low), wall(x, high, 70.0)])
    target = np.array([x + 20.0, 0.0, 1.0])
    field, found = field_round(walls, target)
    assert found
    way_m = np.hypot(x, middle) + np.hypot(20.0, middle)
    assert seconds_at(field, np.array([0.0, 0.0, 1.0])) * 10.0 == pytest.approx(
        way_m, abs=width_m + 3.0 * WIDTH_M
    )


def box(half_m: float, top_m: float = 3.0) -> FloatArray:
    """[n, 3] four walls about the origin."""
    one = wall(half_m, -half_m, half_m + GAP_M, top_m)
    turned = one[:, [1, 0, 2]]
    mirrored = np.array([-1.0, -1.0, 1.0])
    return np.concatenate([one, turned, one * mirrored, turned * mirrored])


def test_out_of_a_closed_box_no_way_is_known() -> None:
    target = np.array([30.0, 3.0, 1.0])
    field, found = field_round(box(6.0), target)
    assert not found
    for place in random_places(50, 5.0, 2):
        assert seconds_at(field, place) == np.inf
    assert seconds_at(field, np.array([12.0, 0.0, 1.0])) < np.inf


def test_into_a_closed_box_no_way_is_known() -> None:
    target = np.array([12.0, 0.0, 1.0])
    _, found = field_round(box(4.0) + np.array([12.0, 0.0, 0.0]), target)
    assert not found


def test_over_a_low_box_there_is_one() -> None:
    used = planner(top_m=6.0)
    points = box(6.0)
    field, found = field_round(points, np.array([30.0, 3.0, 1.0]), used)
    assert found
    assert time_to_go(field, 4.5, 0.0, 1.0)[3] > 0.5


@pytest.mark.parametrize("climb_mps", [1.0, 4.0])
@pytest.mark.parametrize("before_m", [1.0, 2.0, 5.0])
def test_who_stands_before_a_long_wall_is_led_over_it(before_m: float, climb_mps: float) -> None:
    used = planner(Pace(10.0, np.inf, 1.0, climb_mps, climb_mps), top_m=6.0)
    used.settings = replace(used.settings, asked_within_m=3.0)
    target = np.array([before_m + 20.0, 0.0, 1.0])
    field, found = field_round(wall(before_m, -60.0, 60.0), target, used)
    assert found
    rise_m = 3.0 + MARGIN_M - 1.0
    least_s = max(rise_m / climb_mps, straight_time(used.settings.pace, *target)[0])
    seconds, _, _, upwards, _ = time_to_go(field, 0.0, 0.0, 1.0)
    assert least_s <= seconds < least_s + 2.0 * (rise_m + 2.0) / climb_mps
    assert upwards > 0.0 or before_m > climb_mps  # It may go nearer first.
    for height_m in (1.5, 2.0, 2.5):
        assert seconds_at(field, np.array([0.0, 0.0, height_m])) < seconds


def test_nothing_leads_nearer_than_the_margin() -> None:
    """Free cells keep the margin from every point, those of all levels too."""
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.uniform(-40.0, 40.0, (1500, 2)), rng.uniform(0.0, 2.0, 1500)])
    used = planner()
    field, _ = field_round(points, np.array([60.0, 0.0, 1.0]), used)
    levels = used.space.levels
    for level in (0, 1):
        width = WIDTH_M * 2.0**level
        free = np.argwhere(field.speed_mps[level, :, :, 0] > 0.0)
        middles = np.column_stack([(levels.low[level] + free + 0.5) * width, np.ones(len(free))])
        nearest = np.min(np.linalg.norm(middles[:, None] - points, axis=-1), axis=1)
        # One point stands for those of a voxel.
        assert np.min(nearest) >= MARGIN_M - np.sqrt(3.0) * used.space.voxel_m


def test_more_that_stands_never_makes_a_way_shorter() -> None:
    rng = np.random.default_rng(4)
    target = np.array([25.0, 4.0, 1.0])
    points = np.column_stack(
        [rng.uniform(2.0, 24.0, 60), rng.uniform(-15.0, 15.0, 60), np.ones(60)]
    )
    places = random_places(60, 10.0, 5)
    before = np.zeros(len(places))
    for count in (0, 20, 40, 60):
        field, _ = field_round(points[:count], target, planner(slow_mps=2.0))
        now = np.array([seconds_at(field, place) for place in places])
        assert np.all(now >= before - 0.02)
        before = np.maximum(now, before)


def test_following_the_field_arrives() -> None:
    """From anywhere in a forest, by where half a metre on leads soonest, in the time stated."""
    rng = np.random.default_rng(6)
    trunks = rng.uniform([-30.0, -20.0], [30.0, 20.0], (120, 2))
    points = np.concatenate(
        [np.column_stack([np.tile(at, (12, 1)), np.arange(0.0, 3.0, GAP_M)]) for at in trunks]
    )
    target = np.array([35.0, 0.0, 1.0])
    field, _ = field_round(points, target)
    turns = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    around = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(36)])
    for place in random_places(30, 12.0, 7):
        if np.min(np.linalg.norm(trunks - place[:2], axis=1)) < 2.0 * MARGIN_M:
            continue
        at, left = place.copy(), seconds_at(field, place)
        for _ in range(int(1.2 * left * STEADY.fastest_mps / 0.5) + 4):
            if np.linalg.norm(at - target) > 1.0:
                ahead = at + 0.5 * around
                at = ahead[np.argmin([seconds_at(field, each) for each in ahead])]
            assert np.min(np.linalg.norm(trunks - at[:2], axis=1)) > 0.5 * MARGIN_M
        assert np.linalg.norm(at - target) < 1.5


def test_what_vanished_bars_no_more_and_leaves_no_trace() -> None:
    target, start = np.array([30.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])
    rng = np.random.default_rng(8)
    stays = np.column_stack([rng.uniform(5.0, 25.0, 40), rng.uniform(-9.0, 9.0, 40), np.ones(40)])
    used, fresh = planner(), planner()
    goes = box(3.0)
    used.take(start, np.concatenate([stays, goes]))
    assert not used.field(start, target)[1]
    for _ in range(PROVES_EVERY):
        used.take(start, stays, 200.0)
    fresh.take(start, stays)
    np.testing.assert_array_equal(used.space.clearance_m, fresh.space.clearance_m)
    assert used.field(start, target)[1]


def test_moving_along_changes_nothing_that_is_known() -> None:
    rng = np.random.default_rng(9)
    points = np.column_stack([rng.uniform(-30.0, 60.0, (4000, 2)), rng.uniform(0.0, 2.0, 4000)])
    used, fresh = planner(), planner()
    none = np.zeros((0, 3))
    used.take(np.array([0.0, 0.0, 1.0]), points)
    for along in np.linspace(0.0, 1.0, 30):
        here = np.array([40.0 * along, 25.0 * np.sin(3.0 * along), 1.0])
        used.take(here, none)
    kept = used.space.known_points_m
    fresh.take(here, kept)
    low = used.space.levels.low
    if np.array_equal(low, fresh.space.levels.low):
        np.testing.assert_allclose(used.space.clearance_m, fresh.space.clearance_m)
    field, again = (each.field(here, np.array([70.0, 0.0, 1.0]))[0] for each in (used, fresh))
    for place in here + random_places(50, 8.0, 10) * [1.0, 1.0, 0.0]:
        assert seconds_at(field, place) == pytest.approx(
            seconds_at(again, place), rel=0.05, abs=0.1
        )


def ruled(*rules: Rule, waypoint_m: tuple[float, float, float] = (20.0, 0.0, 1.0)) -> RoutePlanner:
    """A route planner of a copter that keeps rules on a mission from the origin's height."""
    start = State(np.array([0.0, 0.0, 1.0]))
    mission = Mission("there", start, waypoints_m=np.array([waypoint_m]))
    settings = RouteSettings(STEADY, MARGIN_M, 1.0, 30.0, 10.0, 1.2)
    besides = find_known_clearance(Planner.of(library(), rules=rules), mission, None)
    return RoutePlanner(settings, route_cells_for(WIDTH_M, 100.0, 1.0, 1.0, 1.0), besides)


def test_no_way_leads_where_a_rule_forbids_to_fly() -> None:
    target, walls = np.array([20.0, 0.0, 1.0]), wall(8.0, -15.0, 12.0)
    field, found = field_round(walls, target, ruled(near_route(18.0)))
    assert found
    assert seconds_at(field, np.array([0.0, 0.0, 1.0])) < 3.5, "round the nearer end"
    closed = Obstacle.cuboid([8.0, 16.0, 1.0], (4.0, 9.0, 8.0))
    field, found = field_round(walls, target, ruled(near_route(18.0), keep_out([closed])))
    assert found
    assert seconds_at(field, np.array([0.0, 0.0, 1.0])) > 3.5, "round the other end"
    assert not field_round(walls, target, ruled(near_route(10.0)))[1]
    late = keep_out([closed], from_s=100.0)
    field, _ = field_round(walls, target, ruled(late))
    assert seconds_at(field, np.array([0.0, 0.0, 1.0])) < 3.5


def test_who_begins_where_a_rule_forbids_it_finds_a_way_back() -> None:
    inside = Obstacle.cuboid([0.0, 0.0, 1.0], (6.0, 6.0, 8.0))
    target = np.array([20.0, 0.0, 1.0])
    assert field_round(np.zeros((0, 3)), target, ruled(keep_out([inside])))[1]


def test_another_route_is_kept_near_from_then_on() -> None:
    of, aside = ruled(near_route(5.0)), np.array([0.0, 20.0, 1.0])
    assert not field_round(np.zeros((0, 3)), aside, of)[1]
    start = State(np.array([0.0, 0.0, 1.0]))
    other = Mission("aside", start, waypoints_m=aside[None])
    of.begin_anew(find_known_clearance(Planner.of(library(), rules=[near_route(5.0)]), other, None))
    assert field_round(np.zeros((0, 3)), aside, of)[1]


def test_a_gap_before_which_nothing_comes_of_it_gives_way_to_another() -> None:
    target, start = np.array([20.0, 0.0, 1.0]), np.array([6.0, 3.0, 1.0])
    of = planner(slow_mps=2.0)
    walls = np.concatenate([wall(8.0, -30.0, -4.0), wall(8.0, -2.0, 3.0), wall(8.0, 5.0, 30.0)])
    of.take(start, walls)
    _, _, before, _, _ = time_to_go(of.field(start, target)[0], *start.tolist())
    assert before > 0.0, "through the gap beside it"
    for now_s in np.arange(0.0, 40.0, 0.5):
        of.in_vain.note(start, float(now_s), of.field(start, target)[0])
    _, _, after, _, _ = time_to_go(of.field(start, target)[0], *start.tolist())
    assert after < 0.0, "to the other one"


def test_who_waits_before_the_only_gap_still_finds_it() -> None:
    target, start = np.array([20.0, 0.0, 1.0]), np.array([6.0, 3.0, 1.0])
    of = planner(slow_mps=2.0)
    of.take(start, np.concatenate([wall(8.0, -60.0, 3.0), wall(8.0, 5.0, 60.0)]))
    for now_s in np.arange(0.0, 3600.0, 4.5):
        of.in_vain.note(start, float(now_s), of.field(start, target)[0])
    field, found = of.field(start, target)
    assert found
    assert field.speed_mps[field.speed_mps > 0.0].min() >= 2.0 * 0.25**9


def test_who_gets_on_has_found_no_way_in_vain() -> None:
    target = np.array([20.0, 0.0, 1.0])
    of = planner()
    before, _ = field_round(wall(8.0, -3.0, 3.0), target, of)
    for now_s in np.arange(0.0, 10.0, 0.5):
        of.in_vain.note(np.array([now_s - 5.0, 0.0, 1.0]), float(now_s), before)
    after, _ = field_round(wall(8.0, -3.0, 3.0), target, of)
    assert np.array_equal(before.time_s, after.time_s)


def nearest_to_legs(corners_m: FloatArray, points_m: FloatArray) -> float:
    """Least distance of a polyline to points, in metres."""
    shares = np.linspace(0.0, 1.0, 200)[:, None]
    legs = pairwise(corners_m)
    places = np.concatenate([one + shares * (other - one) for one, other in legs])
    return float(np.min(np.linalg.norm(places[:, None] - points_m, axis=-1)))


@pytest.mark.parametrize("seed", range(8))
def test_a_way_has_few_corners_and_keeps_off(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, end = rng.uniform(5.0, 9.0), rng.uniform(2.0, 6.0)
    points = np.concatenate([wall(x, -40.0, end), wall(x + 6.0, -1.0, 40.0)])
    target, start = np.array([x + 15.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])
    used = planner(slow_mps=2.0)
    used.take(start, points)
    way = used.way_m(start, target)
    assert 2 <= len(way) <= 6
    corners = np.stack([start, *way, target])
    assert nearest_to_legs(corners, points) > 0.75 * MARGIN_M
    length_m = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
    past = np.array([[0.0, 0.0], [x, end + 0.4], [x + 6.0, -1.4], [x + 15.0, 0.0]])
    assert length_m < 1.15 * np.linalg.norm(np.diff(past, axis=0), axis=1).sum() + 1.0


def test_where_the_straight_way_is_open_it_needs_none() -> None:
    used = planner()
    start = np.array([0.0, 0.0, 1.0])
    used.take(start, np.zeros((0, 3)))
    for place in random_places(20, 60.0, 11):
        assert used.way_m(start, place) == ()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_when_cells_are_looked_at_makes_little_difference(seed: int) -> None:
    """Times are those of a march in buckets so narrow that the earliest cell comes first."""
    rng = np.random.default_rng(seed)
    pace = Pace(20.0, 8.0, 0.8, 2.0, 1.5)
    used = planner(pace, slow_mps=3.0, top_m=3.5)
    trees = rng.uniform([4.0, -20.0, 0.0], [28.0, 20.0, 0.0], (60, 3))
    trunk = np.column_stack([np.zeros((16, 2)), np.linspace(0.0, 4.0, 16)])
    vehicle, target = np.array([0.0, 0.0, 1.2]), np.array([32.0, 3.0, 1.6])
    used.take(vehicle, (trees[:, None] + trunk).reshape(-1, 3))
    levels, clearance_m = used.space.levels, used.space.clearance_m
    speed = speeds_of(levels, clearance_m, used._rule)
    times = []
    for narrower in (1.0, 30.0):
        bucket_s = BUCKET * levels.width_m / pace.fastest_mps / narrower
        begun = begin_march(levels, pace, clearance_m, speed, target, 1.0, bucket_s)
        assert let_time_pass(begun, vehicle, -1, 1.0, np.inf)[0]
        times.append(begun.time_s)
    both = np.isfinite(times[0]) & np.isfinite(times[1])
    assert np.count_nonzero(both) > 5_000
    off_s = np.abs(times[0][both] - times[1][both])
    assert np.percentile(off_s, 99.0) < 0.05
    assert off_s.max() < 0.5
