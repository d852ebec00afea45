"""The decision: which trajectory to fly.

Candidates are complete trajectories only. The cheapest that is rated above the threshold and keeps
the margin wins; where cell ratings leave none, verification alone decides; where nothing keeps the
margin, the emergency rule takes the complete trajectory with the best clearance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from clearway.avoidance.choose.candidates import Candidates, apply_rules
from clearway.avoidance.choose.chosen import NOTHING_TRIED, Basis, Choice, Tried
from clearway.avoidance.choose.emergency import emergency
from clearway.avoidance.choose.tiers import NodeRatings, in_order, pick_candidate
from clearway.avoidance.clear.verify import KnownClearances
from clearway.avoidance.plan.rated import Rated
from clearway.avoidance.rules.rule import RuleNote, Ruling
from clearway.base.checks import positive

VERIFIED = (Basis.RATED, Basis.VERIFIED, Basis.AGAINST_RULES, Basis.NO_LOITER)
"""What a candidate that verification looks at can stand on, by the tiers of `tiers`."""


def choose_by_rules(
    ruling: Ruling, candidates: Candidates, pick_among: Callable[[Candidates, bool], Choice]
) -> Choice:
    """The choice under rules; asked, it notes each active rule and the one that decided.

    pick_among: some candidates, and whether none of them passes.
    """
    speaks = ruling.speaks
    choice = pick_among(apply_rules(candidates, ruling) if speaks else candidates, False)

    def find_rule_notes() -> tuple[RuleNote, ...]:
        without = choice
        if speaks:
            # Rules forbid and add costs; what keeps the margin does not depend on them.
            without = pick_among(candidates, choice.basis is Basis.EMERGENCY)
        return ruling.notes(candidates.nodes, without.node, choice.node)

    return replace(choice, find_rule_notes=find_rule_notes)


def pick(
    rated: Rated,
    candidates: Candidates,
    margin_m: float,
    *,
    verify: bool = True,
    none_passes: bool = False,
    looked: KnownClearances | None = None,
) -> Choice:
    """Return the cheapest candidate that passes, else the emergency rule's.

    Candidates that break rules come last, those that break the less important ones first.

    Parameters
    ----------
    rated
        How safe trajectories are, and what they must keep clear of.
    candidates
        The complete trajectories to choose from.
    margin_m
        Distance to keep.
    verify
        Check candidates against points, shapes and intruders. Without it, one that passes must
        also keep out of inflated cells.
    none_passes
        Known not to pass: none is tried.
    looked
        What was found of movements before, for a caller that picks repeatedly.

    Raises
    ------
    ClearwayError
        For a margin that is not a positive number: every trajectory would keep it.
    """
    positive("safety margin", margin_m)
    prepared, reach, hazards = rated.prepared, rated.reach, rated.hazards
    ratings = NodeRatings(
        reach.node_rating, reach.feasibility, prepared.first_node, reach.threshold
    )
    looked = looked or KnownClearances(prepared.paths)
    if verify and not none_passes:
        found = pick_candidate(
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
        if found.best >= 0:
            tried, basis = Tried.of(candidates, found), VERIFIED[found.tier]
            return Choice.of(rated, candidates, found.best, basis, margin_m, found.below, tried)
        below, tried = found.below, Tried.of(candidates, found)
    else:
        order, passes = in_order(candidates, ratings, not verify)
        below, tried = len(passes) - int(np.count_nonzero(passes)), NOTHING_TRIED
        if not none_passes and below < len(passes):
            best = int(order[passes][0])
            return Choice.of(rated, candidates, best, Basis.RATED_ONLY, margin_m, below)
    best, kept_m = emergency(looked, candidates, hazards, margin_m)
    return Choice.of(rated, candidates, best, Basis.EMERGENCY, kept_m, below, tried)
