"""Which candidate passes, and what it stands on.

Candidates are looked at in tiers, the best first: those rated above the threshold, those that only
verification is for, those that break a rule, and at last all again without room to circle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.choose.candidates import Candidates
from clearway.avoidance.clear.hazards import MovingHazards, PointBins
from clearway.avoidance.clear.loiter import LoiterCircles
from clearway.avoidance.clear.verify import Paths, first_clear_of
from clearway.base.arrays import Bools, Floats, Floats2, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes

RATED = 0
VERIFIED = 1
AGAINST_RULES = 2
NO_LOITER = 3
"""Tiers, in the order in which verification looks at them."""


class NodeRatings(NamedTuple):
    """By what the cells on the way let candidates pass."""

    rating: Floats
    """[nodes] P_R (4.22)."""
    feasibility: Floats
    """[nodes] P_D (2.3)."""
    first_node: Ints
    """[nodes] of the first movement on the way to each node."""
    threshold: float

    def __repr__(self) -> str:
        return brief(self)


class Picked(NamedTuple):
    """The choice, and what verification found of those before it in the order of looking."""

    best: int
    """Which candidate; -1 where none keeps the margin."""
    tier: int
    """In which tier; -1 likewise."""
    below: int
    """Candidates that ratings ruled out."""
    tried: Ints
    """[tried] which candidates."""
    blocked_at: Ints
    """[tried] as of `verify.Verification`, these and the next three."""
    causes: Ints
    cause_index: Ints
    shortfall_m: Floats

    def __repr__(self) -> str:
        return brief(self)


@compiled
def in_order(candidates: Candidates, ratings: NodeRatings, keep_out: bool) -> tuple[Ints, Bools]:
    """[candidates] which come first, second, and so on, and whether ratings let these pass.

    The cheapest come first, but what breaks rules last. keep_out: of inflated cells too (def. 6).
    """
    order = np.argsort(candidates.cost_m, kind="mergesort")
    if np.any(candidates.broken):
        order = order[np.argsort(candidates.broken[order], kind="mergesort")]
    passes = np.empty(len(order), dtype=np.bool_)
    for at in range(len(order)):
        end = candidates.nodes[order[at]]
        # A plan whose first movement leaves nothing feasible, P_D = 0, is no plan (2.3).
        feasible = ratings.feasibility[ratings.first_node[end]] > 0.0
        clear = candidates.untouched[order[at]] or not keep_out
        passes[at] = ratings.rating[end] >= ratings.threshold and feasible and clear
    return order, passes


@compiled
def pick_candidate(
    paths: Paths,
    candidates: Candidates,
    ratings: NodeRatings,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    loiter: LoiterCircles,
    known: Floats2,
) -> Picked:
    """The first candidate that keeps the margin, tier by tier; known: as of `first_clear_of`."""
    order, passes = in_order(candidates, ratings, False)
    count = len(order)
    below = count - int(np.count_nonzero(passes))
    tried, blocked_at = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    causes, index = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    shortfall = np.empty(count)
    best, best_tier, told = -1, -1, 0
    for tier in range(NO_LOITER + 1):
        members = _members(tier, order, passes, candidates.broken)
        cost, price = np.zeros(len(members)), np.zeros(len(members))
        # Candidates that break rules are in the order of what they break, not of their cost.
        if tier < AGAINST_RULES:
            cost, price = candidates.cost_m[members], candidates.room_price_m[members]
        circles = loiter
        if tier == NO_LOITER:
            circles = LoiterCircles(
                loiter.needed, loiter.end_m, loiter.left, loiter.up, 0.0, loiter.stops, False
            )
            told = 0  # The last round looks at all candidates once more.
        ends = candidates.nodes[members]
        first, at, why, which, found = first_clear_of(
            paths, ends, bins, shapes, moving, margin, circles, cost, price, known
        )
        more = told + len(at)
        tried[told:more], blocked_at[told:more] = members[: len(at)], at
        causes[told:more], index[told:more], shortfall[told:more] = why, which, found
        told = more
        if first >= 0:
            best, best_tier = members[first], tier
            break
    return Picked(
        best,
        best_tier,
        below,
        tried[:told],
        blocked_at[:told],
        causes[:told],
        index[:told],
        shortfall[:told],
    )


@compiled
def _members(tier: int, order: Ints, passes: Bools, broken: Ints) -> Ints:
    """Which candidates a tier looks at, the best first."""
    members, count = np.empty(len(order), dtype=np.int64), 0
    for at in range(len(order)):
        obeys = broken[order[at]] == 0
        if tier == RATED:
            belongs = obeys and passes[at]
        elif tier == VERIFIED:
            belongs = obeys and not passes[at]
        else:
            belongs = tier == NO_LOITER or not obeys
        if belongs:
            members[count] = order[at]
            count += 1
    return members[:count]
