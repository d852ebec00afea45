"""Trajectory equivalence (def. 9): what is the same way, and that reach sets hold each way once."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.reach.choose.equivalence import each_way_once, equivalent
from clearway.reach.choose.select import tree_of
from clearway.reach.expand.lattice import build_lattice
from clearway.reach.sets import METHODS, build_reach_set
from clearway.vehicle.automaton import Movement, MovementAutomaton

STEP = float(np.radians(15.0))
WHOLE = Movement("Straight", 1.0, smooth=True)
HALF = Movement("Half", 1.0, duration_s=0.5, smooth=True)
LEFT = Movement("Left", 1.0, yaw_rate_rps=STEP)
RIGHT = Movement("Right", 1.0, yaw_rate_rps=-STEP)
HALF_LEFT = Movement("Half-Left", 1.0, yaw_rate_rps=STEP, duration_s=0.5)
SLOW_LEFT = Movement("Slow-Left", 0.5, yaw_rate_rps=0.5 * STEP, duration_s=2.0)
MIXED = MovementAutomaton((WHOLE, HALF, LEFT, RIGHT, HALF_LEFT, SLOW_LEFT), None)
STATE = np.array([1.0, -2.0, 3.0, 0.0, 0.2, 0.7])


@pytest.mark.parametrize(
    ("first", "second", "same"),
    [
        ((WHOLE,), (HALF, HALF), True),
        ((LEFT, WHOLE), (HALF_LEFT, HALF_LEFT, HALF, HALF), True),
        ((LEFT,), (SLOW_LEFT,), True),  # Time does not matter.
        ((LEFT, RIGHT), (RIGHT, LEFT), False),
        ((WHOLE,), (HALF,), False),
        ((LEFT, WHOLE), (WHOLE, LEFT), False),
        ((), (), True),
    ],
)
def test_same_way(first, second, same):
    assert equivalent(MIXED, STATE, first, second) is same
    assert equivalent(MIXED, STATE, second, first) is same


def test_same_ends_are_not_the_same_way():
    # Left, right, right, left and its mirror image end in one state.
    there = MIXED.fly(STATE, [(m, 1.0) for m in (LEFT, RIGHT, RIGHT, LEFT)]).states[-1]
    back = MIXED.fly(STATE, [(m, 1.0) for m in (RIGHT, LEFT, LEFT, RIGHT)]).states[-1]
    assert np.linalg.norm(there[3:] - back[3:]) < 1e-9
    assert not equivalent(MIXED, STATE, (LEFT, RIGHT, RIGHT, LEFT), (RIGHT, LEFT, LEFT, RIGHT))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_scale_does_not_matter(scale):
    def scaled(movement):
        return Movement(
            movement.name,
            scale * movement.speed_mps,
            yaw_rate_rps=movement.yaw_rate_rps,
            duration_s=movement.duration_s,
        )

    automaton = MovementAutomaton(tuple(scaled(m) for m in MIXED.movements), None)
    whole, half, left, right, *_ = automaton.movements
    start = STATE * [scale, scale, scale, 1, 1, 1]
    assert equivalent(automaton, start, (whole, left), (half, half, left))
    assert not equivalent(automaton, start, (left, right), (right, left))


@pytest.mark.nightly
def test_a_full_set_holds_each_way_once_and_covers_the_same_cells():
    grid = AvoidanceGrid.uniform(3.0, 3, azimuth_deg=60.0, columns=5, elevation_deg=30.0, rows=3)
    automaton = MovementAutomaton((WHOLE, HALF, LEFT, RIGHT, HALF_LEFT), None)
    lattice = build_lattice(automaton, grid, (0.0,), 4)
    every = METHODS["full"]()(lattice, grid, 0.0, 4)
    once = each_way_once(every, lattice, 0.0)
    assert 0 < len(once) < len(every)
    chains = [tuple(automaton.movements[m - 1] for m in row if m) for row in once]
    for one, two in itertools.combinations(chains, 2):
        assert not equivalent(automaton, np.zeros(6), one, two)
    kept = {tuple(row) for row in once}
    for row in every:
        if tuple(row) not in kept:
            chain = tuple(automaton.movements[m - 1] for m in row if m)
            assert any(equivalent(automaton, np.zeros(6), chain, other) for other in chains)
    cells = [set(tree_of(rows, lattice, grid, 0.0).cell_index.tolist()) for rows in (every, once)]
    assert cells[0] == cells[1]
    built = build_reach_set(automaton, grid, method="full", depth=4)
    assert len(built.trajectories) == len(once)


def test_another_pace_stays_in_a_set():
    grid = AvoidanceGrid.uniform(3.0, 3, azimuth_deg=60.0, columns=5, elevation_deg=30.0, rows=3)
    slow = Movement("Slow", 0.5, duration_s=2.0, smooth=True)
    automaton = MovementAutomaton((WHOLE, slow), None)
    lattice = build_lattice(automaton, grid, (0.0,), 3)
    every = METHODS["full"]()(lattice, grid, 0.0, 3)
    assert len(each_way_once(every, lattice, 0.0)) == len(every) == 8


def test_default_sets_have_no_two_equivalent_trajectories():
    plane, grid = MovementAutomaton.plane(), AvoidanceGrid.uniform(5.0, 5)
    lattice = build_lattice(plane, grid, plane.start_pitches_rad, 5)
    rows = METHODS["flying"]()(lattice, grid, 0.0, 5)
    assert each_way_once(rows, lattice, 0.0) is rows
