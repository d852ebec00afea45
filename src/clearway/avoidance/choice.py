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
from clearway.avoidance.chosen import Basis, Choice, Grounds, Tried
from clearway.avoidance.emergency import emergency
from clearway.avoidance.hazards import Hazards
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.reach_rating import ReachAssessment
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.tiers import NodeRatings, Picked, in_order, picked
from clearway.avoidance.verify import KnownClearances
from clearway.base.by_leaf import by_leaf
from clearway.base.checks import positive

VERIFIED = (Basis.RATED, Basis.VERIFIED, Basis.AGAINST_RULES, Basis.NO_LOITER)
"""What a candidate that verification looks at can stand on, by the tiers of `tiers`."""
_picked = by_leaf(picked)


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
    grounds = Grounds(prepared, assessment, hazards)
    ratings = ratings_of(prepared, assessment, threshold)
    looked = looked or KnownClearances(prepared.paths)
    if verify and not none_passes:
        found = _picked(
            prepared.paths,
            candidates,
            ratings,
            hazards.bins,
            hazards.shapes,
            hazards.moving,
            margin_m,
            prepared.loiter,
            looked.at(hazards, margin_m),
        )
        return choice_of(grounds, candidates, found, margin_m, looked)
    order, passes = in_order(candidates, ratings, not verify)
    below = len(passes) - int(np.count_nonzero(passes))
    if not none_passes and below < len(passes):
        best = int(order[passes][0])
        return Choice.of(grounds, candidates, best, Basis.RATED_ONLY, margin_m, below)
    best, kept_m = emergency(looked, candidates, hazards, margin_m)
    return Choice.of(grounds, candidates, best, Basis.EMERGENCY, kept_m, below)


def ratings_of(
    prepared: PreparedReachSet, assessment: ReachAssessment, threshold: float
) -> NodeRatings:
    """By what ratings let candidates pass."""
    return NodeRatings(
        assessment.node_rating, assessment.feasibility, prepared.first_node, float(threshold)
    )


def choice_of(
    grounds: Grounds,
    candidates: Candidates,
    found: Picked,
    margin_m: float,
    looked: KnownClearances,
) -> Choice:
    """The choice that verification came to, else the emergency rule's."""
    tried = Tried.of(candidates, found)
    best, basis, kept_m = found.best, VERIFIED[found.tier], margin_m
    if best < 0:
        basis = Basis.EMERGENCY
        best, kept_m = emergency(looked, candidates, grounds.hazards, margin_m)
    return Choice.of(grounds, candidates, best, basis, kept_m, found.below, tried)
