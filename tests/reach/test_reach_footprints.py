"""The full reach set, counted exactly and estimated without bias (SPEC 4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.reach.choose.coverage import measure_coverage
from clearway.reach.compare.estimate import estimate_footprints
from clearway.reach.compare.footprints import FootprintTree, count_full
from clearway.reach.compare.reachable import reachable_cells
from clearway.reach.sets import build_reach_set
from clearway.vehicle.automaton import MovementAutomaton

NINE = MovementAutomaton.plane(pitch_limit_deg=None)
FIVE = MovementAutomaton.plane(pitch_limit_deg=None, diagonals=False)


def tree(automaton, layers):
    return FootprintTree(automaton, AvoidanceGrid.uniform(float(layers), layers))


@pytest.mark.nightly
def test_five_movements_and_ten_layers():
    full = count_full(tree(FIVE, 10))
    assert full.nodes == 11_041_942
    assert full.trajectories == 8_682_343
    assert full.footprints == 45_039
    assert np.count_nonzero(full.cells) == 238


@pytest.mark.parametrize(("layers", "footprints"), [(4, 225), (5, 961), (6, 3227), (7, 10373)])
def test_nine_movements(layers, footprints):
    assert count_full(tree(NINE, layers)).footprints == footprints


def test_a_set_that_never_gets_to_the_last_layer_is_measured():
    turns_only = replace(NINE, movements=tuple(m for m in NINE.movements if m.name == "Left"))
    coverage = measure_coverage(build_reach_set(turns_only, AvoidanceGrid.uniform(), method="full"))
    assert (coverage.nodes, coverage.trajectories, coverage.footprints) == (0, 0, 0)
    assert coverage.side_exits > 0
    assert coverage.smoothness == 0.0


def test_counting_agrees_with_building():
    grid = AvoidanceGrid.uniform(
        (0.5, 5.0), 5, azimuth_deg=50.0, columns=6, elevation_deg=(-20.0, 35.0), rows=4
    )
    for automaton in (FIVE, MovementAutomaton.plane(1.3, pitch_limit_deg=20.0, diagonals=False)):
        full = count_full(FootprintTree(automaton, grid))
        built = measure_coverage(build_reach_set(automaton, grid, method="full", side_exits=0))
        assert full.trajectories == built.trajectories
        assert full.footprints == built.footprints
        assert np.count_nonzero(full.cells) == built.cells_covered


@pytest.mark.parametrize(("automaton", "layers", "footprints"), [(NINE, 6, 3227), (FIVE, 8, 5841)])
@pytest.mark.parametrize("seed", [3, 4])
def test_estimate_is_unbiased_within_its_error(automaton, layers, footprints, seed):
    estimate = estimate_footprints(tree(automaton, layers), branches=12, repetitions=150, seed=seed)
    assert estimate.walked == 0
    assert 0.0 < estimate.standard_error < 0.05 * footprints
    assert abs(estimate.footprints - footprints) < 3.5 * estimate.standard_error


@pytest.mark.nightly
@pytest.mark.parametrize(("automaton", "layers", "footprints"), [(NINE, 6, 3227), (FIVE, 8, 5841)])
@pytest.mark.parametrize("seed", [3, 5])
def test_so_it_is_where_footprints_are_followed_by_walks(automaton, layers, footprints, seed):
    """Also with so few walks that many cells are missed."""
    estimate = estimate_footprints(
        *(tree(automaton, layers), 12, 150, seed), held_states=100, walks=30
    )
    assert estimate.walked > 300
    assert 0.0 < estimate.standard_error < 0.1 * footprints
    assert abs(estimate.footprints - footprints) < 3.5 * estimate.standard_error


@pytest.mark.nightly
def test_walks_along_more_than_one_movement_a_cell():
    """Two movements a layer, so that walks stay in cells; inner range above 0."""
    slow = MovementAutomaton.plane(0.6, turn_step_deg=30.0, pitch_limit_deg=None, diagonals=False)
    grid = AvoidanceGrid.uniform(
        (0.4, 4.0), 4, azimuth_deg=50.0, columns=5, elevation_deg=30.0, rows=3
    )
    truth = count_full(FootprintTree(slow, grid)).footprints
    estimate = estimate_footprints(
        *(FootprintTree(slow, grid), 12, 100, 1), held_states=20, walks=60
    )
    assert estimate.walked > 100
    assert 0.0 < estimate.standard_error < 0.1 * truth
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


@pytest.mark.parametrize(
    ("automaton", "layers", "cells"),
    [(NINE, 10, 278), pytest.param(NINE, 15, 453, marks=pytest.mark.nightly)],
)
def test_cells_that_can_be_reached_are_known_for_certain(automaton, layers, cells):
    """SPEC 4; found without any reach set."""
    found = reachable_cells(automaton, AvoidanceGrid.uniform(float(layers), layers))
    assert found.proven
    assert found.number == cells


def test_reachable_cells_are_those_counted():
    for automaton, layers in ((NINE, 6), (FIVE, 8)):
        grid = AvoidanceGrid.uniform(float(layers), layers)
        found = reachable_cells(automaton, grid)
        assert found.proven
        assert np.array_equal(found.reached, count_full(tree(automaton, layers)).cells)


def test_what_is_not_followed_is_not_claimed():
    grid = AvoidanceGrid.uniform(8.0, 8)
    every = reachable_cells(FIVE, grid)
    some = reachable_cells(FIVE, grid, held_states=300)
    assert every.proven
    assert not some.proven
    assert not np.any(some.reached & ~every.reached)
