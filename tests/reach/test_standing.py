"""Reach sets of what can stop: movements that stand, and ways that begin with them."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.plan.costs import Prices, length_and_prices, turning_distance_to_go
from clearway.avoidance.rate.goal import Goal, arrival
from clearway.base.grid import AvoidanceGrid
from clearway.reach.expand.lattice import movements_deep
from clearway.reach.sets import build_reach_set
from clearway.reach.store import ReachLibrary
from clearway.reach.tree import SIDE
from clearway.vehicle.automaton import Movement, MovementAutomaton

ROTOR = MovementAutomaton.inertialess()
GRID = AvoidanceGrid.uniform()


@pytest.fixture(scope="module")
def flying():
    return build_reach_set(ROTOR, GRID)


def standing(reach_set):
    return np.array(ROTOR.stands)[reach_set.movement]


def test_sets_of_other_methods_stay_small():
    grid = AvoidanceGrid.uniform(range_m=5.0, layers=5)
    for method in ("harmonic", "cover"):
        assert 0 < build_reach_set(ROTOR, grid, method=method).nodes < 1000, method


def test_every_movement_may_come_first(flying):
    assert {flying.movements_to(n)[0] for n in flying.trajectories} == set(ROTOR.names)
    assert flying.nodes < 3000


def test_what_stands_stays_in_place_and_takes_its_time(flying):
    stands = standing(flying)
    parent = flying.parent[stands]
    before = np.where((parent >= 0)[:, None], flying.states[parent, :3], 0.0)
    assert flying.states[stands, :3] == pytest.approx(before, abs=1e-12)
    assert np.all(flying.sagitta_m[stands] == 0.0)
    took = flying.end_time_s[stands] - np.where(parent >= 0, flying.end_time_s[parent], 0.0)
    assert took == pytest.approx(1.0)
    # It passes no cell that the way before it has not passed.
    passed = np.diff(flying.cell_start)[stands]
    assert np.all(passed[parent >= 0] == 0)
    assert np.all(passed[parent < 0] == 1)


def test_the_predicted_way_is_the_automatons(flying):
    for node in flying.trajectories[::5]:
        path = ROTOR.rollout(np.zeros(6), flying.movements_to(node), step_s=0.25)
        samples = np.concatenate(flying.samples_m[flying.path(node)])
        assert samples == pytest.approx(path.states[1:, :3], abs=1e-9)


def test_it_may_turn_round_on_the_spot_and_leave(flying):
    ways = {flying.movements_to(n) for n in np.flatnonzero(flying.exit_kind == SIDE)}
    for turn in ("Turn-Left", "Turn-Right"):
        for times in (2, 3, 4):
            assert (*([turn] * times), "Straight") in ways


def test_a_movement_that_changes_nothing_makes_no_tree_of_a_plane_grow():
    plane = MovementAutomaton.plane()
    hovering = MovementAutomaton((*plane.movements, Movement("Hold", 0.0)), plane.pitch_limit_rad)
    grid = AvoidanceGrid.uniform(range_m=4.0, layers=4, columns=3, rows=3)
    usual = build_reach_set(plane, grid, method="full")
    same = build_reach_set(hovering, grid, method="full", depth=movements_deep(plane, grid))
    assert np.array_equal(same.movement, usual.movement)
    assert np.array_equal(same.parent, usual.parent)


def test_time_costs_where_it_is_slow_and_standing_is_never_free(flying):
    cost = length_and_prices(flying, Prices(turn=0.0, change=0.0, vertical=0.0))
    assert cost == pytest.approx(1.0)
    plane = build_reach_set(MovementAutomaton.plane(), GRID, method="primitives")
    first = plane.parent < 0
    assert np.all(
        length_and_prices(plane, Prices(turn=0.0, vertical=0.15))[first & (plane.movement == 0)]
        == 1.0
    )


def test_cost_to_go_of_a_goal_behind_is_a_turn_on_the_spot(flying):
    node = next(n for n in range(flying.nodes) if flying.movements_to(n) == ("Turn-Left",) * 2)
    hold = next(n for n in range(flying.nodes) if flying.movements_to(n) == ("Hold",))
    behind = np.array([-10.0, 1e-9, 0.0])
    goal = Goal(behind, behind, 1.0, final=True)
    nodes = np.array([hold, node])
    to_go = turning_distance_to_go(flying, nodes, goal, arrival(flying, goal), ROTOR)
    # Half a turn takes four seconds, in which four metres could be flown; half of it is done, and
    # the rest is shorter on the way.
    assert to_go[0] == pytest.approx(14.0, abs=1e-6)
    assert 10.0 < to_go[1] < 12.0


def test_what_only_turns_on_the_spot_has_a_finite_cost_to_go():
    names = ("Straight", "Turn-Left", "Turn-Right", "Hold")
    stiff = MovementAutomaton(ROTOR.chain(names), 0.0, vehicle=ROTOR.vehicle)
    assert stiff.turning_radius_m == np.inf
    reach_set = build_reach_set(stiff, GRID)
    goal = Goal(np.array([0.0, 20.0, 0.0]), np.array([0.0, 20.0, 0.0]), 1.0, final=True)
    nodes = reach_set.trajectories
    to_go = turning_distance_to_go(reach_set, nodes, goal, arrival(reach_set, goal), stiff)
    assert np.all(np.isfinite(to_go))


def test_a_way_along_a_border_of_cells_is_traced_in_no_time_and_right():
    """Up is as steep as the grid's own border: half its cells are the topmost row's."""
    for steepest in (29.9, 30.0, 30.1):
        automaton = MovementAutomaton.inertialess(steepest_deg=steepest)
        built = build_reach_set(automaton, GRID, method="primitives")
        ups = [n for n in range(built.nodes) if set(built.movements_to(n)) == {"Up"}]
        rows = {int(c) % GRID.rows for n in ups for c in built.cell_index[slice(*_cells(built, n))]}
        assert rows <= {GRID.rows - 1}


def _cells(reach_set, node):
    return reach_set.cell_start[node], reach_set.cell_start[node + 1]


def test_it_is_stored_and_loaded_the_same(tmp_path):
    built = ReachLibrary.load_or_build(ROTOR, GRID, folder=tmp_path)
    assert len(built.reach_sets) == 1
    assert list(tmp_path.glob("reach-*.bin"))
    loaded = ReachLibrary.load_or_build(ROTOR, GRID, folder=tmp_path, notice=pytest.fail)
    for name in ("parent", "movement", "states", "cell_index"):
        assert np.array_equal(
            getattr(loaded.reach_sets[0], name), getattr(built.reach_sets[0], name)
        )
