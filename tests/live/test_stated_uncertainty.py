"""What the own state says of its own accuracy: kept in margins, in scans' places, and as news."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.decide import decide
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import PointMemory, Scan, simulate_scan, update_memory
from clearway.sim import SimulationSettings, simulate
from clearway.sim.worlds import ball_world
from worlds_for_tests import LIDAR, mission, planner

PLANNER = planner()
FIVE_DEG = np.radians(5.0)


@pytest.mark.parametrize(
    "seed", [3, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (0, 1, 2, 4, 5))]
)
def test_with_an_attitude_off_by_what_is_stated_the_margin_is_kept(seed):
    world, there, *_ = ball_world(seed)
    run = simulate(
        AvoidanceSystem(PLANNER, there, lidars=(LIDAR,)),
        world,
        lidars=(LIDAR,),
        settings=SimulationSettings(seed=seed, attitude_sigma_rad=FIVE_DEG),
    )
    assert run.reached
    assert run.metrics.margin_violations == 0


def test_a_mapped_ball_far_away_is_kept_from_by_more_than_one_nearby():
    """Whatever way the attitude is off within three deviations, the plan keeps the margin."""
    for x in (6.0, 9.0):
        ball = ObstacleMap([Obstacle.ball([x, 1.5, 0.0], 1.0)])
        state = State([0.0, 0.0, 0.0], attitude_std_rad=FIVE_DEG)
        decision = decide(PLANNER, Situation(state, np.array([30.0, 0.0, 0.0]), obstacle_map=ball))
        assert decision.choice.clearance_m >= decision.margin_m - 1e-9
        for turn in np.linspace(-3.0, 3.0, 13) * FIVE_DEG:
            cos, sin = np.cos(turn), np.sin(turn)
            turned = decision.path_m @ [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]
            kept = np.linalg.norm(turned - [x, 1.5, 0.0], axis=1).min() - 1.0
            assert kept >= PLANNER.settings.safety_margin_m - 1e-6


def test_returns_stand_for_all_places_where_they_may_be():
    scan = Scan(np.array([[2.0, 0.0, 0.0], [9.0, 1.0, 0.0]]), 0.0, sensor="lidar")
    empty = PointMemory.empty(0.12)
    sure = update_memory(empty, LIDAR, scan, State(np.zeros(3)))
    unsure = update_memory(empty, LIDAR, scan, State(np.zeros(3)), angle_rad=3.0 * FIVE_DEG)
    grown = unsure.radius_m - sure.radius_m
    away = np.linalg.norm(unsure.position_m, axis=1)
    np.testing.assert_allclose(grown, np.tan(3.0 * FIVE_DEG) * away)


def test_a_sweep_that_may_look_elsewhere_forgets_nothing():
    """A ball at the border of what is seen: with an attitude off it may be just outside."""
    ball = ObstacleMap([Obstacle.ball([4.0, 3.6, 0.0], 0.5)])
    here = State(np.zeros(3))
    seen = update_memory(PointMemory.empty(0.12), LIDAR, simulate_scan(LIDAR, ball, here), here)
    forgotten = remembered = seen
    for second in (1.0, 2.0, 3.0):
        nothing = Scan(np.zeros((0, 3)), second, sensor="lidar")
        forgotten = update_memory(forgotten, LIDAR, nothing, here)
        remembered = update_memory(remembered, LIDAR, nothing, here, angle_rad=3.0 * FIVE_DEG)
    assert len(forgotten.radius_m) < len(seen.radius_m)
    assert len(remembered.radius_m) == len(seen.radius_m) > 0


@pytest.mark.parametrize("grows", [{"position_std_m": 0.4}, {"attitude_std_rad": FIVE_DEG}])
def test_a_margin_that_grows_is_news_at_once(grows):
    """The plan passes the ball by the margin; once less is certain, it no longer does."""
    ball = ObstacleMap([Obstacle.ball([5.0, 0.2, 0.0], 1.0)])
    live = AvoidanceSystem(PLANNER, mission((30.0, 0.0, 0.0)), lidars=(), obstacle_map=ball)
    live.update(State(np.zeros(3)))
    assert live.decide(0.0).decision.margin_m == 0.6
    assert live.due(0.1) is None
    live.update(live.state_at(0.2))
    assert live.due(0.2) is None
    there = live.state_at(0.3)
    live.update(State(there.position_m, there.attitude_rad, time_s=0.3, **grows))
    assert "m of the map" in (live.due(0.3) or "")
    live.decide(0.3)
    live.update(State(there.position_m, there.attitude_rad, time_s=0.31, **grows))
    assert live.due(0.31) is None, "decided with the grown margin"


def test_a_margin_that_grows_in_free_space_is_no_reason_to_decide():
    live = AvoidanceSystem(PLANNER, mission((30.0, 0.0, 0.0)))
    live.update(State(np.zeros(3)))
    live.decide(0.0)
    live.update(State([0.3, 0.0, 0.0], time_s=0.3, position_std_m=0.5))
    assert live.due(0.3) is None


@pytest.mark.parametrize(
    ("kind", "sigmas", "told"),
    [
        ("plane", {}, ""),
        ("plane", {"position_sigma_m": 0.1}, "state estimates are off by 0.1 m,"),
        (
            "plane",
            {"position_sigma_m": 0.2, "attitude_sigma_deg": 0.5},
            "state estimates are off by 0.2 m and 0.5 deg,",
        ),
        ("inertialess", {"position_sigma_m": 0.1}, ""),
    ],
)
def test_before_take_off_it_is_said_what_they_cost_who_cannot_stop(
    kind: str, sigmas: dict[str, float], told: str
) -> None:
    file = read_mission_file("static-obstacles").with_values("vehicle", kind=kind)
    setup = prepare(file.with_values("simulation", **sigmas))
    assert setup.escape.flown == "strict"
    assert told in setup.escape.why
    assert ("state estimates" in setup.escape.why) is bool(told)
    assert setup.system().escape == setup.escape
