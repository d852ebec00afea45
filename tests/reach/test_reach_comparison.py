"""Dispersion, the bound (6.5) and the rows of table 6.1 as measured."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.reach.choose.coverage import (
    footprint,
    footprint_labels,
    leading_to,
    measure_coverage,
    smoothness,
)
from clearway.reach.compare.comparison import TABLE_6_1, compare_methods, compute_bound_6_5
from clearway.reach.compare.dispersal import measure_dispersion, sample_reachable
from clearway.reach.sets import build_reach_set
from clearway.vehicle.automaton import MovementAutomaton

FREE = MovementAutomaton.plane(pitch_limit_deg=None)
FIVE = MovementAutomaton.plane(pitch_limit_deg=None, diagonals=False)
SMALL = AvoidanceGrid.uniform(5.0, 5)


def test_the_full_set_leaves_nothing_out():
    full = build_reach_set(FREE, SMALL, method="full")
    sample = sample_reachable(FREE, SMALL, trajectories=500)
    # arccos of one minus a rounding error is some 1e-8.
    assert measure_dispersion(full, sample).largest_m < 1e-6


def test_dispersion_falls_with_nodes_and_is_what_brute_force_finds():
    sample = sample_reachable(FREE, SMALL, trajectories=300, seed=4)
    few = build_reach_set(FREE, SMALL, method="dispersion", spread=2)
    more = build_reach_set(FREE, SMALL, method="dispersion", spread=12)
    assert measure_dispersion(more, sample).mean_m < measure_dispersion(few, sample).mean_m
    pitch, yaw = few.states[:, 4], few.states[:, 5]
    level = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
    position = np.vstack([np.zeros(3), few.states[:, :3]])
    heading = np.vstack([[1.0, 0.0, 0.0], np.stack(level, axis=1)])
    apart = np.linalg.norm(sample.position_m[:, None] - position, axis=2)
    turned = np.arccos(np.clip(sample.heading @ heading.T, -1.0, 1.0))
    nearest = (apart + FREE.turning_radius_m * turned).min(axis=1)
    found = measure_dispersion(few, sample)
    assert found.largest_m == pytest.approx(nearest.max())
    assert found.mean_m == pytest.approx(nearest.mean())
    assert found.states == len(nearest)


def test_samples_follow_their_seed():
    first = sample_reachable(FREE, SMALL, trajectories=50, seed=1)
    again = sample_reachable(FREE, SMALL, trajectories=50, seed=1)
    other = sample_reachable(FREE, SMALL, trajectories=50, seed=2)
    assert np.array_equal(first.position_m, again.position_m)
    assert first.position_m.shape != other.position_m.shape or not np.array_equal(
        first.position_m, other.position_m
    )


def test_footprints_collapse_repeats():
    slow = MovementAutomaton.plane(speed_mps=0.5, pitch_limit_deg=None)
    tree = build_reach_set(slow, AvoidanceGrid.uniform(2.0, 2), method="full")
    leaves = tree.trajectories[:200]
    for leaf in leaves:
        cells = footprint(tree, int(leaf))
        assert all(a != b for a, b in itertools.pairwise(cells))
        ends = [int(tree.end_cell[node]) for node in tree.path(leaf) if tree.end_cell[node] >= 0]
        assert cells == tuple(cell for cell, _ in itertools.groupby(ends))
    labels = footprint_labels(tree, leaves)
    prints = [footprint(tree, int(leaf)) for leaf in leaves]
    assert (
        len(set(labels.tolist())) == len(set(prints)) == len(set(zip(labels, prints, strict=True)))
    )


def test_footprints_of_finer_samples_tell_more_trajectories_apart():
    tree = build_reach_set(FREE, SMALL, method="chaotic", spread=6, side_exits=0)
    found = measure_coverage(tree)
    assert found.footprints < found.footprints_of_samples <= found.trajectories
    for leaf in tree.trajectories[::40]:
        samples = tree.samples_m[tree.path(leaf)].reshape(-1, 3)
        cells = [int(cell) for cell in SMALL.cell_of(samples) if cell >= 0]
        assert footprint(tree, int(leaf), "samples") == tuple(
            c for c, _ in itertools.groupby(cells)
        )


def test_smoothness_counts_straight_movements():
    tree = build_reach_set(FREE, SMALL, method="full")
    shares = smoothness(tree, tree.trajectories)
    for leaf, share in list(zip(tree.trajectories, shares, strict=True))[:300]:
        way = tree.movements_to(int(leaf))
        assert share == pytest.approx(way.count("Straight") / len(way))


def test_side_exits_are_counted_apart():
    with_exits = measure_coverage(build_reach_set(FREE, SMALL, method="chaotic", spread=4))
    without = measure_coverage(
        build_reach_set(FREE, SMALL, method="chaotic", spread=4, side_exits=0)
    )
    assert with_exits.side_exits > 0
    assert without.side_exits == 0
    assert without.nodes == without.nodes_with_side_exits == with_exits.nodes
    assert without.footprints == with_exits.footprints


def test_leading_to_is_the_closure_of_parents():
    tree = build_reach_set(FREE, SMALL, method="harmonic", harmonic=2)
    leaf = int(tree.trajectories[-1])
    assert np.flatnonzero(leading_to(tree, np.array([leaf]))).tolist() == tree.path(leaf)


def test_comparison_on_a_small_grid():
    result = compare_methods(FIVE, SMALL)
    assert result.full.counted
    assert result.full.standard_error == 0.0
    built = measure_coverage(build_reach_set(FIVE, SMALL, method="full", side_exits=0))
    assert result.full.number == built.footprints
    assert result.reachable.number == built.cells_covered
    assert [row.contender for row in result.rows] == list(TABLE_6_1)
    for row in result.rows:
        assert row.reach_set.nodes <= row.bound
        ratio, error = row.ratio(result.full)
        assert 0.0 < ratio <= 1.0
        assert error == 0.0


def test_bound_of_the_paper_s_grid():
    """(6.6): 9 x k x 525."""
    assert compute_bound_6_5(9, 9, AvoidanceGrid.uniform(15.0, 15)) == 9 * 10 * 525
