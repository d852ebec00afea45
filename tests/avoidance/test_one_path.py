"""The one path of a decision: order, tiers, and a user's own parts at their place."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.choose.candidates import Candidates, Commitment, Side, log_ratings
from clearway.avoidance.choose.tiers import NO_LOITER as LAST
from clearway.avoidance.choose.tiers import NodeRatings, in_order, pick_candidate
from clearway.avoidance.clear.hazards import Hazards, MovingHazards, PointHazards
from clearway.avoidance.clear.loiter import NO_LOITER, loiter_circles
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.costs import turning_distance_to_go
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.rate.fusion import Evidence
from clearway.avoidance.rate.goal import Goal, arrival
from clearway.base.errors import ClearwayError
from clearway.base.frames import world_from_body
from clearway.obstacles.obstacle import Obstacle, shapes_of
from clearway.reach.tree import ReachSet
from clearway.sensors import Scan, detect
from first_clear import RoomPrice, first_clear
from situations_for_tests import Draws, situation
from worlds_for_tests import GRID, LIBRARY, LIDAR, planner

PREPARED = PreparedReachSet.of(LIBRARY.reach_sets[0], planner().prices, turning_radius_m=3.8)

REACH_SET: ReachSet = PREPARED.reach_set
SEEDS = st.integers(0, 2**32 - 1)


def around(rng: np.random.Generator) -> Hazards:
    count = int(rng.integers(0, 60))
    return Hazards(
        PointHazards(rng.uniform([1, -6, -5], [11, 6, 5], (count, 3)), np.full(count, 0.1)),
        shapes_of([Obstacle.ball(rng.uniform([3, -5, -4], [9, 5, 4]), 0.7)]),
        MovingHazards(
            rng.uniform([4, -6, -2], [9, 6, 2], (1, 3)),
            rng.normal(size=(1, 3)),
            np.full(1, 0.5),
            np.full(1, 0.1),
            np.zeros(1),
            np.ones(1),
        ),
    )


def candidates(rng: np.random.Generator) -> Candidates:
    """All complete trajectories, many of them alike in what they cost and break."""
    nodes = REACH_SET.trajectories
    return Candidates(
        nodes,
        np.round(rng.uniform(10.0, 14.0, len(nodes)), 1),
        rng.integers(-1, 2, len(nodes)),
        rng.uniform(size=len(nodes)) < 0.7,
        np.full(len(nodes), float(rng.choice([0.0, 0.4]))),
        rng.integers(0, 3, len(nodes)) * int(rng.integers(0, 2)),
    )


def ratings(rng: np.random.Generator) -> NodeRatings:
    shares = rng.uniform(0.0, 1.0, (2, REACH_SET.nodes))
    feasible = shares[1] * (shares[1] > 0.2)
    return NodeRatings(shares[0], feasible, PREPARED.first_node, float(rng.uniform(0.0, 1.0)))


@given(SEEDS, st.booleans())
@settings(max_examples=40, deadline=None)
def test_the_order_is_by_what_is_broken_then_by_cost(seed: int, keep_out: bool) -> None:
    rng = np.random.default_rng(seed)
    some, by = candidates(rng), ratings(rng)
    order, passes = in_order(some, by, keep_out)
    np.testing.assert_array_equal(order, np.lexsort((some.cost_m, some.broken)))
    ends = some.nodes[order]
    expected = (by.rating[ends] >= by.threshold) & (by.feasibility[by.first_node[ends]] > 0.0)
    if keep_out:
        expected &= some.untouched[order]
    np.testing.assert_array_equal(passes, expected)


@given(SEEDS, st.floats(0.05, 3.0), st.booleans())
@settings(max_examples=60, deadline=None)
def test_the_pick_is_the_first_of_the_first_tier_that_has_one(
    seed: int, margin_m: float, circles: bool
) -> None:
    rng = np.random.default_rng(seed)
    some, by, hazards = candidates(rng), ratings(rng), around(rng)
    loiter = loiter_circles(REACH_SET, 3.8) if circles else NO_LOITER
    paths = PREPARED.paths
    unknown = np.full((REACH_SET.nodes, 3), np.nan)
    found = pick_candidate(
        paths,
        some,
        by,
        hazards.bins,
        hazards.shapes,
        hazards.moving,
        margin_m,
        loiter,
        unknown,
    )
    order, passes = in_order(some, by, False)
    obeys = some.broken[order] == 0
    tiers = (order[passes & obeys], order[~passes & obeys], order[~obeys], order)
    best, best_tier, tried, causes = -1, -1, list[int](), list[int]()
    for tier, members in enumerate(tiers):
        priced = RoomPrice(some.cost_m[members], some.room_price_m[members])
        looked = first_clear(
            paths,
            some.nodes[members],
            hazards,
            margin_m,
            NO_LOITER if tier == LAST else loiter,
            priced if tier < 2 else None,
        )
        if tier == LAST:
            tried, causes = [], []
        tried += members[: len(looked.causes)].tolist()
        causes += looked.causes.tolist()
        if looked.chosen >= 0:
            best, best_tier = int(members[looked.chosen]), tier
            break
    assert (found.best, found.tier) == (best, best_tier)
    assert (found.tried.tolist(), found.causes.tolist()) == (tried, causes)
    assert found.below == np.count_nonzero(~passes)


def own_total(evidence: Evidence, obstacle: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """The rating `total`, as a user may write it."""
    del obstacle
    seen_free = np.maximum(evidence.visibility - evidence.detected, 0.0)
    hidden_free = (1.0 - evidence.visibility) * (1.0 - evidence.map_base) * (1.0 - unknown)
    return (1.0 - evidence.intruder) * (seen_free + hidden_free)


def own_cost(*asked: object) -> np.ndarray:
    return turning_distance_to_go(*asked)  # type: ignore[arg-type]


WITHOUT_WAYS_OUT, WITH_WAYS_OUT = planner(escape="off"), planner()
SIDES = st.sampled_from(list(Side))


@given(SEEDS, SIDES)
@settings(max_examples=40, deadline=None)
def test_own_parts_that_say_the_same_decide_the_same(seed: int, side: Side) -> None:
    """A user's own rating and cost are called at their place, on the way of every decision."""
    before = Commitment(side, "Left" if seed % 2 else "")
    moment = situation(Draws(seed, 0.0), GRID, LIDAR)
    for one in (WITHOUT_WAYS_OUT, WITH_WAYS_OUT):
        expected = decide(one, moment, commitment=before)
        by_cost = replace(one, terminal_cost=own_cost)
        for own in (replace(one, rating=own_total), by_cost, replace(by_cost, rating=own_total)):
            decision = decide(own, moment, commitment=before)
            assert decision.movements == expected.movements
            choice, wanted = decision.choice, expected.choice
            for name in (
                "node",
                "basis",
                "cost_m",
                "margin_m",
                "side",
                "candidates",
                "below_threshold",
                "forced",
                "clearance_m",
                "limited_by",
                "rating",
                "feasibility",
                "continuations",
                "ruled_out",
                "ruled_out_by",
            ):
                assert getattr(choice, name) == getattr(wanted, name), name
            np.testing.assert_array_equal(decision.cells.rating, expected.cells.rating)
            np.testing.assert_array_equal(decision.reach.reachability, expected.reach.reachability)


@given(SEEDS, st.floats(0.1, 3.0))
@settings(max_examples=60, deadline=None)
def test_a_goal_beyond_all_paths_is_reached_by_none_whether_measured_or_not(
    seed: int, radius_m: float
) -> None:
    direction = np.random.default_rng(seed).normal(size=3)
    for away_m in np.linspace(0.5, 1.5, 11) * (PREPARED.reach_m + radius_m):
        target_m = direction * (away_m / np.linalg.norm(direction))
        goal = Goal(target_m, target_m, radius_m, final=True)
        one, other = arrival(REACH_SET, goal, PREPARED.reach_m), arrival(REACH_SET, goal)
        np.testing.assert_array_equal(one.reached, other.reached)
        np.testing.assert_array_equal(one.first, other.first)
        np.testing.assert_array_equal(one.miss_m, other.miss_m)


def test_costs_that_are_no_numbers_are_refused() -> None:
    pitch_rad, prepared = WITHOUT_WAYS_OUT.prepared_sets[0]
    spoilt = replace(prepared, path_cost_m=np.full(prepared.reach_set.nodes, np.nan))
    with pytest.raises(ClearwayError, match="cost no finite number"):
        decide(
            replace(WITHOUT_WAYS_OUT, prepared_sets=((pitch_rad, spoilt),)),
            situation(Draws(1, 0.0), GRID, LIDAR),
        )


def test_logarithms_of_ratings_are_those_of_numpy() -> None:
    ratings = np.concatenate([np.linspace(0.0, 1.0, 500), [1e-7, 1e-6, np.nan]])
    every_other = np.arange(0, len(ratings), 2)
    logs = log_ratings(ratings, every_other)
    np.testing.assert_array_max_ulp(logs, np.log(np.maximum(ratings, 1e-6))[every_other])


@given(SEEDS, st.integers(0, 200))
@settings(max_examples=40, deadline=None)
def test_a_scan_decides_as_what_it_says_of_the_cells(seed: int, returns: int) -> None:
    """Sorted into cells when the decision asks, or stated before."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, 5.0, (returns, 3))
    points[rng.uniform(size=returns) < 0.02] = np.nan
    turned = world_from_body(rng.uniform(-0.5, 0.5, 3)), rng.normal(0.0, 0.5, 3)
    told = detect(GRID, LIDAR, Scan(points, 5.0, sensor=LIDAR.name), grid_from_body=turned)
    moment = situation(Draws(seed, 0.0), GRID, LIDAR)
    placed, spelt_out = replace(moment, detections=[told]), replace(told, hits=told.hits)
    one, other = (
        decide(WITHOUT_WAYS_OUT, replace(placed, detections=[d])) for d in (told, spelt_out)
    )
    assert (one.choice.node, one.choice.cost_m) == (other.choice.node, other.choice.cost_m)
    assert one.choice.rating == other.choice.rating
    for name in ("detected", "visibility", "seen", "coated"):
        np.testing.assert_array_equal(
            getattr(one.cells.evidence, name), getattr(other.cells.evidence, name)
        )
    np.testing.assert_array_equal(one.cells.rating, other.cells.rating)


def test_what_is_told_otherwise_than_the_scan_says_counts() -> None:
    told = detect(GRID, LIDAR, Scan(np.array([[5.0, 0.0, 0.0]]), 5.0, sensor=LIDAR.name))
    changed = replace(told, probability=np.ones(GRID.cells))
    moment = replace(situation(Draws(3, 0.0), GRID, LIDAR), detections=[changed])
    np.testing.assert_array_equal(decide(WITHOUT_WAYS_OUT, moment).cells.evidence.detected, 1.0)


def test_a_rating_compiled_by_numba_decides_as_the_same_in_numpy() -> None:
    numba = pytest.importorskip("numba")

    @numba.njit
    def shares(visibility: np.ndarray, obstacle: np.ndarray) -> np.ndarray:
        rated = np.empty(len(obstacle))
        for cell in range(len(obstacle)):
            rated[cell] = visibility[cell] * (1.0 - obstacle[cell])
        return rated

    def compiled(evidence: Evidence, obstacle: np.ndarray, unknown: np.ndarray) -> np.ndarray:
        return shares(evidence.visibility, obstacle) * (1.0 - unknown)

    def plain(evidence: Evidence, obstacle: np.ndarray, unknown: np.ndarray) -> np.ndarray:
        return evidence.visibility * (1.0 - obstacle) * (1.0 - unknown)

    for seed in range(5):
        moment = situation(Draws(seed, 0.0), GRID, LIDAR)
        one, other = (
            decide(replace(WITHOUT_WAYS_OUT, rating=rating), moment) for rating in (compiled, plain)
        )
        assert (one.choice.node, one.choice.cost_m) == (other.choice.node, other.choice.cost_m)
        np.testing.assert_array_equal(one.cells.rating, other.cells.rating)
