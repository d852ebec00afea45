"""The decision: which trajectory to fly, and why the cheaper ones are not it.

Candidates are complete trajectories only. The cheapest that is rated above the threshold and keeps
the margin wins; where cell ratings leave none, verification alone decides; where nothing keeps the
margin, the emergency rule takes the complete trajectory with the best clearance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from clearway.avoidance.costs import Arrival, Goal, Prices, StageCost, length_and_prices
from clearway.avoidance.crossing import crossings_ahead
from clearway.avoidance.fusion import ReachAssessment
from clearway.avoidance.hazards import Cause, Hazards, MovingHazards
from clearway.avoidance.loiter import NO_LOITER, LoiterCircles, loiter_circles
from clearway.avoidance.passing import Passing
from clearway.avoidance.rules.rule import RuleNote, Ruling
from clearway.avoidance.verify import (
    ROUNDING_M,
    Paths,
    RoomPrice,
    Verification,
    clearances,
    farthest_m,
    first_clear,
    path_clearance,
    paths_of,
)
from clearway.base.brief import brief
from clearway.base.checks import positive
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import BORDER_TOLERANCE
from clearway.base.state import BoolArray, IntArray
from clearway.reach.flown import AttitudeTurns, flown_from, is_flown, turns_of
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton

EMERGENCY_MARGINS = (0.75, 0.5, 0.25, 0.0)
"""Shares of the margin that the emergency rule steps down through."""
RULED_OUT_KEPT = 8
"""Cheaper candidates that a decision remembers one by one; the others are counted."""
SMALLEST_RATING = 1e-6
"""Rating that counts as none in -log P_R."""


class Basis(StrEnum):
    """What the chosen trajectory stands on."""

    RATED = "rated above the threshold and verified"
    RATED_ONLY = "rated above the threshold, not verified"
    VERIFIED = "verified, though cell ratings are below the threshold"
    AGAINST_RULES = "verified, but against a rule, since nothing that obeys keeps the margin"
    NO_LOITER = "verified, but without room to circle at its end"
    EMERGENCY = "emergency: nothing keeps the margin, best clearance taken"


class Side(StrEnum):
    """How a trajectory passes, seen along the way to the goal."""

    LEFT = "left"
    RIGHT = "right"
    STRAIGHT = "straight"


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


@dataclass(frozen=True, slots=True)
class Commitment:
    """What the last decision binds the next one to, lest it flip from side to side."""

    side: Side = Side.STRAIGHT
    first_movement: str = ""
    """The movement that the last plan has next."""
    passings: tuple[Passing, ...] = ()
    """Intruders that are being passed, each on its side."""


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


@dataclass(frozen=True, slots=True, eq=False)
class PreparedReachSet:
    """A reach set with what every decision needs of it, worked out once.

    Built for one of few start pitches; `flown_from` says where the same movements lead from the
    attitude that the vehicle really has.
    """

    reach_set: ReachSet
    paths: Paths
    loiter: LoiterCircles
    path_cost_m: FloatArray
    """[nodes] stage costs from the start to each node."""
    first_movement: IntArray
    """[nodes] index of the first movement on the way to each node."""
    first_node: IntArray
    """[nodes] node of that first movement."""
    step_m: float
    """Length of one movement: the unit of prices."""
    turns: AttitudeTurns
    flyable: BoolArray
    """[nodes] whether the path to the node's end keeps the automaton's pitch limit."""
    reach_m: float
    """How far from the vehicle its paths lead, at least the range of the grid."""

    __repr__ = brief

    @classmethod
    def of(
        cls,
        reach_set: ReachSet,
        prices: Prices,
        stage_cost: StageCost = length_and_prices,
        turning_radius_m: float = 0.0,
    ) -> PreparedReachSet:
        """Evaluate the stage cost (4.6) on a reach set; without a turning radius none circles."""
        cost = np.array(stage_cost(reach_set, prices), dtype=np.float64)
        if cost.shape != (reach_set.nodes,) or not np.all(np.isfinite(cost)):
            raise ClearwayError("stage cost: must be a finite number for every node")
        first = reach_set.movement.astype(np.int64)
        first_node = np.arange(reach_set.nodes)
        for node, parent in enumerate(reach_set.parent):
            if parent >= 0:
                cost[node] += cost[parent]
                first[node], first_node[node] = first[parent], first_node[parent]
        step_m = float(np.max(reach_set.length_m[reach_set.parent < 0]))
        loiter = loiter_circles(reach_set, turning_radius_m)
        return cls(
            reach_set,
            paths_of(reach_set),
            loiter,
            cost,
            first,
            first_node,
            step_m,
            turns_of(reach_set),
            np.ones(reach_set.nodes, dtype=np.bool_),
            reach_of(paths_of(reach_set), reach_set.grid.range_m),
        )

    def flown_from(
        self, automaton: MovementAutomaton, roll_rad: float, pitch_rad: float
    ) -> PreparedReachSet:
        """The same trajectories from a true attitude; cells and costs of movements stay."""
        if is_flown(self.reach_set, automaton, roll_rad, pitch_rad):
            return self
        flown, flyable = flown_from(self.reach_set, self.turns, automaton, roll_rad, pitch_rad)
        return replace(
            self,
            reach_set=flown,
            paths=paths_of(flown),
            loiter=loiter_circles(flown, self.loiter.radius_m),
            flyable=flyable,
            reach_m=reach_of(paths_of(flown), flown.grid.range_m),
        )


def reach_of(paths: Paths, range_m: float) -> float:
    """How far from the start any path comes, at least the range of the grid; what is added to the
    margin on the way, as to the sagitta, counts."""
    samples = paths.samples_m
    farthest = np.sqrt(np.einsum("nsi,nsi->ns", samples, samples).max(axis=1))
    reach_m = float((farthest + paths.sagitta_m).max())
    return reach_m if reach_m > range_m + BORDER_TOLERANCE else range_m


SIDES = {-1: Side.RIGHT, 0: Side.STRAIGHT, 1: Side.LEFT}
DEAD_BAND = 0.1
"""Share of the range within which a path's end counts as straight towards the goal."""


def sides_of(reach_set: ReachSet, nodes: IntArray, goal: Goal) -> IntArray:
    """[nodes] -1 right, 0 straight, 1 left of the way to the goal, by the end of the path."""
    target = goal.target_m
    length = float(np.hypot(target[0], target[1]))
    if length < 1e-6:
        return np.zeros(len(nodes), dtype=np.int64)
    cos, sin = np.cos(reach_set.start_pitch_rad), np.sin(reach_set.start_pitch_rad)
    ends = reach_set.states[nodes]
    x, y = cos * ends[:, 0] + sin * ends[:, 2], ends[:, 1]
    across = (target[0] * y - target[1] * x) / length
    off = np.abs(across) >= DEAD_BAND * reach_set.grid.range_m
    return np.where(off, np.sign(across), 0).astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Complete trajectories and what they cost."""

    nodes: IntArray
    """[candidates] ends: by range, by side, or at the final waypoint."""
    cost_m: FloatArray
    """[candidates] path, cost to go and prices."""
    sides: IntArray
    """[candidates]"""
    untouched: BoolArray
    """[candidates] whether it passes no coated cell."""
    room_price_m: FloatArray
    """[candidates] what it costs to have no room to circle early on the way; 0 at the last goal."""
    broken: IntArray
    """[candidates] which rules it breaks, one bit each: the higher, the worse; 0 obeys all."""


def price_candidates(
    prepared: PreparedReachSet,
    assessment: ReachAssessment,
    untouched: BoolArray,
    goal: Goal,
    arrived: Arrival,
    to_go: Callable[[IntArray], FloatArray],
    prices: Prices,
    commitment: Commitment,
    moving: MovingHazards | None = None,
) -> Candidates:
    """Cost of every candidate: (4.6) plus the prices of risk and of changing one's mind.

    untouched: [nodes] paths that pass no coated cell. to_go: cost to go in metres from the ends
    of given nodes. moving: intruders that it may cost something to cross ahead of.
    """
    reach_set, step_m = prepared.reach_set, prepared.step_m
    complete = reach_set.complete
    if goal.final:
        complete = (complete & ~arrived.reached) | arrived.first
    nodes = np.flatnonzero(complete & prepared.flyable)
    to_go_m = to_go(nodes)
    if goal.final:
        to_go_m = np.where(arrived.reached[nodes], 0.0, to_go_m)
    grazing = np.where(arrived.reached, arrived.miss_m / goal.reach_radius_m, 0.0)[nodes] ** 4
    rating = np.maximum(assessment.node_rating[nodes], SMALLEST_RATING)
    cost = prepared.path_cost_m[nodes] + to_go_m
    cost += step_m * (prices.miss * grazing - prices.risk * np.log(rating))
    cost += step_m * prices.coated * ~untouched[nodes]
    sides = sides_of(reach_set, nodes, goal)
    if commitment.side in (Side.LEFT, Side.RIGHT):
        committed = 1 if commitment.side is Side.LEFT else -1
        cost += prices.other_side * step_m * (sides == -committed)
    if commitment.first_movement:
        planned = reach_set.movement_names.index(commitment.first_movement)
        cost += prices.other_plan * step_m * (prepared.first_movement[nodes] != planned)
    if prices.ahead > 0.0 and moving is not None and len(moving.radius_m):
        cost += prices.ahead * step_m * crossings_ahead(reach_set, moving)[nodes]
    if not np.all(np.isfinite(cost)):
        raise ClearwayError(
            f"costs: {np.count_nonzero(~np.isfinite(cost))} of {len(cost)} trajectories cost no "
            "finite number; stage cost, terminal cost and rating must be finite"
        )
    ends_here = arrived.reached[nodes] & goal.final
    room_price = np.where(ends_here, 0.0, prices.no_room * step_m)
    obeys_all = np.zeros(len(nodes), dtype=np.int64)
    return Candidates(nodes, cost, sides, untouched[nodes], room_price, obeys_all)


def ruled(candidates: Candidates, ruling: Ruling) -> Candidates:
    """The candidates with what rules forbid and price."""
    nodes = candidates.nodes
    cost_m = candidates.cost_m + ruling.price_m[nodes]
    return replace(candidates, cost_m=cost_m, broken=ruling.broken[nodes])


def choose_by_rules(
    ruling: Ruling, candidates: Candidates, choose_among: Callable[[Candidates], Choice]
) -> Choice:
    """The choice under rules, with a note of each active rule and of the one that decided."""
    if not ruling.speaks:
        choice = choose_among(candidates)
        return replace(choice, rules=ruling.notes(candidates.nodes, choice.node, choice.node))
    choice = choose_among(ruled(candidates, ruling))
    without = choose_among(candidates)
    return replace(choice, rules=ruling.notes(candidates.nodes, without.node, choice.node))


def choose(
    prepared: PreparedReachSet,
    assessment: ReachAssessment,
    candidates: Candidates,
    hazards: Hazards,
    *,
    margin_m: float,
    threshold: float,
    verify: bool = True,
) -> Choice:
    """The cheapest candidate that passes, else the emergency rule.

    Without verification a candidate must keep out of coated cells besides. Candidates that break
    rules come last, those that break the less important ones first. Raises ClearwayError for a
    margin that is not a positive number: every trajectory would keep it.
    """
    positive("safety margin", margin_m)
    paths = prepared.paths
    order = np.lexsort((candidates.cost_m, candidates.broken))
    ends = candidates.nodes[order]
    # A plan whose first movement leaves nothing feasible, P_D = 0, is no plan (2.3).
    feasible = assessment.feasibility[prepared.first_node[ends]] > 0.0
    rated = (assessment.node_rating[ends] >= threshold) & feasible
    if not verify:
        rated &= candidates.untouched[order]
    report = _Report(prepared, assessment, candidates, hazards, int((~rated).sum()))
    if not verify:
        if rated.any():
            return report.chosen(int(order[rated][0]), Basis.RATED_ONLY, margin_m, ())
        best, kept = _emergency(paths, candidates, hazards, margin_m)
        return report.chosen(best, Basis.EMERGENCY, kept, ())
    tried: list[tuple[IntArray, Verification]] = []
    obeys = candidates.broken[order] == 0
    tiers = (
        (Basis.RATED, order[rated & obeys], prepared.loiter),
        (Basis.VERIFIED, order[~rated & obeys], prepared.loiter),
        (Basis.AGAINST_RULES, order[~obeys], prepared.loiter),
        (Basis.NO_LOITER, order, NO_LOITER),
    )
    for basis, tier, loiter in tiers:
        if basis is Basis.NO_LOITER:
            tried.clear()  # The last round looks at all candidates once more.
        if not len(tier):
            continue
        # Candidates that break rules are in the order of what they break, not of their cost.
        price = None
        if basis in (Basis.RATED, Basis.VERIFIED):
            price = RoomPrice(candidates.cost_m[tier], candidates.room_price_m[tier])
        verification = first_clear(paths, candidates.nodes[tier], hazards, margin_m, loiter, price)
        tried.append((tier, verification))
        if verification.chosen >= 0:
            return report.chosen(int(tier[verification.chosen]), basis, margin_m, tried)
    best, kept = _emergency(paths, candidates, hazards, margin_m)
    return report.chosen(best, Basis.EMERGENCY, kept, tried)


def _emergency(
    paths: Paths, candidates: Candidates, hazards: Hazards, margin_m: float
) -> tuple[int, float]:
    """Candidate with the best clearance, and the stepped-down margin that it keeps.

    Where all are alike (the start itself is too near), the one that lacks least on its way.
    """
    measured = clearances(paths, hazards, margin_m)[candidates.nodes]
    coarse = np.round(measured[:, 0] / (0.01 * margin_m))
    best = int(np.lexsort((candidates.cost_m, measured[:, 1], -coarse))[0])
    kept = measured[best, 0] / margin_m
    return best, margin_m * next((share for share in EMERGENCY_MARGINS if kept >= share), 0.0)


@dataclass(frozen=True, slots=True)
class _Report:
    """Gathers what a choice has to tell."""

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
        candidates, assessment = self.candidates, self.assessment
        node = int(candidates.nodes[best])
        first = self.prepared.reach_set.path(node)[0]
        clearance = path_clearance(self.prepared.paths, node, self.hazards)
        # What was left out is at least so far from any place on the path.
        unseen_m = self.hazards.left_out_m - farthest_m(self.prepared.paths, node)
        if unseen_m > margin_m - ROUNDING_M:
            unseen_m = max(unseen_m, margin_m)
        side = int(candidates.sides[best])
        cheapest = int(np.argmin(candidates.cost_m))
        counts = sum((np.bincount(v.causes, minlength=len(Cause)) for _, v in tried), start=0)
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
                cause.name.lower(): int(np.atleast_1d(counts)[cause])
                for cause in (Cause.POINT, Cause.MAP, Cause.INTRUDER)
                if tried and np.atleast_1d(counts)[cause]
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
                        Cause(int(verification.causes[at])),
                        int(verification.cause_index[at]),
                        float(verification.shortfall_m[at]),
                    )
                )
        return tuple(kept)
