"""The plan being flown: what is held and where the vehicle is to be, from a decision to its end."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import simulate_scan
from clearway.sim import simulate
from clearway.sim.baselines import BaselinePilot, Manoeuvre
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from worlds_for_tests import AUTOMATON, GRID, LIDAR, STATIC, mission, planner, static_world

PLANNER = planner(escape="off")
SIDES = np.vstack([np.eye(3), -np.eye(3)])
AHEAD = mission((30.0, 8.0, 4.0))


def decided(time_s, attitude=(0.0, 0.0, 0.0), to_fly=AHEAD):
    """A system that has just decided, and the own state that it decided for."""
    live = AvoidanceSystem(PLANNER, to_fly, lidars=(LIDAR,))
    here = State([1.0, -2.0, 3.0], attitude, time_s=time_s)
    live.update(here)
    live.update(simulate_scan(LIDAR, ObstacleMap(), here))
    live.decide(time_s)
    return live, here


def test_before_the_first_decision_nothing_is_flown():
    live = AvoidanceSystem(PLANNER, AHEAD, lidars=(LIDAR,))
    live.update(State(np.zeros(3)))
    for time_s in (-1.0, 0.0, 1.0, np.inf, np.nan):
        assert live.movement_at(time_s) is None
        assert live.state_at(time_s) is None
    assert live.holds_until_s == -np.inf


@given(
    begin_s=st.sampled_from([0.0, 0.1, 1e6 / 3.0, 1_763_700_000.1]),
    pitch=st.floats(-0.5, 0.5),
    yaw=st.floats(-3.1, 3.1),
)
@settings(max_examples=20, deadline=None)
def test_right_after_a_decision_and_until_its_end_it_says_what_to_fly(begin_s, pitch, yaw):
    live, here = decided(begin_s, (0.0, pitch, yaw))
    names = live.buffer.names
    now = live.state_at(begin_s)
    np.testing.assert_allclose(now.vector, here.vector, atol=1e-12)
    at = here.vector
    for n, name in enumerate(names):
        movement = AUTOMATON[name]
        for time_s in (begin_s + n, begin_s + n + 0.5):
            assert live.movement_at(time_s) == movement, "where one ends the next is flown"
            state = live.state_at(time_s)
            assert state.time_s == time_s
            part = AUTOMATON.predict(at, movement, time_s - begin_s - n)
            np.testing.assert_allclose(state.vector, part, atol=1e-6)
        at = AUTOMATON.predict(at, movement)
    end_s = live.buffer.end_s
    assert live.movement_at(end_s).name == names[-1]
    np.testing.assert_allclose(live.state_at(end_s).vector, at, atol=1e-6)
    for outside in (begin_s - 0.01, end_s + 0.01, np.inf, np.nan):
        assert live.movement_at(outside) is None
        assert live.state_at(outside) is None


def test_the_next_decision_begins_another_plan_from_the_state_it_decides_for():
    live, _ = decided(0.0)
    later = State([2.0, 5.0, 3.0], [0.0, 0.0, 0.4], time_s=1.0)
    live.update(later)
    live.decide(1.0)
    assert live.state_at(1.0).position_m.tolist() == [2.0, 5.0, 3.0]
    assert live.movement_at(1.0).name == live.buffer.names[0]
    assert live.movement_at(0.5) is None, "what was flown before is past"


def test_own_states_that_come_do_not_move_the_plan():
    live, _ = decided(0.0)
    planned = live.state_at(0.8).vector
    live.update(State([9.0, 9.0, 9.0], time_s=0.5))
    np.testing.assert_array_equal(live.state_at(0.8).vector, planned)


def test_who_looks_to_and_fro_leaves_at_last_and_who_is_shut_in_holds():
    able = MovementAutomaton.inertialess()
    hovering = Planner.of(ReachLibrary.build(able, GRID), AvoidanceSettings(escape="off"))
    box = [Obstacle.cuboid(1.6 * side, 0.5 + 5.5 * (side == 0.0), radius_m=0.0) for side in SIDES]

    def stands(obstacles, stood):
        there = Situation(State(np.zeros(3)), np.array([-20.0, 0.0, 0.0]), obstacle_map=obstacles)
        begins = decide(hovering, there, commitment=Commitment(stood=stood)).movements[0]
        return able.stands[able.names.index(begins)]

    assert [stands(None, stood) for stood in (0, 1, 9)] == [True, True, False], "it is behind"
    assert all(stands(ObstacleMap(box), stood) for stood in (0, 9)), "nothing else is safe"


def test_decisions_that_lead_nowhere_are_counted_until_one_leads_somewhere():
    able = MovementAutomaton.inertialess()
    hovering = Planner.of(ReachLibrary.build(able, GRID), AvoidanceSettings(escape="off"))
    live = AvoidanceSystem(hovering, mission((-30.0, 0.0, 0.0)))
    state, led = State(np.zeros(3)), []
    for tick in range(8):
        live.update(replace(state, time_s=float(tick)))
        name = live.decide(float(tick)).movements[0]
        led.append((able.stands[able.names.index(name)], live._plan.stood))
        state = replace(state, position_m=live.state_at(tick + 1.0).position_m,
                        attitude_rad=live.state_at(tick + 1.0).attitude_rad)  # fmt: skip
    assert led[0] == (True, 1)
    assert led[-1] == (False, 0)
    counts = [stood for _, stood in led]
    assert counts == sorted(counts[: max(counts)]) + [0] * (8 - max(counts))


def test_the_plan_holds_until_it_ends_or_has_to_be_renewed():
    live, _ = decided(0.0)
    assert 0.0 < live.holds_until_s <= live.buffer.end_s
    assert live.due(live.holds_until_s - 0.1) is None
    assert live.due(live.holds_until_s) is not None


def test_the_simulator_flies_what_the_plan_says():
    """Movement by movement: the names flown are those that the system says at each beginning."""
    live = AvoidanceSystem(PLANNER, STATIC, lidars=(LIDAR,))
    said = []
    truly = live.movement_at

    def heard(time_s):
        said.append((time_s, truly(time_s)))
        return said[-1][1]

    live.movement_at = heard
    run = simulate(live, static_world(), lidars=(LIDAR,))
    assert [movement.name for _, movement in said] == list(run.movements)
    begins = [time_s for time_s, _ in said]
    for entry in run.decisions:
        first = AUTOMATON[entry.flight.movements[0]]
        assert dict(said)[entry.flight.time_s] == first
    assert begins == sorted(begins)


def test_a_pilot_with_nothing_to_fly_is_an_error_that_says_so():
    class Idle(BaselinePilot):
        def movement_at(self, _):
            return None

    idle = Idle(
        AvoidanceSystem(PLANNER, AHEAD, lidars=(LIDAR,)),
        lambda _, __: Manoeuvre(("Straight",), "on"),
    )
    with pytest.raises(ClearwayError, match="nothing to fly at 0 s"):
        simulate(idle, ObstacleMap(), lidars=(LIDAR,))


@given(
    names=st.lists(st.sampled_from(["Left", "Up", "Straight"]), min_size=1, max_size=5),
    share=st.floats(0.0, 1.0),
)
def test_a_buffer_is_held_without_gap_from_its_beginning_to_its_end(names, share):
    buffer = MovementBuffer.of(AUTOMATON.chain(names), 2.0)
    time_s = 2.0 + share * len(names)
    held = buffer.find_held(time_s)
    assert held is not None
    assert held == (buffer.at(time_s) if share and time_s % 1.0 else held)
    assert buffer.find_held(1.99) is None
    assert buffer.find_held(buffer.end_s + 0.01) is None
    assert MovementBuffer().find_held(0.0) is None
