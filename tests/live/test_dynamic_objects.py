"""Dynamic objects seen by LiDAR alone: found, told apart from what stands, no ghost left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.dynamic_objects import (
    DynamicObjectSettings,
    Following,
    find_unreported,
    follow,
    forget_dynamic_objects,
)
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.point_world import PointWorld
from clearway.obstacles.world import CombinedWorld, World
from clearway.sensors import (
    BeamPattern,
    Lidar,
    PointMemory,
    Scan,
    simulate_scan,
    update_memory,
)
from clearway.sim import Run, SimulationSettings, simulate
from clearway.sim.scripted import ScriptedIntruder, Traffic, TrafficSettings
from clearway.sim.worlds import ball_world
from clearway.traffic import Intruder
from worlds_for_tests import GRID, LIDAR, STATIC, WALLS, mission, planner, static_world

EMPTY = ObstacleMap()
SETTINGS = DynamicObjectSettings.of(margin_m=0.6, speed_mps=1.0)
RADIUS_M = 0.6


def scans_of(
    start: FloatArray,
    velocity: FloatArray,
    own_mps: float,
    seconds: int,
    world: ObstacleMap = EMPTY,
) -> list[tuple[State, Scan]]:
    """One scan a second of a ball in motion, from a vehicle that flies straight ahead."""
    taken = []
    for second in range(seconds):
        state = State(np.array([own_mps * second, 0.0, 0.0]), time_s=float(second))
        ball = Obstacle.ball(start + second * velocity, RADIUS_M)
        seen = CombinedWorld([world, ObstacleMap([ball])])
        taken.append((state, simulate_scan(LIDAR, seen, state, second)))
    return taken


def followed(taken: list[tuple[State, Scan]]) -> tuple[Following, PointMemory]:
    following, memory = Following(SETTINGS), PointMemory.empty(0.12)
    for state, scan in taken:
        memory = update_memory(memory, LIDAR, scan, state)
        following = follow(following, LIDAR, scan, state)
        memory = forget_dynamic_objects(memory, following)
    return following, memory


CROSSING = (np.array([8.0, 3.0, 0.5]), np.array([0.0, -0.8, 0.0]))


@pytest.mark.parametrize("own_mps", [0.0, 1.0])
@pytest.mark.parametrize(
    ("start", "velocity"),
    [
        CROSSING,
        (np.array([9.5, 0.0, 0.0]), np.array([-0.7, 0.0, 0.0])),
        (np.array([5.5, 0.5, 0.0]), np.array([1.3, 0.2, 0.1])),
        (np.array([7.0, -2.0, -1.5]), np.array([0.0, 0.3, 0.7])),
        (np.array([9.0, -3.0, 0.0]), np.array([-0.5, 0.8, 0.2])),
    ],
    ids=["crossing", "head on", "away", "climbing", "oblique"],
)
def test_a_mover_is_known_after_two_scans(
    start: FloatArray, velocity: FloatArray, own_mps: float
) -> None:
    taken = scans_of(start, velocity, own_mps, 3)
    assert followed(taken[:1])[0].intruders() == []
    (moving,) = followed(taken[:2])[0].intruders()
    assert moving.name == "lidar-1"
    assert moving.time_s == 1.0
    (moving,) = followed(taken)[0].intruders()
    assert moving.name == "lidar-1"
    assert moving.time_s == 2.0
    off_m = np.abs(moving.position_m - (start + 2.0 * velocity))
    assert off_m.max() < min(0.1, 3.0 * moving.position_std_m)
    assert np.abs(moving.velocity_mps - velocity).max() < min(0.1, 3.0 * moving.velocity_std_mps)
    assert moving.radius_m == pytest.approx(RADIUS_M, abs=0.12)
    assert moving.position_std_m < 0.1
    assert 0.0 < moving.spread_rad[0] < 0.2


def test_a_tenth_of_the_own_speed_is_no_motion() -> None:
    following, memory = followed(scans_of(np.array([8.0, 0.0, 0.0]), np.array([0, 0.1, 0]), 0.0, 8))
    assert following.intruders() == []
    assert len(memory.radius_m) > 10, "it is remembered like anything that stands still"


def test_a_mover_that_stops_is_an_obstacle_again() -> None:
    start, velocity = CROSSING
    taken = scans_of(start, velocity, 0.0, 4)
    for second in range(4, 10):
        state = State(np.zeros(3), time_s=float(second))
        ball = ObstacleMap([Obstacle.ball(start + 3 * velocity, RADIUS_M)])
        taken.append((state, simulate_scan(LIDAR, ball, state, second)))
    assert len(followed(taken[:5])[0].intruders()) == 1
    following, memory = followed(taken)
    assert following.intruders() == []
    assert len(memory.radius_m) > 10


def test_what_hides_is_believed_in_and_what_is_gone_is_not() -> None:
    start, velocity = CROSSING
    taken = scans_of(start, velocity, 0.0, 4)
    wall = ObstacleMap([Obstacle.cuboid([4.0, 0.0, 0.0], (0.2, 20.0, 20.0))])
    states = [State(np.zeros(3), time_s=float(second)) for second in (4, 5, 6)]
    hidden = [(state, simulate_scan(LIDAR, wall, state, 1)) for state in states]
    gone = [(state, simulate_scan(LIDAR, EMPTY, state, 1)) for state in states]
    (moving,) = followed(taken + hidden)[0].intruders()
    assert moving.time_s == 3.0
    assert followed(taken + gone)[0].intruders() == []
    later = State(np.zeros(3), time_s=14.0)
    late = followed([*taken, *hidden, (later, simulate_scan(LIDAR, wall, later, 1))])
    assert late[0].intruders() == []


def test_no_ghost_is_left_also_where_the_sky_behind_returns_nothing() -> None:
    start, velocity = CROSSING
    taken = scans_of(start, velocity, 1.0, 7)
    for count in (3, 5, 7):
        _, memory = followed(taken[:count])
        track = start + np.arange(0.0, count, 0.05)[:, None] * velocity
        apart = np.linalg.norm(memory.position_m[:, None] - track, axis=2)
        assert np.min(apart, initial=np.inf) > RADIUS_M
    remembered = PointMemory.empty(0.12)
    for state, scan in taken[:3]:
        remembered = update_memory(remembered, LIDAR, scan, state)
    assert len(remembered.radius_m) > 50, "a memory that follows nothing keeps ghosts for a while"


def test_what_stands_behind_a_mover_stays_remembered() -> None:
    rock = ObstacleMap([Obstacle.ball([9.0, 0.0, 0.5], 1.0)])
    start, velocity = np.array([6.0, 2.5, 0.5]), np.array([0.0, -0.8, 0.0])
    following, memory = followed(scans_of(start, velocity, 0.0, 7, rock))
    assert len(following.intruders()) == 1
    alone = PointMemory.empty(0.12)
    for state, _ in scans_of(start, velocity, 0.0, 7):
        alone = update_memory(alone, LIDAR, simulate_scan(LIDAR, rock, state, 1), state)
    gaps = np.linalg.norm(alone.position_m[:, None] - memory.position_m, axis=2).min(axis=1)
    assert np.quantile(gaps, 0.9) < 0.25
    assert rock.distance_m(memory.position_m).max() < 0.15


def test_two_movers_keep_their_names_when_they_cross() -> None:
    following = Following(SETTINGS)
    starts = np.array([[7.0, 3.0, 0.8], [7.0, -3.0, -0.8]])
    velocities = np.array([[0.0, -0.8, 0.0], [0.0, 0.8, 0.0]])
    names: list[dict[str, float]] = []
    for second in range(8):
        state = State(np.zeros(3), time_s=float(second))
        balls = [
            Obstacle.ball(s + second * v, RADIUS_M) for s, v in zip(starts, velocities, strict=True)
        ]
        scan = simulate_scan(LIDAR, ObstacleMap(balls), state, second)
        following = follow(following, LIDAR, scan, state)
        names.append({i.name: float(np.sign(i.velocity_mps[1])) for i in following.intruders()})
    assert names[-1] == names[2]
    assert sorted(names[-1]) == ["lidar-1", "lidar-2"]


def test_a_reported_intruder_is_not_counted_twice() -> None:
    start, velocity = CROSSING
    moving = followed(scans_of(start, velocity, 0.0, 4))[0].intruders()
    report = Intruder(start, velocity, radius_m=RADIUS_M, name="a", time_s=0.0)
    elsewhere = replace(report, position_m=start + np.array([0.0, 0.0, 2.0]))
    assert find_unreported(moving, [report]) == []
    assert find_unreported(moving, [elsewhere]) == moving


def test_other_beams_see_movers_too() -> None:
    """Beams as a spinning sensor has them: fine across, coarse in height, ten sweeps a second."""
    pattern = BeamPattern.from_angles(
        np.radians(np.arange(-180.0, 180.0, 0.4)), np.radians(np.arange(-15.0, 16.0, 2.0))
    )
    lidar = Lidar("spinning", replace(pattern, max_range_m=60.0), sigma_m=0.02)
    following = Following(SETTINGS)
    start, velocity = np.array([9.0, 6.0, 0.3]), np.array([0.0, -2.0, 0.0])
    for step in range(20):
        state = State(np.array([0.1 * step, 0.0, 0.0]), time_s=0.1 * step)
        still = Obstacle.ball([8.0, -6.0, 0.0], 1.0)
        ball = Obstacle.ball(start + 0.1 * step * velocity, RADIUS_M)
        scan = simulate_scan(lidar, ObstacleMap([ball, still]), state, step)
        following = follow(following, lidar, scan, state)
    (moving,) = following.intruders()
    assert np.abs(moving.velocity_mps - velocity).max() < 0.2


def flown_following(world: World, to_fly: object, **simulation: object) -> AvoidanceSystem:
    system = AvoidanceSystem(planner(follow_movers=True), to_fly, lidars=(LIDAR,))  # type: ignore[arg-type]
    run = simulate(system, world, lidars=(LIDAR,), settings=SimulationSettings(**simulation))  # type: ignore[arg-type]
    assert run.safe
    assert not any(entry.flight.decision.intruders for entry in run.decisions)
    return system


@pytest.mark.nightly
def test_nothing_moves_in_the_static_mission() -> None:
    flown_following(static_world(), STATIC, seed=0)
    flown_following(static_world(), STATIC, seed=1, position_sigma_m=0.1)


@pytest.mark.parametrize(
    "seed", [2, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (0, 1, 3))]
)
def test_nothing_moves_among_balls(seed: int) -> None:
    world, to_fly, *_ = ball_world(seed)
    flown_following(world, to_fly, seed=seed)


@pytest.mark.parametrize(
    "wall", ["tall wall", pytest.param("gap of 4 m to one side", marks=pytest.mark.nightly)]
)
def test_nothing_moves_along_walls(wall: str) -> None:
    flown_following(ObstacleMap(WALLS[wall]), mission((40, 0, 0)), seed=1)


@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=pytest.mark.nightly) for seed in (0, 1, 2)]
)
def test_nothing_moves_in_woods(seed: int) -> None:
    """Trunks, and crowns that beams pass through here and there."""
    rng = np.random.default_rng(seed)
    trunks = ObstacleMap(
        [
            Obstacle.line([x, y, 0.0], 12.0, radius_m=0.15, orientation_rad=[0.0, np.pi / 2.0, 0.0])
            for x, y in rng.uniform([4.0, -10.0], [25.0, 10.0], (30, 2))
        ]
    )
    crowns = rng.uniform([6.0, -9.0, -4.0], [25.0, 9.0, 4.0], (10, 3))
    leaves = (crowns[:, None] + rng.normal(0.0, 0.5, (10, 250, 3))).reshape(-1, 3)
    woods = CombinedWorld([trunks, PointWorld(np.ascontiguousarray(leaves), 0.05)])
    flown_following(woods, mission((30, 0, 0)), seed=seed)


def encounter(
    course_deg: float,
    speed_mps: float,
    follows: bool = True,
    max_range_m: float = 10.0,
    traffic: TrafficSettings | None = None,
    seed: int = 0,
) -> Run:
    """Straight flight would meet a silent intruder after 14 s, in the middle of its body."""
    course = np.radians(course_deg)
    velocity = speed_mps * np.array([np.cos(course), np.sin(course), 0.0])
    silent = ScriptedIntruder(
        "silent",
        0.0,
        np.array([14.0, 0.0, 0.0]) - 14.0 * velocity,
        velocity,
        np.array([np.pi / 16, np.pi / 24]),
        RADIUS_M,
        "world",
        transponder=False,
        visible=True,
    )
    pattern = BeamPattern.per_cell(GRID, max_range_m=max_range_m)
    lidar = Lidar("lidar", pattern, sigma_m=0.03, dropout=0.05)
    to_fly = mission((30.0, 0.0, 0.0))
    system = AvoidanceSystem(planner(escape="off", follow_movers=follows), to_fly, lidars=(lidar,))
    return simulate(
        system,
        EMPTY,
        lidars=(lidar,),
        settings=SimulationSettings(seed=seed),
        traffic=Traffic([silent], to_fly, 1.0, traffic, seed),
    )


def nearest_m(run: Run) -> float:
    assert run.metrics.intruders is not None
    return run.metrics.intruders.min_distance_m


@pytest.mark.parametrize("course_deg", [180.0, 150.0, 120.0, -105.0])
@pytest.mark.parametrize("speed_mps", [0.5, 1.0, 1.5])
def test_up_to_half_more_than_the_own_speed_a_range_of_ten_metres_keeps_the_margin(
    course_deg: float, speed_mps: float
) -> None:
    run = encounter(course_deg, speed_mps)
    assert run.safe
    assert nearest_m(run) >= 1.2


@pytest.mark.parametrize("seed", range(4))
def test_one_that_turns_a_little_every_second_is_followed_too(seed: int) -> None:
    run = encounter(150.0, 0.75, traffic=TrafficSettings(deviates=True), seed=seed)
    assert run.safe


def test_a_faster_one_takes_a_longer_range() -> None:
    assert nearest_m(encounter(135.0, 2.0)) < 1.2, "two scans leave too little"
    assert encounter(135.0, 2.0, max_range_m=15.0).safe


@pytest.mark.parametrize("own_mps", [0.0, 1.0])
def test_a_body_half_in_view_is_off_by_no_more_than_is_told(own_mps: float) -> None:
    """Half of a ball is as wide as the whole, and its middle elsewhere."""
    start, velocity = np.array([7.0, 3.0, 0.0]), np.array([0.0, 1.0, 0.0])
    half = False
    for count in range(2, 6):
        (moving,) = followed(scans_of(start, velocity, own_mps, count))[0].intruders()
        place = start + (count - 1) * velocity
        if moving.time_s < count - 1:
            break
        half = half or place[1] >= place[0] - own_mps * (count - 1)
        assert np.linalg.norm(moving.position_m - place) < 3.0 * moving.position_std_m
    assert half


def test_without_following_the_margin_is_lost() -> None:
    assert nearest_m(encounter(120.0, 1.0, follows=False)) < 1.2


def test_decisions_name_the_mover() -> None:
    run = encounter(150.0, 1.0)
    texts = [entry.flight.explanation for entry in run.decisions]
    assert any("of intruder lidar-1" in text for text in texts)


def test_the_same_seed_gives_the_same_run_with_movers_too() -> None:
    runs = [encounter(150.0, 1.0) for _ in range(2)]
    np.testing.assert_array_equal(runs[0].states, runs[1].states)
