"""The full reach set, counted exactly and estimated without bias (SPEC 4)."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.grid import AvoidanceGrid
from clearway.movements import MovementAutomaton
from clearway.reach.coverage import measure
from clearway.reach.footprints import FootprintTree, count_full, estimate_footprints
from clearway.reach.sets import build_reach_set

NINE = MovementAutomaton.plane(pitch_limit_deg=None)
FIVE = MovementAutomaton.plane(pitch_limit_deg=None, diagonals=False)


def tree(automaton, layers):
    return FootprintTree(automaton, AvoidanceGrid.uniform(float(layers), layers))


def test_five_movements_and_ten_layers():
    full = count_full(tree(FIVE, 10))
    assert full.nodes == 11_041_942
    assert full.trajectories == 8_682_343
    assert full.footprints == 45_039
    assert np.count_nonzero(full.cells) == 238


@pytest.mark.parametrize(("layers", "footprints"), [(4, 225), (5, 961), (6, 3227), (7, 10373)])
def test_nine_movements(layers, footprints):
    assert count_full(tree(NINE, layers)).footprints == footprints


def test_counting_agrees_with_building():
    grid = AvoidanceGrid.uniform((0.5, 5.0), 5, 50.0, 6, (-20.0, 35.0), 4)
    for automaton in (FIVE, MovementAutomaton.plane(1.3, pitch_limit_deg=20.0, diagonals=False)):
        full = count_full(FootprintTree(automaton, grid))
        built = measure(build_reach_set(automaton, grid, "full", side_exits=0))
        assert full.trajectories == built.trajectories
        assert full.footprints == built.footprints
        assert np.count_nonzero(full.cells) == built.cells_covered


@pytest.mark.parametrize(("automaton", "layers", "footprints"), [(NINE, 6, 3227), (FIVE, 8, None)])
def test_estimate_is_unbiased_within_its_error(automaton, layers, footprints):
    truth = footprints or count_full(tree(automaton, layers)).footprints
    estimate = estimate_footprints(tree(automaton, layers), branches=12, repetitions=150, seed=3)
    assert estimate.thinned == 0
    assert 0.0 < estimate.standard_error < 0.05 * truth
    assert abs(estimate.footprints - truth) < 3.5 * estimate.standard_error


def test_following_every_branch_counts_exactly():
    estimate = estimate_footprints(tree(NINE, 5), branches=10_000, repetitions=2)
    assert estimate.footprints == 961.0
    assert estimate.standard_error == 0.0


def test_same_seed_same_estimate():
    first = estimate_footprints(tree(NINE, 6), branches=5, repetitions=3, seed=8)
    again = estimate_footprints(tree(NINE, 6), branches=5, repetitions=3, seed=8)
    assert first == again
    assert first != estimate_footprints(tree(NINE, 6), branches=5, repetitions=3, seed=9)
