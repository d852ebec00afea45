"""Fusion: the table of ratings, products along paths, feasibility."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.rate.fusion import RATINGS, Evidence, assess_cells, rating_named
from clearway.avoidance.rate.reach_rating import rate_reach_set
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.reach import build_reach_set
from clearway.vehicle.automaton import MovementAutomaton

ONE_CELL = AvoidanceGrid.uniform(1.0, 1, columns=1, rows=1)


def evidence_of(detected=0.0, visibility=1.0, map_base=0.0, intruder=0.0):
    return replace(
        Evidence.free(ONE_CELL),
        detected=np.array([detected]),
        visibility=np.array([visibility]),
        map_base=np.array([map_base]),
        intruder=np.array([intruder]),
    )


CASES = {
    "dual detection": (evidence_of(1.0, 1.0, 1.0), 0, 0, 0, (0, 0, 0)),
    "mapped, fully hidden": (evidence_of(0.0, 0.0, 1.0), 1, 0, 0, (0, 0, 0)),
    "false positive of the map": (evidence_of(0.0, 1.0, 1.0), 1, 1, 1, (1, 1, 1)),
    "overshadowed, 60 % hidden": (evidence_of(0.0, 0.4, 1.0), 0.76, 0.16, 0.4, (0.4, 0.4, 0.4)),
    "hidden, unmapped": (evidence_of(0.0, 0.0, 0.0), 1, 0, 1, (1, 0.5, 0)),
    "intruder in a hidden cell": (evidence_of(0.0, 0.0, 0.0, 1.0), 1, 0, 0, (0, 0, 0)),
}


@pytest.mark.parametrize("case", CASES)
def test_ratings_of_the_typical_cases(case):
    evidence, printed, visible, only, totals = CASES[case]
    for name, wanted in (("printed", printed), ("visible", visible), ("evidence", only)):
        assert assess_cells(evidence, RATINGS[name]).rating[0] == pytest.approx(wanted), name
    for unknown, wanted in zip((0.0, 0.5, 1.0), totals, strict=True):
        assert assess_cells(evidence, RATINGS["total"], unknown).rating[0] == pytest.approx(wanted)


def test_obstacle_probability_combines_all_sources():
    cells = assess_cells(evidence_of(0.2, 0.5, 0.4, 0.1))
    assert cells.map[0] == pytest.approx(0.2)
    assert cells.obstacle[0] == pytest.approx(1 - 0.9 * 0.8 * 0.8)


probability = st.floats(0.0, 1.0)


@given(probability, probability, probability, probability, probability)
def test_ratings_are_probabilities(share, visibility, base, intruder, unknown):
    evidence = evidence_of(share * visibility, visibility, base, intruder)
    for rating in RATINGS.values():
        assert -1e-12 <= assess_cells(evidence, rating, unknown).rating[0] <= 1.0 + 1e-12


def test_columns_without_beams_are_blocked_unless_told_otherwise():
    unseen = replace(evidence_of(visibility=0.0), seen=np.array([False]))
    for rating in RATINGS.values():
        assert assess_cells(unseen, rating).rating[0] == 0.0
    assert assess_cells(unseen, unknown_unseen=0.0).rating[0] == 1.0


def test_an_unknown_rating_names_the_valid_ones():
    with pytest.raises(ClearwayError, match="total, printed, visible, evidence"):
        rating_named("best")


@pytest.fixture(scope="module")
def reach_set():
    grid = AvoidanceGrid.uniform(6.0, 6)
    return build_reach_set(MovementAutomaton.plane(), grid, method="primitives")


def cells_of_path(reach_set, node):
    return [
        cell
        for n in reach_set.path(node)
        for cell in reach_set.cell_index[reach_set.cell_start[n] : reach_set.cell_start[n + 1]]
    ]


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000), threshold=st.floats(0.01, 0.9))
def test_rating_is_the_product_of_cells_each_counted_once(reach_set, seed, threshold):
    rng = np.random.default_rng(seed)
    rating = rng.choice([0.0, 0.5, 0.9, 1.0], reach_set.grid.cells, p=[0.05, 0.1, 0.25, 0.6])
    result = rate_reach_set(reach_set, rating, threshold)
    best = np.zeros(reach_set.grid.cells)
    count = np.zeros(reach_set.grid.cells, dtype=int)
    for leaf in reach_set.trajectories:
        cells = cells_of_path(reach_set, leaf)
        assert len(set(cells)) == len(cells)
        running = np.cumprod(rating[cells])
        assert result.node_rating[leaf] == pytest.approx(running[-1] if cells else 1.0)
        best[cells] = np.maximum(best[cells], running)
        count[cells] += running >= threshold
    np.testing.assert_allclose(result.reachability, best)
    np.testing.assert_array_equal(result.trajectories, count)


def test_feasibility_is_the_best_continuation(reach_set):
    rating = np.random.default_rng(3).uniform(0.3, 1.0, reach_set.grid.cells)
    result = rate_reach_set(reach_set, rating, 0.2)
    for node in range(0, reach_set.nodes, 7):
        below = [leaf for leaf in reach_set.trajectories if node in reach_set.path(leaf)]
        products = [result.node_rating[leaf] / result.node_rating[node] for leaf in below]
        assert result.feasibility[node] == pytest.approx(max(products))
        share = np.mean(np.array(products) >= 0.2)
        assert result.continuations[node] == pytest.approx(share)


def test_no_trajectory_is_kept_apart_from_blocked(reach_set):
    blocked = rate_reach_set(reach_set, np.zeros(reach_set.grid.cells))
    assert not blocked.reachability.any()
    assert blocked.passed.any()
    assert not blocked.passed.all()
