"""Goals steeper than vehicles climb that climb only as they go ahead: they are reached."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.avoidance.plan.costs import Prices, _climb_cost, turning_distance_to_go
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.rate.goal import Goal, arrival
from clearway.base.grid import AvoidanceGrid
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.reach import ReachLibrary
from clearway.reach.tree import ReachSet
from clearway.sim.plants.movements import aeroplane_movements, quadrotor_movements
from clearway.vehicle.automaton import MovementAutomaton
from repository import REPOSITORY

QUADROTOR = quadrotor_movements()
GRID = AvoidanceGrid.uniform(range_m=50.0)
FREE = (0.0, 0.0)
STEEPEST = 0.3
TAN, SIN = float(np.tan(STEEPEST)), float(np.sin(STEEPEST))


def test_who_climbs_only_as_it_goes_ahead_is_known():
    assert QUADROTOR.climbs_ahead
    assert aeroplane_movements().climbs_ahead
    assert not MovementAutomaton.plane().climbs_ahead, "it holds a pitch"
    assert not MovementAutomaton.inertialess().climbs_ahead, "it goes straight up"
    assert not MovementAutomaton.inertialess(climb_mps=0.0).climbs_ahead, "it stays level"


def test_known_costs_of_climbs():
    assert _climb_cost(30.0, 40.0, 7.0, 0.0, STEEPEST, (2.0, 9.0)) == pytest.approx(57.0)
    shallow = _climb_cost(30.0, 40.0, 0.0, 10.0, STEEPEST, (2.0, 9.0))
    assert shallow == pytest.approx(np.sqrt(2600.0) + 20.0)
    # Straight above: half of the way there, a half turn, and half of it back.
    assert _climb_cost(0.0, 0.0, 0.0, -20.0, STEEPEST, (2.0, 9.0)) == pytest.approx(
        20.0 / SIN + 40.0 + 9.0 * np.pi
    )


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-80.0, 80.0))
def test_no_climb_costs_less_than_its_straight_way_or_its_slope(ahead, left, rise):
    cost = _climb_cost(ahead, left, 0.0, rise, STEEPEST, FREE)
    assert cost >= np.sqrt(ahead**2 + left**2 + rise**2) - 1e-9
    assert cost >= abs(rise) / SIN * (1.0 - 1e-12) or abs(rise) <= np.hypot(ahead, left) * TAN
    assert _climb_cost(ahead, -left, 0.0, rise, STEEPEST, (1.0, 5.0)) == pytest.approx(
        _climb_cost(ahead, left, 0.0, rise, STEEPEST, (1.0, 5.0))
    )


@given(st.floats(0.0, 40.0), st.floats(10.0, 60.0), st.floats(0.1, 2.0))
def test_who_flies_on_away_and_climbs_loses_nothing(away, rise, flown):
    """Below a steep goal the way on is as good as any: it is turned back from later."""
    if rise - flown * TAN <= (away + flown) * TAN:
        return  # High enough: it turns back now.
    before = _climb_cost(-away, 0.0, 0.0, rise, STEEPEST, (1.0, 5.0))
    after = _climb_cost(-away - flown, 0.0, 0.0, rise - flown * TAN, STEEPEST, (1.0, 5.0))
    length = flown / np.cos(STEEPEST)
    assert after + length + flown * TAN == pytest.approx(before, abs=1e-6)


def goal_at(target, following=None) -> Goal:
    target = np.array(target, dtype=float)
    return Goal(
        target, target if following is None else np.array(following), 4.0, following is None
    )


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner.of(ReachLibrary.load_or_build(QUADROTOR, GRID))


@pytest.fixture(scope="module")
def reach_set(planner: Planner) -> ReachSet:
    return planner.prepared_sets[0][1].reach_set


def test_a_waypoint_before_a_steep_leg_is_no_dearer_passed_than_not(reach_set: ReachSet):
    """The climb after it costs as much whether it is passed already or not."""
    goal = goal_at([15.0, 0, 0], following=[30.0, 0.0, 40.0])
    arrived = arrival(reach_set, goal)
    every = np.arange(reach_set.nodes)
    to_go = turning_distance_to_go(
        reach_set, every, goal, arrived, QUADROTOR, Prices().suit_vehicle(can_stop=False)
    )
    steepest = QUADROTOR.steepest_rad
    assert steepest is not None
    assert np.all(to_go[~arrived.reached] >= 40.0 / np.sin(steepest))
    leaf = reach_set.trajectories
    assert arrived.reached[leaf[np.argmin((reach_set.length_m + to_go)[leaf])]]


def test_below_a_steep_goal_nothing_that_waits_costs_least(planner: Planner, reach_set: ReachSet):
    goal = goal_at([0.0, 0.0, 20.0])
    leaf = reach_set.trajectories
    arrived = arrival(reach_set, goal)
    to_go = planner.terminal_cost(reach_set, leaf, goal, arrived, QUADROTOR)
    prepared = planner.prepared_sets[0][1]
    best = leaf[np.argmin(prepared.path_cost_m[leaf] + to_go)]
    assert reach_set.movements_to(best)[0] == "Up"


def test_other_vehicles_count_as_they_did():
    library = ReachLibrary.build(
        MovementAutomaton.plane(), AvoidanceGrid.uniform(), method="primitives"
    )
    assert Planner.of(library).terminal_cost is turning_distance_to_go


LEGS = {
    "above": lambda h: [[0, 0, h]],
    "ahead": lambda h: [[60, 0, h]],
    "then": lambda h: [[100, 0, 0], [0, 0, h]],
    "side": lambda h: [[60, 0, 0], [60, 60, h], [0, 60, 0]],
}


def flown(legs: str, height_m: float):
    tables = {
        "mission": {"name": legs, "waypoints_m": LEGS[legs](height_m), "reach_radius_m": 7.5},
        "vehicle": {
            "plant": "quadrotor",
            "automaton": str(REPOSITORY / "examples" / "automata" / "quadrotor.toml"),
            "body_radius_m": 0.5,
        },
        "grid": {"range_m": 50.0},
        "safety": {"margin_m": 3.0},
        "lidar": [{"sigma_m": 0.03, "dropout": 0.05}],
    }
    return prepare(parse_model(legs, tables, MissionFile)).fly()


def test_a_quadrotor_reaches_what_stands_straight_above_it():
    assert flown("above", 20.0).reached


@pytest.mark.nightly
@pytest.mark.parametrize("height_m", [20.0, 30.0, 50.0, -50.0])
@pytest.mark.parametrize("legs", LEGS)
def test_a_quadrotor_reaches_goals_steeper_than_it_climbs(legs: str, height_m: float):
    assert flown(legs, height_m).reached
