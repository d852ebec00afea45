"""What was chosen, what it stands on, and why the cheaper candidates are not it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from clearway.avoidance.candidates import SIDES, Candidates, Side
from clearway.avoidance.fusion import ReachAssessment
from clearway.avoidance.hazards import CAUSES, Cause, Hazards
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.rules.rule import RuleNote
from clearway.avoidance.verify import KEPT, Verification, path_clearance
from clearway.base.brief import brief
from clearway.base.state import IntArray

RULED_OUT_KEPT = 8
"""Cheaper candidates that a decision remembers one by one; the others are counted."""
NO_CAUSES = np.zeros(0, dtype=np.int64)


class Basis(StrEnum):
    """What the chosen trajectory stands on."""

    RATED = "rated above the threshold and verified"
    RATED_ONLY = "rated above the threshold, not verified"
    VERIFIED = "verified, though cell ratings are below the threshold"
    AGAINST_RULES = "verified, but against a rule, since nothing that obeys keeps the margin"
    NO_LOITER = "verified, but without a way out at its end"
    NARROW = "verified, through a place that leaves no way out: no guarantee"
    NO_NEARER = "verified to come no nearer than the place that is already too near"
    WAY_OUT = "escape: the way out in hand, since nothing else leaves one"
    EMERGENCY = "emergency: nothing keeps the margin, best clearance taken"


@dataclass(frozen=True, slots=True)
class RuledOut:
    """One cheaper candidate that was not taken."""

    node: int
    """Node that ends it."""
    cost_m: float
    cause: Cause
    index: int
    """Which point, shape or intruder."""
    clearance_m: float
    """Clearance where it fails; below the margin."""


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The trajectory chosen in one reach set."""

    node: int
    """Node that ends it."""
    basis: Basis
    cost_m: float
    rating: float
    """P_R of the trajectory (4.22)."""
    clearance_m: float
    """Smallest distance to the evidence, and never more than to what is known but out of reach;
    inf without any."""
    limited_by: Cause
    limiting_index: int
    margin_m: float
    """Margin that it keeps: below the asked one in an emergency."""
    side: Side
    feasibility: float
    """P_D of its first movement (2.3)."""
    continuations: float
    """Share of the first movement's continuations rated above the threshold."""
    candidates: int
    below_threshold: int
    """Candidates that the cell rating ruled out."""
    ruled_out: tuple[RuledOut, ...]
    """The cheapest of those that verification ruled out."""
    ruled_out_by: dict[str, int]
    """Number that verification ruled out, by cause."""
    forced: bool
    """Whether the cheapest candidate, had it been free, lies on another side."""
    rules: tuple[RuleNote, ...] = ()
    """What each active rule did."""

    __repr__ = brief


Tried = list[tuple[IntArray, Verification]]
"""Candidates in the order in which verification looked at them, and what it found."""


@dataclass(frozen=True, slots=True)
class ChoiceReport:
    """All that a choice was made from, and how the chosen candidate is told."""

    prepared: PreparedReachSet
    assessment: ReachAssessment
    candidates: Candidates
    hazards: Hazards
    below_threshold: int

    def chosen(
        self,
        best: int,
        basis: Basis,
        margin_m: float,
        tried: Sequence[tuple[IntArray, Verification]],
    ) -> Choice:
        """The choice of candidate `best` with a margin, after verification has tried others."""
        candidates, assessment = self.candidates, self.assessment
        node = int(candidates.nodes[best])
        path = self.prepared.reach_set.path(node)
        first = path[0]
        farthest_m = float(self.prepared.away_m[path].max())
        clearance = path_clearance(self.prepared.paths, node, self.hazards, farthest_m)
        # What was left out is at least so far from any place on the path.
        unseen_m = self.hazards.left_out_m - farthest_m
        if unseen_m > KEPT * margin_m:
            unseen_m = max(unseen_m, margin_m)
        side = int(candidates.sides[best])
        cheapest = int(np.argmin(candidates.cost_m))
        causes = np.concatenate([NO_CAUSES, *(verification.causes for _, verification in tried)])
        counts = np.bincount(causes, minlength=len(Cause)).tolist()
        return Choice(
            node=node,
            basis=basis,
            cost_m=float(candidates.cost_m[best]),
            rating=float(assessment.node_rating[node]),
            clearance_m=min(clearance.distance_m, unseen_m),
            limited_by=clearance.cause,
            limiting_index=clearance.index,
            margin_m=margin_m,
            side=SIDES[side],
            feasibility=float(assessment.feasibility[first]),
            continuations=float(assessment.continuations[first]),
            candidates=len(candidates.nodes),
            below_threshold=self.below_threshold,
            ruled_out=self._ruled_out(tried),
            ruled_out_by={
                cause.name.lower(): counts[cause]
                for cause in (Cause.POINT, Cause.MAP, Cause.INTRUDER)
                if counts[cause]
            },
            forced=bool(candidates.sides[cheapest] != side),
        )

    def _ruled_out(self, tried: Sequence[tuple[IntArray, Verification]]) -> tuple[RuledOut, ...]:
        kept: list[RuledOut] = []
        for tier, verification in tried:
            for at in range(min(len(verification.causes), RULED_OUT_KEPT - len(kept))):
                candidate = int(tier[at])
                kept.append(
                    RuledOut(
                        int(self.candidates.nodes[candidate]),
                        float(self.candidates.cost_m[candidate]),
                        CAUSES[verification.causes[at]],
                        int(verification.cause_index[at]),
                        float(verification.shortfall_m[at]),
                    )
                )
        return tuple(kept)


@dataclass(frozen=True, slots=True)
class Pick:
    """A candidate that was chosen, before it is told: of some that are compared, one is flown."""

    report: ChoiceReport
    best: int
    """Which candidate."""
    basis: Basis
    margin_m: float
    """Margin that it keeps."""
    tried: Sequence[tuple[IntArray, Verification]] = ()
    """What verification found of others before."""

    @property
    def node(self) -> int:
        """Node that ends it."""
        return int(self.report.candidates.nodes[self.best])

    def told(self) -> Choice:
        return self.report.chosen(self.best, self.basis, self.margin_m, self.tried)
