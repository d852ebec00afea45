"""A vehicle that cannot climb goes by level distance, whatever the heights of its waypoints."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation, goal_of
from clearway.avoidance.rate.goal import arrival
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission, Progress, advance_progress
from clearway.mavlink.simulated_autopilot import SimulatedAutopilot
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sim import simulate
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.table import MovementTable
from repository import REPOSITORY
from simulated_flight import SimulatedFlight

GRID = AvoidanceGrid.uniform()
LEVEL = Planner.of(ReachLibrary.build(MovementAutomaton.plane(pitch_limit_deg=0.0), GRID))
HEIGHTS = (0.0, 1e-7, 0.01, 1.0, 4.1, 30.0, -2.0)


@pytest.mark.parametrize(
    ("automaton", "stays"),
    [
        (MovementAutomaton.plane(pitch_limit_deg=0.0), True),
        (MovementAutomaton.plane(pitch_limit_deg=10.0), True),
        (MovementAutomaton.plane(pitch_limit_deg=15.0), False),
        (MovementAutomaton.plane(pitch_limit_deg=None), False),
        (MovementAutomaton((Movement("Straight", 1.0), Movement("Left", 1.0, 0, 0, 0.3))), True),
    ],
)
def test_what_stays_level_cannot_leave_level_flight(
    automaton: MovementAutomaton, stays: bool
) -> None:
    assert automaton.stays_level is stays


def test_a_movement_may_climb_without_pitching() -> None:
    rows = {"Straight": [1.0, 0, 0, 0, 0, 0], "Rise": [1.0, 0, 1.0, 0, 0, 0]}
    movements = tuple(Movement(name, 1.0) for name in rows)
    lift = MovementAutomaton(movements, 0.0, table=MovementTable.from_rows(rows))
    assert not lift.stays_level
    assert lift.steepest_rad == pytest.approx(np.radians(45.0))


@pytest.mark.parametrize("height_m", HEIGHTS)
def test_heights_of_goals_change_neither_costs_nor_choice(height_m: float) -> None:
    ball = ObstacleMap([Obstacle.ball([6.0, 0.3, 0.0], 1.0)])

    def decided(height: float) -> Any:
        target, following = np.array([12.0, 1.0, height]), np.array([20.0, 4.0, -height])
        here = State(np.zeros(3))
        return decide(LEVEL, Situation(here, target, next_m=following, obstacle_map=ball)).choice

    level, told = decided(0.0), decided(height_m)
    assert np.isfinite(told.cost_m)
    assert (told.node, told.cost_m) == (level.node, level.cost_m)


@pytest.mark.parametrize("height_m", HEIGHTS)
def test_a_waypoint_counts_as_reached_from_above_or_below(height_m: float) -> None:
    mission = Mission(
        "level", State(np.zeros(3)), waypoints_m=np.array([[12.0, 3.0, height_m], [24.0, 0, 0]])
    )
    run = simulate(AvoidanceSystem(LEVEL, mission), ObstacleMap(), lidars=())
    assert run.progress.is_done(mission)
    assert run.time_s[-1] < 26.0
    assert not run.states[:, 2].any()
    start = Situation(State(np.array([11.5, 3.0, 0.0])), np.array([12.0, 3.0, height_m]))
    assert arrival(LEVEL.prepare(0.0).reach_set, goal_of(start, stays_level=True)).first.any()


def test_what_can_climb_has_to() -> None:
    mission = Mission("high", State(np.zeros(3)), waypoints_m=np.array([[12.0, 0.0, 3.0]]))
    above = np.array([12.0, 0.0, 0.0])
    assert advance_progress(mission, Progress(), above, 1.0).goal == 0
    assert advance_progress(mission, Progress(), above, 1.0, stays_level=True).goal == 1


def flown_in_lock_step(waypoint_m: list[float], most_s: float) -> SimulatedAutopilot:
    """The example of docs/mavlink.md without anything in the way, flown to a waypoint."""
    told = tomllib.loads((REPOSITORY / "examples/missions/mavlink.toml").read_text())
    told = {key: told[key] for key in ("vehicle", "grid", "safety", "mission")}
    told["mission"]["waypoints_m"] = [waypoint_m]
    told["lidar"] = []
    file = MissionFile.model_validate(told)
    setup = prepare(file)
    flight = SimulatedFlight(file, setup, rate_hz=5.0, speedup=None)
    flight.run(most_s)
    return flight.autopilot


@pytest.mark.parametrize("height_m", [0.01, 4.1, -3.0])
def test_an_autopilot_is_led_to_waypoints_above_and_below_its_height(height_m: float) -> None:
    autopilot = flown_in_lock_step([12.0, 2.0, 5.0 + height_m], most_s=60.0)
    assert autopilot.has_arrived
    away = autopilot.truth.position_m - [12.0, 2.0, 5.0]
    assert np.hypot(away[0], away[1]) < 0.5
    assert abs(away[2]) < 0.1, "it holds its own height: nothing was looked at above or below"
