"""What was chosen, what it stands on, and why the cheaper candidates are not it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from clearway.avoidance.choose.candidates import SIDES, Candidates, Side
from clearway.avoidance.choose.tiers import Picked
from clearway.avoidance.clear.hazards import CAUSES, Cause, Hazards
from clearway.avoidance.clear.verify import KEPT, Clearance, path_clearance
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.rate.fusion import CellAssessment
from clearway.avoidance.rate.reach_rating import ReachAssessment
from clearway.avoidance.rules.rule import RuleNote
from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray

RULED_OUT_KEPT = 8
"""Cheaper candidates that a decision remembers one by one; the others are counted."""


class Basis(StrEnum):
    """What the chosen trajectory stands on."""

    RATED = "rated above the threshold and verified"
    RATED_ONLY = "rated above the threshold, not verified"
    VERIFIED = "verified, though cell ratings are below the threshold"
    AGAINST_RULES = "verified, but against a rule, since nothing that obeys keeps the margin"
    NO_LOITER = "verified, but no escape at its end"
    NARROW = "verified, through a place that leaves no escape: no guarantee"
    NO_NEARER = "verified to come no nearer than the place that is already too near"
    WAY_OUT = "escape: the held one, since nothing else leaves one"
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


class Tried(NamedTuple):
    """What verification found of candidates before the chosen one, in the order of looking, and
    which the first `RULED_OUT_KEPT` of them were."""

    nodes: IntArray
    """[kept] nodes that end the first of them."""
    cost_m: FloatArray
    """[kept]"""
    causes: IntArray
    """[tried] as of `verify.Verification`, these and the next two."""
    cause_index: IntArray
    shortfall_m: FloatArray

    def __repr__(self) -> str:
        return brief(self)

    @classmethod
    def of(cls, candidates: Candidates, found: Picked) -> Tried:
        if not len(found.tried):
            return NOTHING_TRIED
        first = found.tried[:RULED_OUT_KEPT]
        return cls(
            candidates.nodes[first],
            candidates.cost_m[first],
            found.causes,
            found.cause_index,
            found.shortfall_m,
        )


NOTHING_TRIED = Tried(
    np.zeros(0, dtype=np.int64),
    np.zeros(0),
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.int64),
    np.zeros(0),
)


class Grounds(Protocol):
    """What a choice was made from: a `Rated`, or what is kept of it once the decision is past."""

    @property
    def prepared(self) -> PreparedReachSet: ...

    @property
    def cells(self) -> CellAssessment: ...

    @property
    def reach(self) -> ReachAssessment: ...

    @property
    def hazards(self) -> Hazards: ...

    @property
    def seen_m(self) -> FloatArray:
        """[n, 3] where returns were, world frame."""
        ...


@dataclass(frozen=True, eq=False)
class Choice:
    """The trajectory chosen in one reach set; what explains it is worked out when asked for."""

    node: int
    """Node that ends it."""
    basis: Basis
    cost_m: float
    margin_m: float
    """Margin that it keeps: below the asked one in an emergency."""
    side: Side
    candidates: int
    below_threshold: int
    """Candidates that the cell rating ruled out."""
    forced: bool
    """Whether the cheapest candidate, had it been free, lies on another side."""
    grounds: Grounds = field(repr=False)
    tried: Tried = field(default=NOTHING_TRIED, repr=False)
    rules: tuple[RuleNote, ...] = ()
    """What each active rule did."""
    find_rule_notes: Callable[[], tuple[RuleNote, ...]] | None = field(default=None, repr=False)
    """Works out `rules`, for the one choice that is flown: it takes another search."""
    TOLD: ClassVar = (
        "clearance_m",
        "limited_by",
        "limiting_index",
        "rating",
        "feasibility",
        "continuations",
        "is_first",
        "ruled_out",
        "ruled_out_by",
    )
    """What is worked out when asked for, and then remembered."""

    __repr__ = brief

    def with_rule_notes(self) -> Choice:
        """Return the choice with what each active rule did."""
        if self.find_rule_notes is None:
            return self
        return replace(self, rules=self.find_rule_notes(), find_rule_notes=None)

    @classmethod
    def of(
        cls,
        grounds: Grounds,
        candidates: Candidates,
        best: int,
        basis: Basis,
        margin_m: float,
        below_threshold: int = 0,
        tried: Tried = NOTHING_TRIED,
    ) -> Choice:
        """The choice of candidate `best` with a margin, after verification has tried others."""
        side = int(candidates.sides[best])
        return cls(
            int(candidates.nodes[best]),
            basis,
            float(candidates.cost_m[best]),
            margin_m,
            SIDES[side],
            len(candidates.nodes),
            below_threshold,
            bool(candidates.sides[candidates.cost_m.argmin()] != side),
            grounds,
            tried,
        )

    @cached_property
    def _path(self) -> list[int]:
        return self.grounds.prepared.reach_set.path(self.node)

    @cached_property
    def _farthest_m(self) -> float:
        return float(self.grounds.prepared.away_m[self._path].max())

    @cached_property
    def _nearest(self) -> Clearance:
        paths, hazards = self.grounds.prepared.paths, self.grounds.hazards
        return path_clearance(paths, self.node, hazards, self._farthest_m)

    @cached_property
    def clearance_m(self) -> float:
        """Smallest distance to the evidence, and never more than to what is known but out of reach;
        inf without any."""
        # What was left out is at least so far from any place on the path.
        unseen_m = self.grounds.hazards.left_out_m - self._farthest_m
        if unseen_m > KEPT * self.margin_m:
            unseen_m = max(unseen_m, self.margin_m)
        return min(self._nearest.distance_m, unseen_m)

    @cached_property
    def limited_by(self) -> Cause:
        return self._nearest.cause

    @cached_property
    def limiting_index(self) -> int:
        """Which point, shape or intruder."""
        return self._nearest.index

    @cached_property
    def rating(self) -> float:
        """P_R of the trajectory (4.22)."""
        return float(self.grounds.reach.node_rating[self.node])

    @cached_property
    def feasibility(self) -> float:
        """P_D of its first movement (2.3)."""
        return float(self.grounds.reach.feasibility[self._path[0]])

    @cached_property
    def continuations(self) -> float:
        """Share of the first movement's continuations rated above the threshold."""
        return float(self.grounds.reach.continuations[self._path[0]])

    @cached_property
    def ruled_out(self) -> tuple[RuledOut, ...]:
        """The cheapest of those that verification ruled out."""
        tried = self.tried
        return tuple(
            RuledOut(
                int(node),
                float(cost_m),
                CAUSES[tried.causes[at]],
                int(tried.cause_index[at]),
                float(tried.shortfall_m[at]),
            )
            for at, (node, cost_m) in enumerate(zip(tried.nodes, tried.cost_m, strict=True))
        )

    @cached_property
    def is_first(self) -> bool:
        """Whether verification ruled none out."""
        return not len(self.tried.causes)

    @cached_property
    def ruled_out_by(self) -> dict[str, int]:
        """Number that verification ruled out, by cause."""
        if self.is_first:
            return {}
        counts = np.bincount(self.tried.causes, minlength=len(Cause)).tolist()
        return {
            cause.name.lower(): counts[cause]
            for cause in (Cause.POINT, Cause.MAP, Cause.INTRUDER)
            if counts[cause]
        }
