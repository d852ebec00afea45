"""Made-up worlds that end, and clutter: what stands where, by geometry of the tests' own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.missions.world_file import read_mission
from clearway.obstacles.obstacle import Obstacle
from clearway.sim.clutter import nets
from clearway.sim.column_fields import forest
from clearway.sim.dead_ends import cave, dead_end, make_closed_tube, room, u_shape
from clearway.sim.world_parts import MadeWorld
from clearway.sim.worlds import ball_world, maze
from clearway.studies.campaigns.families import make_case
from clearway.vehicle.automaton import MovementAutomaton
from dead_end_flights import case_of, labels, mission_of, solids_of
from free_way import free_way
from solids import Solids

ROOM_M = MovementAutomaton.plane().turning_radius_m + 0.6
IN_THE_WAY = ("pockets", "wedges", "caves", "streets", "tubes")


def ends(label: str, seed: int) -> tuple[Solids, np.ndarray, np.ndarray]:
    file = mission_of(label, seed)
    return (
        solids_of(file),
        np.array(file.vehicle.position_m),
        np.array(file.mission.waypoints_m[-1]),
    )


@pytest.mark.parametrize("label", labels())
def test_start_and_goal_have_room_to_turn(label: str) -> None:
    for seed in range(4):
        solids, start, goal = ends(label, seed)
        assert solids.distance_m([start, goal]).min() >= ROOM_M


@pytest.mark.parametrize("label", [one for one in labels() if one.startswith(IN_THE_WAY)])
def test_straight_flight_ends_in_a_dead_end(label: str) -> None:
    for seed in range(8):
        solids, start, goal = ends(label, seed)
        assert solids.nearest_on_track_m([start, goal]) < 0.0


@pytest.mark.parametrize("make", [dead_end, cave, make_closed_tube, u_shape])
def test_a_dead_end_is_as_wide_and_as_deep_as_drawn(make: Callable[..., MadeWorld]) -> None:
    for seed in range(6):
        world, *_ = make(seed, width_m=(12.0, 12.0), depth_m=(20.0, 20.0))
        number, end = next(
            (n, one) for n, one in enumerate(world.obstacles) if one.name in ("back", "end")
        )
        solids = Solids.of(world.obstacles)
        axes = solids.axes[number]
        outwards = axes[1] if make in (dead_end, u_shape) else -axes[0]

        places = [end.position_m + (0.25 + way) * outwards for way in (3.0, 12.0, 19.0, 28.0)]
        free = solids.distance_m(places)
        # Of a cave the height is drawn from the same span; where a tube's planks meet, its corners
        # stand outside; at 28 m the edge of the mouth is nearest.
        np.testing.assert_allclose(free[:3], [3.0, 6.0, 6.0], atol=1e-9)
        np.testing.assert_allclose(free[3], 10.0, atol=1e-9)


def test_shapes_of_clutter_and_trunks_are_as_asked_for() -> None:
    """Numbers, distances and thickness, as far as a parameter says them."""
    balls, *_ = ball_world(3, (200, 350), 5.0)
    assert 150 < len(balls.obstacles) <= 350
    trunks, *_ = forest(3, 9.5)
    places = np.array([trunk.position_m for trunk in trunks.obstacles])
    radii = np.array([trunk.radius_m for trunk in trunks.obstacles])
    apart = np.linalg.norm(places[:, None] - places, axis=2) - radii[:, None] - radii
    assert apart[~np.eye(len(radii), dtype=bool)].min() >= 9.5
    ropes, *_ = nets(3, thickness_m=0.1)
    assert {rope.radius_m for rope in ropes.obstacles} == {0.05}


def test_a_declared_smallest_object_of_nets_is_one_that_the_beams_hold() -> None:
    for label, thickness in (("nets", 0.22), ("nets-fine", 0.1)):
        case = case_of(label, 0)
        assert case.setup.planner.settings.smallest_object_m == thickness
        (lidar,) = case.setup.lidars
        assert lidar.pattern.spacing_rad * lidar.pattern.max_range_m <= thickness
    assert read_mission("nets:4").safety.smallest_object_m == 0.22


@pytest.mark.parametrize(
    ("made", "free"),
    [
        (room(2, width_m=(4.0, 8.0)), False),
        (room(2, width_m=(10.0, 14.0)), True),
        (maze(2, room_m=(9.0, 9.0)), False),
        (maze(2, room_m=(12.0, 12.0)), True),
        (u_shape(2, width_m=(12.0, 12.0)), True),
        (dead_end(2), True),
    ],
    ids=["small door", "wide door", "small rooms", "wide rooms", "u", "dead end"],
)
def test_a_free_way_is_there_where_the_doors_are_wide_enough(made: MadeWorld, free: bool) -> None:
    world, mission, *_ = made
    solids = Solids.of(world.obstacles)
    assert free_way(solids, mission.start.position_m, mission.waypoints_m[-1]).exists == free


def test_a_maze_that_faces_its_door_has_no_wall_ahead() -> None:
    for seed in range(6):
        world, mission, *_ = maze(seed, faces_door=True)
        place, yaw = mission.start.position_m, mission.start.attitude_rad[2]
        ahead = place + 13.0 * np.array([np.cos(yaw), np.sin(yaw), 0.0])
        assert Solids.of(world.obstacles).nearest_on_track_m([place, ahead]) > 0.5


# The tests' own geometry -------------------------------------------------------------------


def test_distances_of_turned_shapes_are_those_worked_out_by_hand() -> None:
    turned = (0.0, 0.0, 0.5 * np.pi)
    shapes = [
        Obstacle.ball((0.0, 0.0, 50.0), 2.0),
        Obstacle.cuboid((0.0, 0.0, 0.0), (4.0, 2.0, 2.0), radius_m=0.5, orientation_rad=turned),
        Obstacle.line(
            (30.0, 0.0, 0.0), 6.0, radius_m=0.25, orientation_rad=(0.0, 0.5 * np.pi, 0.0)
        ),
    ]
    solids = Solids.of(shapes)
    points = [(0.0, 0.0, 53.0), (3.5, 0.0, 0.0), (0.0, 4.5, 0.0), (0.0, 0.0, 0.0), (30, 0, -4)]
    np.testing.assert_allclose(solids.distance_m(points), [1.0, 2.0, 2.0, -1.5, 0.75])
    # Rolled about its length, a box shows its edge.
    edge = Solids.of([Obstacle.cuboid((0, 0, 0), (4, 2, 2), orientation_rad=(np.pi / 4, 0, 0))])
    np.testing.assert_allclose(edge.distance_m([(0.0, 0.0, 3.0)]), 3.0 - np.sqrt(2.0))
    down = Solids.of(
        [Obstacle.line((0, 0, 0), 10.0, radius_m=0.1, orientation_rad=(0.0, np.radians(30.0), 0.0))]
    )
    nose = 5.0 * np.array([np.cos(np.radians(30.0)), 0.0, -np.sin(np.radians(30.0))])
    np.testing.assert_allclose(down.distance_m([nose]), -0.1)


def test_a_track_is_judged_between_its_places() -> None:
    plate = Solids.of([Obstacle.cuboid((0.0, 0.0, 0.0), (0.01, 4.0, 4.0))])
    assert plate.nearest_on_track_m([(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]) == pytest.approx(
        -0.005, abs=1e-6
    )
    beside = [(-1.0, 2.5, 0.0), (1.0, 2.5, 0.0), (2.0, 2.5, 0.0)]
    assert plate.nearest_on_track_m(beside) == pytest.approx(0.5)
    assert Solids.of([]).nearest_on_track_m(beside) == np.inf


@pytest.mark.parametrize(("gap_m", "free"), [(8.4, False), (9.4, True)])
def test_a_ball_goes_through_a_gap_that_it_fits_in(gap_m: float, free: bool) -> None:
    """In a wall across a closed hall."""
    half = 0.5 * gap_m
    hall = [
        *(Obstacle.cuboid((10.0, s * 20.0, 0.0), (42.0, 1.0, 200.0)) for s in (-1.0, 1.0)),
        *(Obstacle.cuboid((10.0 + s * 20.0, 0.0, 0.0), (1.0, 42.0, 200.0)) for s in (-1.0, 1.0)),
        *(Obstacle.cuboid((10.0, s * (half + 10.0), 0.0), (0.5, 20.0, 200.0)) for s in (-1.0, 1.0)),
    ]
    found = free_way(Solids.of(hall), (0, 0, 0), (20, 0, 0), measured=True)
    assert found.exists == free
    # The last metre and a half does not count.
    assert found.length_m == (pytest.approx(18.5, abs=0.5) if free else None)


# Bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("family", "parameters", "said"),
    [
        ("dead-end", {"width_m": [9.0, 4.0]}, "least comes first"),
        ("dead-end", {"width_m": [0.0, 4.0]}, "width_m"),
        ("u-shape", {"width_m": [5.0, 9.0]}, "at least 9.5"),
        ("room", {"depth_m": [5.0, 9.0]}, "at least 16"),
        ("maze", {"room_m": [5.0, 9.0]}, "at least 10"),
        ("mixed", {"shapes": [0, 9]}, "shapes"),
        ("walls", {"gaps_m": [4.0, 5.0]}, "did you mean"),
    ],
)
def test_impossible_parameters_say_what_is_possible(
    family: str, parameters: dict[str, list[float]], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        make_case(family, 0, parameters, {}, Path())
