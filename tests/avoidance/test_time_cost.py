"""Time to go of a vehicle with inertia."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner, prepare_next
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.plan.time_cost import TOO_SLOW, speed_abilities, time_to_go_m
from clearway.avoidance.rate.goal import Goal, arrival
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.reach.store import ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton

COPTER = MovementAutomaton.multirotor(speed_mps=8.0, acceleration_mps2=4.0)


@cache
def library() -> ReachLibrary:
    """Built when a test asks for it: every process collects this module."""
    return ReachLibrary.load_or_build(COPTER, AvoidanceGrid.uniform(range_m=30.0))


@cache
def without_escapes() -> Planner:
    return Planner.of(library(), AvoidanceSettings(escape="off"))


def to_go_s(at: int, target: tuple[float, float, float], *, final: bool = False) -> np.ndarray:
    reach_set = library().reach_sets[at]
    place = np.array(target)
    goal = Goal(place, place, 1.0, final)
    nodes = np.flatnonzero(reach_set.exit_kind == 1)
    return time_to_go_m(reach_set, nodes, goal, arrival(reach_set, goal), COPTER) / 8.0


def test_it_is_never_less_than_the_straight_way_at_full_speed() -> None:
    target = np.array([200.0, 40.0, 0.0])
    for at in range(0, len(library().reach_sets), 5):
        reach_set = library().reach_sets[at]
        nodes = np.flatnonzero(reach_set.exit_kind == 1)
        away = np.linalg.norm(reach_set.states[nodes, :2] - target[:2], axis=1)
        assert np.all(to_go_s(at, tuple(target)) >= away / 8.0 - 1e-9)


def test_towards_the_goal_speed_saves_what_it_takes_to_gain() -> None:
    """From rest to v costs v / 2 a more than to be at v already, of which a share counts."""
    able = speed_abilities(COPTER)
    assert able.acceleration_mps2 == pytest.approx(4.0)
    assert able.fastest_mps == 8.0
    reach_set = library().reach_sets[0]
    nodes = np.flatnonzero(reach_set.exit_kind == 1)
    classes = COPTER.classes
    assert classes is not None
    goal = Goal(np.array([1e3, 0.0, 0.0]), np.array([1e3, 0.0, 0.0]), 1.0, False)
    cost = time_to_go_m(reach_set, nodes, goal, arrival(reach_set, goal), COPTER) / 8.0
    ahead = np.abs(reach_set.states[nodes, 5]) < 1e-9
    level = np.abs(reach_set.states[nodes, 2]) < 1e-9
    for node, seconds in zip(nodes[ahead & level], cost[ahead & level], strict=True):
        speed = float(classes.speed_mps[classes.class_at(float(reach_set.states[node, 3]))])
        away = float(np.hypot(1e3 - reach_set.states[node, 0], reach_set.states[node, 1]))
        assert seconds == pytest.approx(
            away / 8.0 + (TOO_SLOW * (8.0 - speed)) ** 2 / (2 * 4.0 * 8.0), abs=1e-3
        )


@settings(max_examples=25, deadline=None)
@given(
    bearing=st.floats(-np.pi, np.pi),
    away=st.floats(64.0, 120.0),
    rise=st.one_of(st.just(0.0), st.floats(-8.0, 8.0)),
    yaw=st.floats(-np.pi, np.pi),
)
def test_in_empty_air_it_arrives_without_porpoising(
    bearing: float, away: float, rise: float, yaw: float
) -> None:
    """Flown by its own decisions: within 2 % of straight, as high as asked for, without delay."""
    state = State(np.array([0.3, -0.2, 5.1]), np.array([0.0, 0.0, yaw]))
    way = np.array([away * np.cos(bearing), away * np.sin(bearing), rise])
    target = state.position_m + way
    assert COPTER.classes is not None
    state, track, at = COPTER.in_class(state, None), [state.position_m], 0
    while np.linalg.norm(state.position_m - target) > 1.5 and at < 80:
        decision = decide(without_escapes(), Situation(state, target, reach_radius_m=1.5))
        vector = COPTER.rollout(state.vector, decision.movements[:1]).states
        track += list(vector[1:, :3])
        if np.any(np.linalg.norm(vector[:, :3] - target, axis=1) <= 1.5):
            break
        state = State(vector[-1, :3], vector[-1, 3:])
        at += 1
    path = np.array(track)
    assert np.linalg.norm(path - target, axis=1).min() <= 1.5
    # Looking elsewhere, it gathers speed while it turns: that is quicker, and a little longer.
    flown_m = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    assert flown_m <= 1.02 * np.linalg.norm(way) + 4.0
    low, high = sorted((5.1, 5.1 + rise))
    past_m = 0.4 if rise else 0.2
    assert path[:, 2].min() >= low - past_m
    assert path[:, 2].max() <= high + past_m
    # A turn on the spot, accelerating, and the way; braking to a stop at its end is not asked for.
    least_s = away / 8.0 + 8.0 / (2.0 * 4.0)
    turn_s = abs((bearing - yaw + np.pi) % (2.0 * np.pi) - np.pi) / np.radians(90.0)
    assert (at + 1) * COPTER.movements[0].duration_s <= 1.1 * least_s + turn_s + 3.0


def test_vehicles_without_speeds_have_none() -> None:
    with pytest.raises(ClearwayError, match="no classes of speed"):
        speed_abilities(MovementAutomaton.plane())


def test_sets_that_may_be_asked_for_next_are_prepared_one_at_a_time() -> None:
    planner, classes = Planner.of(library()), COPTER.classes
    assert classes is not None
    count = 0
    while prepare_next(planner, None):
        count += 1
    ends = {end for end in classes.following[classes.first].tolist() if end >= 0}
    assert count == len(ends | {classes.first})
    assert not prepare_next(planner, None)


def test_before_take_off_all_can_be_prepared() -> None:
    planner, classes = Planner.of(library(), AvoidanceSettings(escape="off")), COPTER.classes
    assert classes is not None
    mission = Mission("on", State(np.zeros(3)), waypoints_m=np.array([[50.0, 0.0, 0.0]]))
    AvoidanceSystem(planner, mission).warm_up()
    assert not any(prepare_next(planner, at) for at in range(len(classes.classes)))
