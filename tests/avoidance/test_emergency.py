"""The emergency rule among crowds of hazards, against looking at every movement."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.choose.candidates import Candidates
from clearway.avoidance.choose.emergency import EMERGENCY_MARGINS, best_clearances, emergency
from clearway.avoidance.clear.hazards import Hazards, MovingHazards, PointHazards
from clearway.avoidance.clear.verify import KnownClearances, clearances, paths_of
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.obstacle import Obstacle, shapes_of
from clearway.reach import build_reach_set
from clearway.vehicle.automaton import MovementAutomaton
from first_clear import first_clear

GRID = AvoidanceGrid.uniform()
PATHS = paths_of(
    build_reach_set(MovementAutomaton.plane(), GRID, method="primitives", start_pitch_rad=0.0)
)
MARGIN_M = 0.6


def candidates_among(rng, share=0.4):
    """Ends anywhere in the reach set, few costs, so that much is alike."""
    nodes = np.flatnonzero(rng.uniform(size=len(PATHS.parent)) < share)
    nodes = nodes if len(nodes) else np.arange(3)
    many = len(nodes)
    cost = rng.integers(0, 4, many).astype(float)
    return Candidates(
        nodes,
        cost,
        np.zeros(many, dtype=np.int64),
        np.ones(many, dtype=bool),
        np.zeros(many),
        np.zeros(many, dtype=np.int64),
    )


def crowd(rng):
    """Points, shapes and intruders, as many as fill the grid or hardly any; some thrice."""
    points, shapes, moving = (int(rng.choice([0, 1, 10, most])) for most in (300, 100, 20))
    near = rng.uniform(0.2, 6.0)
    told = []
    for middle in rng.uniform([near, -6, -5], [11, 6, 5], (shapes, 3)):
        size = rng.uniform(0.02, 4.0, 3)
        told.append(Obstacle.cuboid(middle, tuple(size), orientation_rad=rng.normal(size=3)))
    return Hazards(
        PointHazards(rng.uniform([near, -6, -5], [11, 6, 5], (points, 3)), np.full(points, 0.1)),
        shapes_of([*told, *told[:5], *told[:5]]),
        MovingHazards(
            rng.uniform([4, -6, -2], [9, 6, 2], (moving, 3)),
            rng.normal(size=(moving, 3)),
            rng.uniform(0.1, 2.0, moving),
            rng.uniform(0.0, 0.2, moving),
            np.zeros(moving),
            np.ones(moving),
        ),
    )


def by_looking_at_all(candidates, hazards):
    """Best clearance in hundredths of the margin, then least lack, then least cost."""
    found = clearances(PATHS, hazards, MARGIN_M)[candidates.nodes]
    coarse = np.round(found[:, 0] / (0.01 * MARGIN_M))
    best = np.flatnonzero(coarse == coarse.max())
    least = best[found[best, 1] == found[best, 1].min()]
    return int(least[np.argmin(candidates.cost_m[least])]), found


@given(seed=st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_it_chooses_what_looking_at_every_movement_chooses(seed):
    rng = np.random.default_rng(seed)
    hazards, candidates = crowd(rng), candidates_among(rng, rng.choice([0.02, 0.4, 1.0]))
    expected, found = by_looking_at_all(candidates, hazards)
    looked = KnownClearances(PATHS)
    if rng.integers(2):  # Verification mostly came first, and left what it found.
        known = looked.at(hazards, MARGIN_M)
        first_clear(PATHS, candidates.nodes, hazards, MARGIN_M, known=known)
    best, margin_m = emergency(looked, candidates, hazards, MARGIN_M)
    assert best == expected
    kept = found[best, 0] / MARGIN_M
    assert margin_m == MARGIN_M * next((s for s in EMERGENCY_MARGINS if kept >= s), 0.0)
    told = best_clearances(looked, candidates, hazards, MARGIN_M)
    np.testing.assert_array_equal(told[best], found[best])
    assert np.all((told[:, 0] == found[:, 0]) | (told[:, 0] < found[best, 0]))


def test_what_it_does_not_look_at_is_not_taken_for_known():
    """Other candidates may need what these had no use for."""
    rng = np.random.default_rng(3)
    told = [Obstacle.ball(middle, 0.8) for middle in rng.uniform([1, -6, -5], [11, 6, 5], (200, 3))]
    hazards = Hazards(shapes=shapes_of(told))
    lacking = np.append(clearances(PATHS, hazards, MARGIN_M)[:, 1], 0.0)
    own = MARGIN_M - (lacking[:-1] - lacking[PATHS.parent])
    looked = KnownClearances(PATHS)
    unseen = []
    for share in (0.3, 1.0):
        candidates = candidates_among(rng, share)
        best, _ = emergency(looked, candidates, hazards, MARGIN_M)
        assert best == by_looking_at_all(candidates, hazards)[0]
        known = looked.at(hazards, MARGIN_M)[:, 0]
        seen = ~np.isnan(known)
        unseen.append(int(np.sum(~seen)))
        np.testing.assert_allclose(np.minimum(known[seen], MARGIN_M), own[seen], atol=1e-9)
    assert unseen[0] > 0, "it looked at everything, and the test shows nothing"
