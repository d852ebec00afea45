"""Closed loop: what must hold of whole flights."""

import numpy as np
import pytest

from clearway.base.errors import ClearwayError
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import SimulationSettings
from clearway.sim.worlds import ball_world
from worlds_for_tests import STATIC, WALLS, flown, mission, static_world

EMPTY = ObstacleMap()
AT_NIGHT = ("tall wall", "wide low wall")
"""Walls that a night run flies round."""


@pytest.mark.parametrize("rating", ["total", "printed", "visible", "evidence"])
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))]
)
def test_the_static_mission_keeps_its_margin(rating, seed):
    run = flown(static_world(), STATIC, settings={"rating": rating}, seed=seed)
    assert run.reached
    assert run.emergencies == 0
    assert run.metrics.min_obstacle_distance_m >= 0.6
    assert np.diff(run.time_s).max() <= 0.05 + 1e-9
    assert run.metrics.time_s < 90.0


def test_the_same_seed_gives_the_same_run_bit_for_bit():
    runs = [flown(static_world(), STATIC, seed=7, time_limit_s=30.0) for _ in range(2)]
    np.testing.assert_array_equal(runs[0].states, runs[1].states)
    assert runs[0].movements == runs[1].movements
    texts = [[entry.flight.explanation for entry in run.decisions] for run in runs]
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("waypoint", "radius"),
    [
        ((-20, 0, 0), 1.5),
        ((20, 0, 9.75), 1.5),
        ((2, 0, 12), 1.5),
        ((0, 3.8, 0), 1.0),
        ((1, -2, 0), 1.0),
        ((0, 0, 5), 1.0),
    ],
    ids=[
        "behind",
        "above at 26 deg",
        "overhead",
        "on the circle",
        "inside the circle",
        "straight up",
    ],
)
def test_waypoints_anywhere_are_reached(waypoint, radius):
    # Beside the start nobody has looked: a way there through seen space takes longer.
    there = mission(waypoint, radius=radius)
    assert flown(EMPTY, there, settings={"escape": "known"}).reached


@pytest.mark.parametrize(
    "wall",
    [pytest.param(wall, marks=pytest.mark.nightly if wall in AT_NIGHT else []) for wall in WALLS],
)
def test_walls_are_flown_round(wall):
    # Ways out through seen space alone lead along the wide one, not over it, in that time.
    settings = {"escape": "off"} if wall == "wide low wall" else {}
    run = flown(ObstacleMap(WALLS[wall]), mission((40, 0, 0)), seed=1, settings=settings)
    assert run.safe
    assert run.emergencies == 0


@pytest.mark.parametrize(
    ("seed", "latency"),
    [(3, 1.0), *(pytest.param(*each, marks=pytest.mark.nightly) for each in ((3, 0.0), (77, 1.0)))],
)
def test_random_balls_are_passed_with_the_margin(seed, latency):
    world, to_fly, *_ = ball_world(seed)
    assert flown(world, to_fly, seed=seed, scan_latency_s=latency).safe


def test_a_mapped_obstacle_is_avoided_without_any_sensor():
    world = ObstacleMap([Obstacle.ball([10, 0, 0], 2.0)])
    run = flown(world, mission((20, 0, 0)), obstacle_map=world, lidars=())
    assert run.safe


def test_straight_flight_would_have_crashed():
    positions = np.stack([np.linspace(0, 20, 401), np.zeros(401), np.zeros(401)], axis=1)
    assert static_world().distance_m(positions).min() < 0.0


def test_cell_ratings_alone_fly_the_static_mission_too():
    run = flown(static_world(), STATIC, settings={"verify": False}, seed=0)
    assert run.reached
    assert run.metrics.min_obstacle_distance_m >= 0.6


def test_disturbed_flight_is_corrected_and_keeps_the_margin():
    run = flown(static_world(), STATIC, seed=2, state_noise_mps=0.1, input_noise=0.1)
    assert run.safe
    assert run.corrections > 0


def test_an_uncertain_position_widens_the_margin():
    sure = flown(static_world(), STATIC, seed=2, time_limit_s=25.0)
    unsure = flown(static_world(), STATIC, seed=2, position_sigma_m=0.1, time_limit_s=25.0)
    margins = [run.decisions[0].flight.decision.margin_m for run in (sure, unsure)]
    assert margins[1] == pytest.approx(margins[0] + 0.3)


def test_a_scale_fifteen_times_as_large_changes_nothing_but_the_scale():
    from clearway.avoidance.plan.planner import Planner
    from clearway.avoidance.plan.settings import AvoidanceSettings
    from clearway.base.grid import AvoidanceGrid
    from clearway.base.state import State
    from clearway.live.mission import Mission
    from clearway.reach import ReachLibrary
    from clearway.sensors import BeamPattern, Lidar
    from clearway.sim import simulate
    from clearway.vehicle.automaton import MovementAutomaton

    scale = 15.0
    grid = AvoidanceGrid.uniform(10.0 * scale)
    library = ReachLibrary.build(MovementAutomaton.plane(speed_mps=scale), grid)
    world = ObstacleMap([Obstacle.ball(scale * np.array([10.0, 0, 0]), 2.0 * scale)])
    lidar = Lidar("lidar", BeamPattern.per_cell(grid, max_range_m=10.0 * scale))
    to_fly = Mission(
        "large",
        State(np.zeros(3)),
        waypoints_m=np.array([[20.0 * scale, 0, 0]]),
        reach_radius_m=1.5 * scale,
    )
    system = AvoidanceSystem(
        Planner.of(library, AvoidanceSettings(safety_margin_m=0.6 * scale)), to_fly, lidars=(lidar,)
    )
    run = simulate(system, world, lidars=(lidar,))
    assert run.safe


@pytest.mark.parametrize(
    "setting", [{"step_s": 0.1}, {"step_s": 0.0}, {"scan_latency_s": -1.0}, {"input_noise": np.nan}]
)
def test_impossible_simulations_are_refused(setting):
    with pytest.raises(ClearwayError, match=next(iter(setting))):
        SimulationSettings(**setting)
