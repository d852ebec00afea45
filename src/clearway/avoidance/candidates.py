"""Candidates of a decision: complete trajectories, on which side they pass, and what they cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from clearway.avoidance.closing import closing_m
from clearway.avoidance.costs import Arrival, Goal, Prices, price_of
from clearway.avoidance.crossing import crossings_ahead
from clearway.avoidance.fusion import ReachAssessment
from clearway.avoidance.hazards import MovingHazards
from clearway.avoidance.long_range.resolve import LongRangeChoice
from clearway.avoidance.passing import Passing
from clearway.avoidance.prepared import Ends, PreparedReachSet, ends_of
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.way_out import UnderWay, WayOut
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray

SMALLEST_RATING = 1e-6
"""Rating that counts as none in -log P_R."""


class Side(StrEnum):
    """How a trajectory passes, seen along the way to the goal."""

    LEFT = "left"
    RIGHT = "right"
    STRAIGHT = "straight"


@dataclass(frozen=True, slots=True)
class Commitment:
    """What the last decision binds the next one to, lest it flip from side to side."""

    side: Side = Side.STRAIGHT
    first_movement: str = ""
    """The movement that the last plan has next."""
    passings: tuple[Passing, ...] = ()
    """Intruders that are being passed, each on its side."""
    way_out: WayOut | None = None
    """What is flown from now on if nothing better is found; after the movement under way, if there
    is one."""
    under_way: UnderWay | None = None
    """The movement in the middle of which the decision is taken; None between two."""
    certain_within: int | None = None
    """After how many decisions without a certain way out to stay where one is likely; None for
    never."""
    had_certain: bool = False
    """Whether a certain way out was in hand before, in this flight."""
    long_range: LongRangeChoice | None = None
    """Side and sense begun about aircraft kilometres away."""
    stood: int = 0
    """How many decisions in a row led nowhere, by movements that stand or turn on the spot; 0
    where that is wanted."""
    stays: bool = False
    """Whether a way out is flown on and on while it keeps the whole margin: no way leads on."""


SIDES = {-1: Side.RIGHT, 0: Side.STRAIGHT, 1: Side.LEFT}
HERE = 1e-7
"""Share of the range: a goal that is no farther lies in no direction."""
STANDS = 0.1
"""Share of the longest movement below which one leads nowhere."""
IMPATIENCE = 0.5
"""What each decision in a row that led nowhere, from the second on, costs the next such movement,
in movement lengths. A look aside shows the same things in cells of another grid, by which the way
that was best a moment before no longer is: what turns on the spot would look to and fro for
ever."""
DEAD_BAND = 0.1
"""Share of the range within which a path's end counts as straight towards the goal."""


def sides_of(ends: Ends, goal: Goal, range_m: float) -> IntArray:
    """[ends] -1 right, 0 straight, 1 left of the way to the goal, by the end of the path."""
    target = goal.target_m
    length = float(np.hypot(target[0], target[1]))
    if length < HERE * range_m:
        return np.zeros(len(ends.nodes), dtype=np.int64)
    across = (target[0] * ends.left_m - target[1] * ends.ahead_m) / length
    off = np.abs(across) >= DEAD_BAND * range_m
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
    of given nodes. moving: intruders that it may cost something to cross ahead of, or to near.
    """
    reach_set, step_m = prepared.reach_set, prepared.step_m
    ends = _complete_ends(prepared, goal, arrived)
    nodes = ends.nodes
    to_go_m = to_go(nodes)
    reached, is_clear = arrived.reached[nodes], untouched[nodes]
    if goal.final:
        to_go_m = np.where(reached, 0.0, to_go_m)
    grazing = np.where(reached, arrived.miss_m[nodes] / goal.reach_radius_m, 0.0) ** 4
    rating = np.maximum(assessment.node_rating[nodes], SMALLEST_RATING)
    cost = ends.path_cost_m + to_go_m
    cost += step_m * (prices.miss * grazing - prices.risk * np.log(rating))
    cost += step_m * price_of(prices.coated) * ~is_clear
    sides = sides_of(ends, goal, reach_set.grid.range_m)
    _add_changes_of_mind(cost, prepared, ends, sides, prices, commitment)
    if prices.ahead > 0.0 and moving is not None and len(moving.radius_m):
        cost += prices.ahead * step_m * crossings_ahead(reach_set, moving)[nodes]
    if prices.closing > 0.0 and moving is not None and moving.manoeuvre_mps2.any():
        cost += prices.closing * closing_m(reach_set, nodes, moving)
    if not np.all(np.isfinite(cost)):
        raise ClearwayError(
            f"costs: {np.count_nonzero(~np.isfinite(cost))} of {len(cost)} trajectories cost no "
            "finite number; stage cost, terminal cost and rating must be finite"
        )
    ends_here = reached & goal.final
    room_price = np.where(ends_here, 0.0, price_of(prices.no_room) * step_m)
    obeys_all = np.zeros(len(nodes), dtype=np.int64)
    return Candidates(nodes, cost, sides, is_clear, room_price, obeys_all)


def _complete_ends(prepared: PreparedReachSet, goal: Goal, arrived: Arrival) -> Ends:
    """Of complete trajectories that can be flown: at the last goal, none leads past it."""
    if not goal.final or not arrived.reached.any():
        return prepared.ends if prepared.may_stay else prepared.leading_on
    complete = (prepared.reach_set.complete & ~arrived.reached) | arrived.first
    ends = ends_of(prepared, complete)
    if prepared.may_stay or not ends.leads_on.any():
        return ends
    return ends.some(ends.leads_on | arrived.reached[ends.nodes])


def _add_changes_of_mind(
    cost_m: FloatArray,
    prepared: PreparedReachSet,
    ends: Ends,
    sides: IntArray,
    prices: Prices,
    commitment: Commitment,
) -> None:
    """Add in place what it costs to pass on another side, or to begin otherwise than planned."""
    step_m = prepared.step_m
    if commitment.side in (Side.LEFT, Side.RIGHT):
        committed = 1 if commitment.side is Side.LEFT else -1
        cost_m += prices.other_side * step_m * (sides == -committed)
    if commitment.first_movement:
        planned = prepared.reach_set.movement_names.index(commitment.first_movement)
        cost_m += prices.other_plan * step_m * (ends.first_movement != planned)
    if commitment.stood > 1:
        first_m = prepared.reach_set.length_m[prepared.first_node[ends.nodes]]
        cost_m += IMPATIENCE * (commitment.stood - 1) * step_m * (first_m < STANDS * step_m)


def among(candidates: Candidates, keep: BoolArray) -> Candidates:
    """Some of the candidates, by a mask [candidates]."""
    return Candidates(
        candidates.nodes[keep],
        candidates.cost_m[keep],
        candidates.sides[keep],
        candidates.untouched[keep],
        candidates.room_price_m[keep],
        candidates.broken[keep],
    )


def ruled(candidates: Candidates, ruling: Ruling) -> Candidates:
    """The candidates with what rules forbid and price."""
    nodes = candidates.nodes
    cost_m = candidates.cost_m + ruling.price_m[nodes]
    return replace(candidates, cost_m=cost_m, broken=ruling.broken[nodes])
