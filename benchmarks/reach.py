"""Speed of reach sets: rated, held against points, built and loaded."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.references import node_ratings, tree_clearance
from benchmarks.scenes import scattered
from benchmarks.sensors import GRID
from benchmarks.table import Benchmark, Row
from benchmarks.timing import timed
from clearway.avoidance.clear.hazards import Hazards, PointHazards
from clearway.avoidance.clear.verify import clearances, paths_of
from clearway.avoidance.rate.reach_rating import rate_reach_set
from clearway.reach import ReachLibrary, build_reach_set
from clearway.reach.escapes.legs import legs_from_level
from clearway.reach.escapes.store import load_or_search, search_escapes
from clearway.vehicle.automaton import MovementAutomaton

AUTOMATON = MovementAutomaton.plane()


def rating(quick: bool) -> Row:
    """The chaotic set is the one with most nodes; six kept in each cell make at least 2,200."""
    tree = build_reach_set(AUTOMATON, GRID, method="chaotic", spread=6.0)
    assert tree.nodes >= 2_200
    cells = np.random.default_rng(0).uniform(0.0, 1.0, GRID.cells)
    expected = node_ratings(tree, cells)
    np.testing.assert_allclose(rate_reach_set(tree, cells).node_rating, expected, atol=1e-12)
    other = timed(lambda: node_ratings(tree, cells), quick)
    return timed(lambda: rate_reach_set(tree, cells), quick).row(
        f"a tree of {tree.nodes:,} nodes rated: nodes, cells, continuations",
        target_s=50e-6,
        reference=(other, "NumPy, which rates nodes alone"),
    )


def clearance(quick: bool) -> Row:
    tree = build_reach_set(AUTOMATON, GRID)
    points = PointHazards(scattered(1_000), np.full(1_000, 0.05))
    paths, cap = paths_of(tree), 1.0
    expected = tree_clearance(tree, points, cap)
    np.testing.assert_allclose(clearances(paths, Hazards(points), cap)[:, 0], expected, atol=1e-9)
    other = timed(lambda: tree_clearance(tree, points, cap), quick, warm_up=0)
    return timed(lambda: clearances(paths, Hazards(points), cap), quick).row(
        f"clearance of all {tree.nodes:,} nodes of the default tree from 1,000 points, up to 1 m",
        reference=(other, "NumPy over all pairs"),
    )


def built(quick: bool) -> Row:
    pitches = len(AUTOMATON.start_pitches_rad)
    return timed(lambda: ReachLibrary.build(AUTOMATON, GRID), quick, warm_up=1).row(
        f"default reach sets of all {pitches} start pitches built", target_s=5.0
    )


def loaded(quick: bool) -> Row:
    pitches = len(AUTOMATON.start_pitches_rad)
    with TemporaryDirectory() as folder:
        times = timed(
            lambda: ReachLibrary.load_or_build(AUTOMATON, GRID, folder=Path(folder)), quick
        )
    return times.row(f"default reach sets of all {pitches} start pitches loaded", target_s=20e-3)


def ways_searched(quick: bool) -> Row:
    _, legs = legs_from_level(AUTOMATON)
    return timed(lambda: search_escapes(AUTOMATON, legs), quick, warm_up=1).row("escapes searched")


def ways_loaded(quick: bool) -> Row:
    _, legs = legs_from_level(AUTOMATON)
    with TemporaryDirectory() as folder:
        load_or_search(AUTOMATON, legs, Path(folder))
        times = timed(lambda: load_or_search(AUTOMATON, legs, Path(folder)), quick)
    return times.row("escapes loaded", target_s=20e-3)


BENCHMARKS = (
    Benchmark("tree, rated", rating, headline=True),
    Benchmark("tree, clearance", clearance),
    Benchmark("reach sets, built", built, headline=True),
    Benchmark("reach sets, loaded", loaded, headline=True),
    Benchmark("escapes, searched", ways_searched),
    Benchmark("escapes, loaded", ways_loaded, headline=True),
)
