"""The decision: which trajectory to fly.

Candidates are complete trajectories only. The cheapest that is rated above the threshold and keeps
the margin wins; where cell ratings leave none, verification alone decides; where nothing keeps the
margin, the emergency rule takes the complete trajectory with the best clearance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from clearway.avoidance.candidates import Candidates, ruled
from clearway.avoidance.chosen import Basis, Choice, Grounds, TriedTier
from clearway.avoidance.emergency import emergency
from clearway.avoidance.fusion import ReachAssessment
from clearway.avoidance.hazards import Hazards
from clearway.avoidance.loiter import NO_LOITER, LoiterCircles
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.verify import KnownClearances, RoomPrice, first_clear
from clearway.base.checks import positive
from clearway.base.state import BoolArray, IntArray

VERIFIED = (Basis.RATED, Basis.VERIFIED, Basis.AGAINST_RULES, Basis.NO_LOITER)
"""What a candidate that verification looks at can stand on, the best first."""


def choose_by_rules(
    ruling: Ruling, candidates: Candidates, pick_among: Callable[[Candidates, bool], Choice]
) -> Choice:
    """The choice under rules, with a note of each active rule and of the one that decided.

    pick_among: some candidates, and whether none of them passes.
    """
    if ruling.speaks:
        picked = pick_among(ruled(candidates, ruling), False)
        # Rules forbid and price; what keeps the margin does not depend on them.
        without = pick_among(candidates, picked.basis is Basis.EMERGENCY)
    else:
        picked = without = pick_among(candidates, False)
    notes = ruling.notes(candidates.nodes, without.node, picked.node)
    return replace(picked, rules=notes)


def pick(
    prepared: PreparedReachSet,
    assessment: ReachAssessment,
    candidates: Candidates,
    hazards: Hazards,
    *,
    margin_m: float,
    threshold: float,
    verify: bool = True,
    none_passes: bool = False,
    looked: KnownClearances | None = None,
) -> Choice:
    """The cheapest candidate that passes, else the emergency rule.

    none_passes: where that is known, none is tried.
    looked: what was found of movements before, for who asks again and again.
    Without verification a candidate must keep out of coated cells besides. Candidates that break
    rules come last, those that break the less important ones first. Raises ClearwayError for a
    margin that is not a positive number: every trajectory would keep it.
    """
    positive("safety margin", margin_m)
    order = np.lexsort((candidates.cost_m, candidates.broken))
    ends = candidates.nodes[order]
    # A plan whose first movement leaves nothing feasible, P_D = 0, is no plan (2.3).
    feasible = assessment.feasibility[prepared.first_node[ends]] > 0.0
    rated = (assessment.node_rating[ends] >= threshold) & feasible
    if not verify:
        rated &= candidates.untouched[order]
    grounds = Grounds(prepared, assessment, hazards)
    below = len(rated) - int(np.count_nonzero(rated))
    if not verify and not none_passes and below < len(rated):
        best = int(order[rated][0])
        return Choice.of(grounds, candidates, best, Basis.RATED_ONLY, margin_m, below)
    looked = looked or KnownClearances(prepared.paths)
    tried: list[TriedTier] = []
    if verify and not none_passes:
        for basis in VERIFIED:
            tier = _tier(basis, candidates, order, rated)
            loiter = NO_LOITER if basis is Basis.NO_LOITER else prepared.loiter
            if basis is Basis.NO_LOITER:
                tried.clear()  # The last round looks at all candidates once more.
            found = _first_clear(grounds, candidates, basis, tier, loiter, margin_m, tried, looked)
            if found is not None:
                return Choice.of(grounds, candidates, found, basis, margin_m, below, tried)
    best, kept_m = emergency(looked, candidates, hazards, margin_m)
    return Choice.of(grounds, candidates, best, Basis.EMERGENCY, kept_m, below, tried)


def _tier(basis: Basis, candidates: Candidates, order: IntArray, rated: BoolArray) -> IntArray:
    """Which candidates verification looks at for a basis, the best first.

    order: all candidates, the best first; rated: [candidates], in that order.
    """
    if basis is Basis.NO_LOITER:
        return order
    obeys = candidates.broken[order] == 0
    if basis is Basis.RATED:
        tier: IntArray = order[rated & obeys]
    elif basis is Basis.VERIFIED:
        tier = order[~rated & obeys]
    else:
        tier = order[~obeys]
    return tier


def _first_clear(
    grounds: Grounds,
    candidates: Candidates,
    basis: Basis,
    tier: IntArray,
    loiter: LoiterCircles,
    margin_m: float,
    tried: list[TriedTier],
    looked: KnownClearances,
) -> int | None:
    """The first candidate of a tier that keeps the margin, if one does; adds to what was tried."""
    if not len(tier):
        return None
    # Candidates that break rules are in the order of what they break, not of their cost.
    price = None
    if basis in (Basis.RATED, Basis.VERIFIED):
        price = RoomPrice(candidates.cost_m[tier], candidates.room_price_m[tier])
    hazards = grounds.hazards
    verification = first_clear(
        grounds.prepared.paths,
        candidates.nodes[tier],
        hazards,
        margin_m,
        loiter,
        price,
        looked.at(hazards, margin_m),
    )
    tried.append(TriedTier.of(candidates, tier, verification))
    return int(tier[verification.chosen]) if verification.chosen >= 0 else None
