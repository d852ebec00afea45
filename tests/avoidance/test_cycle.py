"""An ordinary decision, in one compiled call, is what its steps alone come to."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.candidates import Candidates, Commitment, Side, log_ratings
from clearway.avoidance.costs import curved_distance_to_go
from clearway.avoidance.cycle import assessed
from clearway.avoidance.decide import decide
from clearway.avoidance.evidence import Sources
from clearway.avoidance.fusion import Evidence, assess_cells, total
from clearway.avoidance.hazards import Hazards, MovingHazards, PointHazards
from clearway.avoidance.loiter import NO_LOITER, loiter_circles
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.reach_rating import PassedCells, rate_reach_set, untouched
from clearway.avoidance.tiers import NO_LOITER as LAST
from clearway.avoidance.tiers import NodeRatings, in_order, picked
from clearway.base.errors import ClearwayError
from clearway.base.frames import world_from_body
from clearway.obstacles.obstacle import Obstacle, shapes_of
from clearway.reach.tree import ReachSet
from clearway.sensors import Scan, coated_cells, detect
from first_clear import RoomPrice, first_clear
from situations_for_tests import Draws, situation
from worlds_for_tests import GRID, LIBRARY, LIDAR, planner

PREPARED = PreparedReachSet.of(
    LIBRARY.reach_sets[0], planner().settings.prices, turning_radius_m=3.8
)

REACH_SET: ReachSet = PREPARED.reach_set
SEEDS = st.integers(0, 2**32 - 1)


def sources(rng: np.random.Generator) -> Sources:
    """Every cell with its own share of everything; most without anything."""

    def shares() -> np.ndarray:
        return rng.uniform(0.0, 1.0, GRID.cells) * (rng.uniform(size=GRID.cells) < 0.3)

    detected, hidden = shares(), shares()
    marks = rng.uniform(size=(2, GRID.cells)) < 0.1
    return Sources(detected, 1.0 - hidden, ~marks[0], shares(), shares(), marks[1])


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


@given(SEEDS, st.sampled_from([0.0, 0.5, 1.0]), st.integers(0, 30))
@settings(max_examples=30, deadline=None)
def test_what_is_known_is_rated_as_step_by_step(seed: int, unknown: float, returns: int) -> None:
    rng = np.random.default_rng(seed)
    told, margin_m = sources(rng), float(rng.uniform(0.1, 1.5))
    points = PointHazards(
        rng.uniform([0, -6, -5], [11, 6, 5], (returns, 3)), rng.uniform(0.0, 0.3, returns)
    )
    passed = PassedCells.of(REACH_SET)
    found = assessed(told, points, margin_m, GRID.edges, unknown, 1.0, passed)
    coated = coated_cells(GRID, points.position_m, points.radius_m + margin_m)
    coated |= told.coated_by_map
    cells = assess_cells(told.evidence(GRID, coated), total, unknown, 1.0)
    reach = rate_reach_set(REACH_SET, cells.rating)
    alone = (
        cells.rating,
        reach.node_rating,
        reach.feasibility,
        untouched(REACH_SET, coated),
    )
    for name, one, other in zip(found._fields, found, alone, strict=True):
        np.testing.assert_array_equal(one, other, err_msg=name)


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
    found = picked(
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
    return total(evidence, obstacle, unknown)


def own_cost(*asked: object) -> np.ndarray:
    return curved_distance_to_go(*asked)  # type: ignore[arg-type]


IN_ONE, WITH_WAYS_OUT = planner(escape="off"), planner()
BY_OWN_RATING = replace(IN_ONE, rating=own_total)
BY_OWN_COST = replace(IN_ONE, terminal_cost=own_cost)
BY_BOTH = replace(BY_OWN_RATING, terminal_cost=own_cost)
SIDES = st.sampled_from(list(Side))


@given(SEEDS, SIDES)
@settings(max_examples=40, deadline=None)
def test_own_parts_that_say_the_same_decide_the_same(seed: int, side: Side) -> None:
    """Whatever is the user's own is asked step by step, by the same loops."""
    before = Commitment(side, "Left" if seed % 2 else "")
    moment = situation(Draws(seed, 0.0), GRID, LIDAR)
    for one in (IN_ONE, WITH_WAYS_OUT):
        expected = decide(one, moment, commitment=before)
        for own in (BY_OWN_RATING, BY_OWN_COST, BY_BOTH):
            with_own = replace(one, rating=own.rating, terminal_cost=own.terminal_cost)
            decision = decide(with_own, moment, commitment=before)
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


def test_a_goal_that_nothing_leads_to_is_not_measured_but_costs_the_same() -> None:
    """Just within and just beyond what paths reach, in one call and step by step."""
    moment = situation(Draws(7, 0.0), GRID, LIDAR)
    for away_m in np.linspace(8.0, 14.0, 13):
        nearby = replace(
            moment,
            target_m=moment.state.position_m + moment.state.world_from_body[:, 0] * away_m,
            next_m=None,
        )
        one, other = decide(IN_ONE, nearby).choice, decide(BY_OWN_COST, nearby).choice
        assert (one.node, one.cost_m) == (other.node, other.cost_m)


def test_costs_that_are_no_numbers_are_refused_in_one_call_too() -> None:
    pitch_rad, prepared = IN_ONE.prepared_sets[0]
    spoilt = replace(prepared, path_cost_m=np.full(prepared.reach_set.nodes, np.nan))
    with pytest.raises(ClearwayError, match="cost no finite number"):
        decide(
            replace(IN_ONE, prepared_sets=((pitch_rad, spoilt),)),
            situation(Draws(1, 0.0), GRID, LIDAR),
        )


def test_logarithms_of_ratings_are_those_of_numpy() -> None:
    ratings = np.concatenate([np.linspace(0.0, 1.0, 500), [1e-7, 1e-6, np.nan]])
    every_other = np.arange(0, len(ratings), 2)
    logs = log_ratings(ratings, every_other)
    np.testing.assert_array_max_ulp(logs, np.log(np.maximum(ratings, 1e-6))[every_other])


@given(SEEDS, st.integers(0, 200))
@settings(max_examples=40, deadline=None)
def test_a_scan_at_hand_decides_as_what_it_says_of_the_cells(seed: int, returns: int) -> None:
    """Sorted into cells within the one call, or before it."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, 5.0, (returns, 3))
    points[rng.uniform(size=returns) < 0.02] = np.nan
    turned = world_from_body(rng.uniform(-0.5, 0.5, 3)), rng.normal(0.0, 0.5, 3)
    told = detect(GRID, LIDAR, Scan(points, 5.0, sensor=LIDAR.name), grid_from_body=turned)
    moment = situation(Draws(seed, 0.0), GRID, LIDAR)
    placed, spelt_out = replace(moment, detections=[told]), replace(told, hits=told.hits)
    assert (told.scan_at_hand is None, spelt_out.scan_at_hand is None) == (False, True)
    one, other = (decide(IN_ONE, replace(placed, detections=[d])) for d in (told, spelt_out))
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
    np.testing.assert_array_equal(decide(IN_ONE, moment).cells.evidence.detected, 1.0)


def test_only_the_cost_to_go_that_is_given_is_made_part_of_one_call() -> None:
    prices = IN_ONE.settings.prices
    for cost, is_part in (
        (curved_distance_to_go, True),
        (partial(curved_distance_to_go), True),
        (partial(curved_distance_to_go, prices=prices), True),
        (partial(curved_distance_to_go, automaton=IN_ONE.automaton), False),
        (own_cost, False),
    ):
        able = replace(IN_ONE, terminal_cost=cost).turns_and_climbs
        assert (able is not None) is is_part
