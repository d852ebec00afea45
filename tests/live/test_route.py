"""Routes round obstacles, and missions that the map shows to be impossible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.frames import FloatArray, world_from_body
from clearway.live.routing.distance_field import VoxelField, segment_is_clear
from clearway.live.routing.infeasibility import prove_infeasible
from clearway.live.routing.route import NoRoute, Route, check_mission, find_route
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

MARGIN_M = 0.6
REACH_M = 1.5
AHEAD = np.array([20.0, 0.0, 0.0])
QUARTER = np.pi / 2


def room(center: FloatArray, width_m: float = 6.0, gap_m: float = 0.0) -> list[Obstacle]:
    """Six thin walls around a centre; the east one has an upright gap."""
    x, y, z = center
    half, outer = 0.5 * width_m, width_m + 0.1
    walls = [
        Obstacle.cuboid([x - half, y, z], (0.1, outer, outer), name="west"),
        Obstacle.cuboid([x, y - half, z], (outer, 0.1, outer), name="south"),
        Obstacle.cuboid([x, y + half, z], (outer, 0.1, outer), name="north"),
        Obstacle.cuboid([x, y, z - half], (outer, outer, 0.1), name="floor"),
        Obstacle.cuboid([x, y, z + half], (outer, outer, 0.1), name="roof"),
    ]
    part = 0.5 * (outer - gap_m)
    for side in (-1, 1):
        shift = side * 0.5 * (gap_m + part)
        walls.append(Obstacle.cuboid([x + half, y + shift, z], (0.1, part, outer), name="east"))
    return walls


def wall(extent_m: float) -> Obstacle:
    return Obstacle.plane(
        [10, 0, 0], (extent_m, extent_m), radius_m=0.1, orientation_rad=[0, QUARTER, 0], name="wall"
    )


def clearance_along(route: Route, world: ObstacleMap) -> float:
    legs = zip(route.points_m[:-1], route.points_m[1:], strict=True)
    shares = np.linspace(0.0, 1.0, 500)[:, None]
    return min(float(world.distance_m(a + shares * (b - a)).min()) for a, b in legs)


def test_free_space_is_crossed_straight() -> None:
    route = find_route(ObstacleMap().distance_m, np.zeros(3), AHEAD, MARGIN_M)
    assert isinstance(route, Route)
    assert route.points_m.tolist() == [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]]
    assert route.length_m == 20.0


def test_a_route_round_a_ball_is_near_the_shortest() -> None:
    world = ObstacleMap([Obstacle.ball([10, 0, 0], 2.0)])
    route = find_route(world.distance_m, np.zeros(3), AHEAD, MARGIN_M)
    assert isinstance(route, Route)
    tangent = np.sqrt(10.0**2 - 2.6**2)
    shortest = 2.0 * tangent + 2.6 * 2.0 * np.arcsin(2.6 / 10.0)
    assert shortest <= route.length_m <= 1.05 * shortest
    assert clearance_along(route, world) >= MARGIN_M


@pytest.mark.parametrize("extent_m", [8.0, 30.0, 200.0])
def test_a_wall_is_flown_round(extent_m: float) -> None:
    world = ObstacleMap([wall(extent_m)])
    bounds = (world.tree.low_m[0], world.tree.high_m[0])
    route = find_route(world.distance_m, np.zeros(3), AHEAD, MARGIN_M, bounds_m=bounds)
    assert isinstance(route, Route)
    assert clearance_along(route, world) >= MARGIN_M
    assert check_mission([np.zeros(3), AHEAD], world, MARGIN_M, REACH_M) == []


def test_a_goal_in_a_room_with_a_gap_is_reached_from_behind() -> None:
    world = ObstacleMap(room(AHEAD, gap_m=3.2))
    route = find_route(world.distance_m, np.zeros(3), AHEAD, MARGIN_M)
    assert isinstance(route, Route)
    assert clearance_along(route, world) >= MARGIN_M
    assert route.length_m > 26.0


def test_a_walled_in_waypoint_is_refused_with_its_walls() -> None:
    world = ObstacleMap(room(AHEAD))
    reasons = check_mission([np.zeros(3), AHEAD, [40, 0, 0]], world, MARGIN_M, REACH_M)
    assert len(reasons) == 1
    assert "waypoint 1 at (20, 0, 0) cannot be reached from the start" in reasons[0]
    assert "'west' (cuboid)" in reasons[0]
    assert "0.6 m is needed" in reasons[0]


def test_a_walled_in_start_is_refused() -> None:
    reasons = check_mission([np.zeros(3), AHEAD], ObstacleMap(room(np.zeros(3))), MARGIN_M, REACH_M)
    assert len(reasons) == 1
    assert "the start is walled in" in reasons[0]


def test_start_and_goal_in_the_same_room_are_no_problem() -> None:
    world = ObstacleMap(room(np.zeros(3), 9.0))
    points = [[-2.5, 0, 0], [2.5, 0, 0]]
    assert check_mission(points, world, MARGIN_M, REACH_M) == []


@pytest.mark.parametrize(
    ("gap_m", "refused"), [(0.9, True), pytest.param(1.5, False, marks=pytest.mark.nightly)]
)
def test_a_gap_is_refused_only_if_too_narrow(gap_m: float, refused: bool) -> None:
    turn = [0.0, 0.0, 0.3]
    obstacles = [
        Obstacle.cuboid(
            world_from_body(turn) @ part.position_m + AHEAD,
            (part.size_m[0], part.size_m[1], part.size_m[2]),
            orientation_rad=turn,
        )
        for part in room(np.zeros(3), 5.0, gap_m)
    ]
    reasons = check_mission([np.zeros(3), AHEAD], ObstacleMap(obstacles), MARGIN_M, REACH_M)
    assert bool(reasons) == refused


GAPS = given(
    gap_m=st.floats(1.25, 3.0),
    yaw_rad=st.floats(-3.0, 3.0),
    roll_rad=st.floats(-3.0, 3.0),
)


@GAPS
@settings(max_examples=1, deadline=None)
def test_a_gap_twice_the_margin_wide_is_never_taken_for_a_wall(
    gap_m: float, yaw_rad: float, roll_rad: float
) -> None:
    assert_open(gap_m, yaw_rad, roll_rad)


@pytest.mark.nightly
@GAPS
@settings(max_examples=50, deadline=None)
def test_a_gap_is_never_taken_for_a_wall_at_length(
    gap_m: float, yaw_rad: float, roll_rad: float
) -> None:
    assert_open(gap_m, yaw_rad, roll_rad)


def assert_open(gap_m: float, yaw_rad: float, roll_rad: float) -> None:
    """That nothing is proven of a room, turned anyhow, with a gap."""
    turn = np.array([roll_rad, 0.4, yaw_rad])
    obstacles = [
        Obstacle.cuboid(
            world_from_body(turn) @ part.position_m,
            (part.size_m[0], part.size_m[1], part.size_m[2]),
            orientation_rad=turn,
        )
        for part in room(np.zeros(3), 4.0, gap_m)
    ]
    world = ObstacleMap(obstacles)
    assert prove_infeasible(world.distance_m, np.zeros(3), 0.3, MARGIN_M, AHEAD) is None


def test_waypoints_inside_and_too_near_are_refused_by_name() -> None:
    world = ObstacleMap([Obstacle.ball([10, 0, 0], 2.0, name="tank"), wall(0.5)])
    points = [[7.9, 0, 0], [10, 0.5, 0.5], [12.3, 0, 0], [20, 0, 0]]
    reasons = check_mission(points, world, MARGIN_M, REACH_M)
    assert reasons[0] == (
        "the start at (7.9, 0, 0) is 0.10 m from obstacle 0 'tank' (ball); 0.6 m is needed"
    )
    assert reasons[1].startswith("waypoint 1 at (10, 0.5, 0.5) lies 1.29 m inside obstacle 0")
    # The third is nearer than the margin, but counts as reached from farther away.
    assert len(reasons) == 2


def test_a_waypoint_in_a_narrow_slot_is_refused() -> None:
    slot = [
        Obstacle.cuboid([20, side * 1.3, 0], (12.0, 2.0, 12.0), name="slab") for side in (-1, 1)
    ]
    reasons = check_mission([np.zeros(3), AHEAD], ObstacleMap(slot), MARGIN_M, REACH_M)
    assert len(reasons) == 1
    assert "is 0.30 m from obstacle" in reasons[0]
    assert "no place within 1.5 m of it has that; 0.3 m would do" in reasons[0]


def test_a_start_nearer_than_the_margin_finds_its_way_out() -> None:
    world = ObstacleMap([Obstacle.ball([10, 0, 0], 2.0)])
    start = np.array([7.8, 0.0, 0.0])
    route = find_route(world.distance_m, start, AHEAD, MARGIN_M)
    assert isinstance(route, Route)
    assert clearance_along(route, world) >= 0.2 - MARGIN_M / 8.0


def test_no_route_says_where_and_how_closely_it_looked() -> None:
    world = ObstacleMap(room(AHEAD))
    missing = find_route(world.distance_m, np.zeros(3), AHEAD, MARGIN_M, voxels=4000)
    assert isinstance(missing, NoRoute)
    assert "from (0, 0, 0) to (20, 0, 0)" in missing.reason


def test_safe_steps_keep_the_margin() -> None:
    world = ObstacleMap([Obstacle.ball([0, 0, 0], 1.0), Obstacle.cuboid([3, 1, 0], (1, 2, 1))])
    field = VoxelField.sample(
        world.distance_m, np.full(3, -4.0), np.full(3, 5.0), np.array([0.1, 0.2, 0.3]), 0.5
    )
    ones, others, lengths = field.safe_steps(MARGIN_M)
    start, end = field.centers_m(ones), field.centers_m(others)
    np.testing.assert_allclose(np.linalg.norm(end - start, axis=1), lengths)
    for share in np.linspace(0.0, 1.0, 9):
        assert world.distance_m(start + share * (end - start)).min() >= MARGIN_M - 1e-9


def test_segments() -> None:
    world = ObstacleMap([Obstacle.ball([5, 0, 0], 1.0)])
    start, end = np.array([0.0, 1.7, 0.0]), np.array([10.0, 1.7, 0.0])
    assert segment_is_clear(world.distance_m, start, end, 0.6, 0.05)
    assert not segment_is_clear(world.distance_m, start, end, 0.75, 0.05)
    assert segment_is_clear(world.distance_m, start, start, 0.6, 0.05)


def test_a_segment_of_any_length_is_looked_at() -> None:
    world = ObstacleMap([Obstacle.ball([1e5, 0, 0], 1.0)])
    start, beside = np.zeros(3), np.array([0.0, 1.7, 0.0])
    for end_m in (2e5, 1e9):
        end = np.array([end_m, 0.0, 0.0])
        assert not segment_is_clear(world.distance_m, start, end, 0.6, 0.05)
        assert segment_is_clear(world.distance_m, beside, end + beside, 0.6, 0.05)
