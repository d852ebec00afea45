"""Cost to go against a search over arcs, and arrival at goals."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from clearway.avoidance.clear.closing import closing_m
from clearway.avoidance.clear.hazards import nothing_moving
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.costs import Prices, _turn_then_straight, turning_distance_to_go
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.goal import Goal, arrival
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.reach import ReachLibrary, build_reach_set
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import planner

coordinate = st.floats(-30.0, 30.0)


def searched(x, y, radius):
    """Shortest of many arcs to either side, each followed by the straight rest if it fits."""
    best = np.inf
    angle = np.linspace(0.0, 2 * np.pi, 20_001)
    for side in (1.0, -1.0):
        px, py = radius * np.sin(angle), side * radius * (1 - np.cos(angle))
        dx, dy = x - px, y - py
        straight = np.hypot(dx, dy)
        ahead = np.cos(angle) * dx + side * np.sin(angle) * dy
        fits = straight - ahead <= 1e-5 * np.maximum(straight, 1.0)
        if fits.any():
            best = min(best, np.min((radius * angle + straight)[fits]))
    return best


@given(coordinate, coordinate, st.floats(0.5, 8.0))
def test_turn_then_straight_is_the_shortest_arc_and_line(x, y, radius):
    assume(min(np.hypot(x, abs(y) - radius), np.hypot(x, abs(y) + radius)) > radius + 0.05)
    assert _turn_then_straight(x, y, radius, radius, 0.0, np.inf) == pytest.approx(
        searched(x, y, radius), rel=1e-2, abs=0.05
    )


def test_known_lengths_to_go():
    assert _turn_then_straight(10.0, 0.0, 3.0, 3.0, 0.5, np.inf) == pytest.approx(10.0)
    assert _turn_then_straight(0.0, 6.0, 3.0, 3.0, 0.5, np.inf) == pytest.approx(3.0 * np.pi)
    assert _turn_then_straight(3.0, 4.0, 0.0, 0.0, 0.5, np.inf) == pytest.approx(5.0)
    # A point straight behind: three quarters of a circle and a bit.
    behind = _turn_then_straight(-10.0, 0.0, 3.0, 3.0, 0.5, np.inf)
    assert np.pi * 3.0 + 10.0 < behind < 1.5 * np.pi * 3.0 + 10.0
    # Inside the left circle, so the way leads round by the right.
    assert _turn_then_straight(0.0, 3.0, 3.0, 3.0, 0.5, np.inf) > 2 * np.pi * 3.0


AUTOMATON = MovementAutomaton.plane()
REACH_SET = build_reach_set(AUTOMATON, AvoidanceGrid.uniform(), method="primitives")


def goal_at(target, final=True, following=None, radius=1.0):
    target = np.array(target, dtype=float)
    following = target if following is None else np.array(following, dtype=float)
    return Goal(target, following, radius, final)


def test_arrival_marks_paths_through_the_goal():
    arrived = arrival(REACH_SET, goal_at([5.0, 0, 0]))
    ends = REACH_SET.states[arrived.first, :3]
    assert len(ends)
    assert np.all(np.linalg.norm(ends - [5.0, 0, 0], axis=1) <= 1.0 + 1.0)
    straight = [n for n in REACH_SET.trajectories if set(REACH_SET.movements_to(n)) == {"Straight"}]
    assert arrived.reached[straight].all()
    assert arrived.first.sum() <= arrived.reached.sum()


def test_the_next_goal_counts_once_the_first_is_passed():
    goal = goal_at([5.0, 0, 0], final=False, following=[20.0, 15.0, 0])
    arrived = arrival(REACH_SET, goal)
    every = np.arange(REACH_SET.nodes)
    to_go = turning_distance_to_go(REACH_SET, every, goal, arrived, AUTOMATON)
    assert np.all(to_go[~arrived.reached] >= np.hypot(15.0, 15.0))
    leaf = REACH_SET.trajectories
    best = leaf[np.argmin((REACH_SET.length_m + to_go)[leaf])]
    assert arrived.reached[best]
    straight_on = np.hypot(20.0 - REACH_SET.states[best, 0], 15.0 - REACH_SET.states[best, 1])
    assert straight_on - 1e-9 <= to_go[best] <= straight_on + 3.0


def test_default_stage_cost_is_length_with_small_prices():
    free = PreparedReachSet.of(
        REACH_SET, Prices(turn=0, change=0, vertical=0).suit_vehicle(can_stop=False)
    )
    np.testing.assert_allclose(free.path_cost_m, REACH_SET.length_m)
    priced = PreparedReachSet.of(REACH_SET, Prices().suit_vehicle(can_stop=False))
    assert np.all(priced.path_cost_m >= free.path_cost_m - 1e-12)
    straight = [n for n in REACH_SET.trajectories if set(REACH_SET.movements_to(n)) == {"Straight"}]
    np.testing.assert_allclose(priced.path_cost_m[straight], REACH_SET.length_m[straight])


def test_a_user_can_replace_the_stage_cost():
    hops = PreparedReachSet.of(
        REACH_SET,
        Prices().suit_vehicle(can_stop=False),
        lambda reach_set, _: np.ones(reach_set.nodes),
    )
    np.testing.assert_array_equal(hops.path_cost_m, REACH_SET.depth)


def test_a_pursuer_is_run_away_from():
    """Nothing for leading straight away, twice the length for straight towards, nothing without."""
    reach_set = build_reach_set(MovementAutomaton.plane(), AvoidanceGrid.uniform())
    straight = int(np.argmin(np.abs(reach_set.states[:, 1:3]).sum(axis=1) - reach_set.states[:, 0]))
    nodes = np.array([straight])
    for place, share in (([-50.0, 0.0, 0.0], 0.0), ([50.0, 0.0, 0.0], 2.0)):
        for manoeuvre in (0.0, 0.1):
            moving = nothing_moving()._replace(
                position_m=np.array([place]), manoeuvre_mps2=np.array([manoeuvre])
            )
            wanted = share * reach_set.length_m[straight] if manoeuvre else 0.0
            assert closing_m(reach_set, nodes, moving)[0] == pytest.approx(wanted, abs=1e-6)


def test_the_price_of_closing_turns_the_vehicle_away():
    """From a slower one that turned, ahead and to one side; with no price it is passed near by."""
    seen = Intruder([9.0, 1.0, 0.0], [-0.5, 0.0, 0.0], radius_m=0.6, manoeuvre_mps2=0.05)
    told = Situation(State(np.zeros(3)), np.array([60.0, 0.0, 0.0]), intruders=[seen])
    apart = [
        np.linalg.norm(decide(planner(prices=Prices(closing=p)), told).path_m[-1] - seen.position_m)
        for p in (0.0, 3.0)
    ]
    assert apart[1] > apart[0] + 1.0


ROTOR = Planner.of(
    ReachLibrary.build(MovementAutomaton.inertialess(), AvoidanceGrid.uniform()),
    AvoidanceSettings(escape="off"),
)


def test_what_turns_on_the_spot_flies_level_legs_level():
    """In empty air: at its height, of sixty legs two at most with one step up or down; and in
    little more time than turning on the spot and flying straight takes."""
    rng, off_m = np.random.default_rng(3), []
    for _ in range(60):
        (bearing, yaw), away = rng.uniform(-np.pi, np.pi, 2), rng.uniform(12.0, 40.0)
        start = np.array([*rng.uniform(-20.0, 20.0, 2), 50.0])
        state = State(start, np.array([0.0, 0.0, yaw]))
        target = start + away * np.array([np.cos(bearing), np.sin(bearing), 0.0])
        track = [start]
        while np.linalg.norm(track[-1] - target) > 1.5 and len(track) < 80:
            decision = decide(ROTOR, Situation(state, target, reach_radius_m=1.5))
            vector = ROTOR.automaton.rollout(state.vector, decision.movements[:1]).states[-1]
            state = State(vector[:3], vector[3:])
            track.append(state.position_m)
        turned_rad = abs((bearing - yaw + np.pi) % (2.0 * np.pi) - np.pi)
        least_s = turned_rad * ROTOR.automaton.spot_turn_m_per_rad + away - 1.5
        assert len(track) - 1 <= 1.1 * least_s + 2.0
        off_m.append(np.abs(np.array(track)[:, 2] - 50.0).max())
    assert max(off_m) <= 0.5 + 1e-9
    assert np.count_nonzero(np.array(off_m) > 0.2) <= 2


@pytest.mark.parametrize("elevation_deg", [(-7.0, 52.0), (-52.0, 7.0), (-20.0, 5.0)])
def test_a_plane_whose_field_is_lopsided_does_not_dive(elevation_deg):
    """In empty air it arrives by hardly more than an arc and a straight way, near its height."""
    grid = AvoidanceGrid.uniform(elevation_deg=elevation_deg)
    library = ReachLibrary.build(AUTOMATON, grid)
    used = Planner.of(library, AvoidanceSettings(escape="off"))
    rng, radius = np.random.default_rng(5), AUTOMATON.turning_radius_m
    for _ in range(8):
        bearing, yaw = rng.uniform(-np.pi, np.pi, 2)
        away = rng.uniform(4.0, 10.0) * radius
        state = State(np.array([0.3, 0.7, 50.0]), np.array([0.0, 0.0, yaw]))
        target = state.position_m + away * np.array([np.cos(bearing), np.sin(bearing), 0.0])
        ahead, left = away * np.cos(bearing - yaw), away * np.sin(bearing - yaw)
        shortest_m = _turn_then_straight(ahead, left, radius, radius, 1.5, np.inf)
        track = [state.position_m]
        while np.linalg.norm(track[-1] - target) > 1.5 and len(track) < 2.0 * shortest_m:
            decision = decide(used, Situation(state, target, reach_radius_m=1.5))
            states = AUTOMATON.rollout(state.vector, decision.movements[:1]).states
            state = State(states[-1, :3], states[-1, 3:])
            track.append(state.position_m)
        assert len(track) - 1 <= 1.1 * shortest_m
        assert np.abs(np.array(track)[:, 2] - 50.0).max() <= radius
