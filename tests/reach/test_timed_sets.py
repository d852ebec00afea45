"""Reach sets and escapes of a copter with inertia."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.reach.escapes.library import EscapeLibrary, names_of
from clearway.reach.sets import build_reach_set
from clearway.reach.store import ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton

COPTER = MovementAutomaton.multirotor(speed_mps=6.0, acceleration_mps2=4.0)
GRID = AvoidanceGrid.uniform(range_m=30.0)


@pytest.fixture(scope="module")
def library() -> ReachLibrary:
    return ReachLibrary.build(COPTER, GRID)


def test_there_is_one_set_for_every_class(library: ReachLibrary) -> None:
    assert COPTER.classes is not None
    assert len(library.reach_sets) == len(COPTER.classes.classes)


def test_nodes_end_where_the_movements_lead(library: ReachLibrary) -> None:
    classes = COPTER.classes
    assert classes is not None
    rng = np.random.default_rng(3)
    for at in rng.choice(len(library.reach_sets), 6, replace=False).tolist():
        reach_set = library.reach_sets[at]
        state = np.array([0.0, 0.0, 0.0, classes.label_of(at), 0.0, 0.0])
        for node in rng.choice(reach_set.nodes, 20, replace=False).tolist():
            end = COPTER.rollout(state, reach_set.movements_to(node)).states[-1]
            np.testing.assert_allclose(reach_set.states[node], end, atol=1e-9)


def test_layers_are_by_time_and_any_node_may_end_a_plan(library: ReachLibrary) -> None:
    lasts_s = COPTER.movements[0].duration_s
    for reach_set in library.reach_sets:
        np.testing.assert_allclose(reach_set.end_time_s, lasts_s * reach_set.depth)
        assert reach_set.complete.all()
        assert reach_set.depth.max() == 4


def test_speed_is_continuous_along_every_chain(library: ReachLibrary) -> None:
    """What one movement ends with, the next begins with: by position, to the second difference."""
    reach_set = library.reach_sets[-3]
    lasts_s = COPTER.movements[0].duration_s
    step_s = lasts_s / reach_set.samples_m.shape[1]
    for node in reach_set.trajectories[::50].tolist():
        path = np.concatenate([reach_set.samples_m[n] for n in reach_set.path(node)])
        velocity = np.diff(path, axis=0) / step_s
        change = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / step_s
        # Rates of climb change beside the level acceleration; chords of turns are a little short.
        assert change.max() <= 1.5 * 4.0 + 0.1


def test_a_set_leads_to_all_sides_from_rest_and_ahead_at_speed(library: ReachLibrary) -> None:
    classes = COPTER.classes
    assert classes is not None
    rest = library.reach_sets[classes.first].states
    assert {int(turn) for turn in np.sign(np.round(rest[:, 5], 6))} == {-1, 0, 1}
    assert np.abs(rest[:, 5]).max() > np.radians(90.0)
    fast = library.reach_sets[3 * int(np.argmax(classes.speed_mps[::3]))].states
    assert fast[:, 0].min() > 0.0


def test_sets_are_the_same_every_time(library: ReachLibrary) -> None:
    assert COPTER.classes is not None
    again = build_reach_set(COPTER, GRID)
    np.testing.assert_array_equal(
        again.samples_m, library.reach_sets[COPTER.classes.first].samples_m
    )


def test_every_class_can_brake_to_rest_and_hold() -> None:
    escapes, classes = EscapeLibrary.of(COPTER), COPTER.classes
    assert classes is not None
    number = {name: n for n, name in enumerate(classes.names)}
    for at, ways in enumerate(escapes.ways):
        assert len(ways.begins) >= 1
        for escape in range(len(ways.begins)):
            begins, loop = names_of(escapes, ways, escape)
            assert loop == ("Hold",)
            now = at
            for name in begins:
                then = int(classes.following[now, number[name]])
                assert then >= 0
                assert classes.speed_mps[then] <= classes.speed_mps[now]
                now = then
            assert now == classes.first


def test_the_first_escape_brakes_straight_in_the_least_space() -> None:
    """At a speed v and an acceleration a, v^2 / 2 a, and what whole movements add to it."""
    escapes, classes = EscapeLibrary.of(COPTER), COPTER.classes
    assert classes is not None
    lasts_s = COPTER.movements[0].duration_s
    for at in range(0, len(classes.classes), 3):
        speed = float(classes.speed_mps[at])
        begins, _ = names_of(escapes, escapes.ways[at], 0)
        state = np.array([0.0, 0.0, 0.0, classes.label_of(at), 0.0, 0.0])
        end = COPTER.rollout(state, begins).states[-1]
        least = speed**2 / (2.0 * 4.0)
        assert least - 1e-6 <= end[0] <= least + 0.5 * lasts_s * speed + 1e-6
        assert abs(end[1]) + abs(end[2]) < 1e-9


def test_chains_of_a_library_differ() -> None:
    escapes = EscapeLibrary.of(COPTER)
    ways = escapes.ways[-1]
    chains = [names_of(escapes, ways, n)[0] for n in range(len(ways.begins))]
    assert len(set(chains)) == len(chains) > 10
    assert any("Left" in name for chain in chains for name in chain)
    assert all(len(chain) >= len(chains[0]) for chain, _ in pairwise(chains))
