"""Candidates of a decision: complete trajectories, on which side they pass, and what they cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from clearway.avoidance.choose.passing import Passing
from clearway.avoidance.clear.closing import closing_m
from clearway.avoidance.clear.crossing import crossings_ahead
from clearway.avoidance.long_range.resolve import LongRangeChoice
from clearway.avoidance.plan.costs import Prices, price_of
from clearway.avoidance.plan.held_escape import UnderWay, WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import Ends, PreparedReachSet, complete_ends
from clearway.avoidance.plan.rated import Rated
from clearway.avoidance.rate.goal import Arrival, Goal, arrival
from clearway.avoidance.rate.reach_rating import find_untouched
from clearway.avoidance.rate.route_field import PlacedRoute
from clearway.avoidance.rules.rule import Ruling
from clearway.base.arrays import Bools, Floats, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray

SMALLEST_RATING = 1e-6
"""Rating that counts as none in -log P_R."""


class Side(StrEnum):
    """How a trajectory passes, seen along the way to the goal."""

    LEFT = "left"
    RIGHT = "right"
    STRAIGHT = "straight"


STANDING_IS_WANTED = -1
"""In place of how many decisions led nowhere: standing costs nothing."""


@dataclass(frozen=True, slots=True)
class Commitment:
    """What the last decision binds the next one to, lest it flip from side to side."""

    side: Side = Side.STRAIGHT
    first_movement: str = ""
    """The movement that the last plan has next."""
    planned: tuple[str, ...] = ()
    """All movements that the last plan has yet."""
    passings: tuple[Passing, ...] = ()
    """Intruders that are being passed, each on its side."""
    way_out: WayOut | None = None
    """What is flown from now on if nothing better is found; after the movement under way, if there
    is one."""
    under_way: UnderWay | None = None
    """The movement in the middle of which the decision is taken; None between two."""
    certain_within: int | None = None
    """After how many decisions without a certain escape to stay where one is likely; None for
    never."""
    had_certain: bool = False
    """Whether a certain escape was held before, in this flight."""
    long_range: LongRangeChoice | None = None
    """Side and sense begun about aircraft kilometres away."""
    stood: int = 0
    """How many decisions in a row led nowhere, by movements that stand or turn on the spot."""
    stays: bool = False
    """Whether an escape is flown on and on while it keeps the whole margin: no way leads on."""
    blind: bool = False
    """Whether no sensor tells anything: an escape is stayed in."""


SIDES = {-1: Side.RIGHT, 0: Side.STRAIGHT, 1: Side.LEFT}
COMMITTED = {Side.RIGHT: -1, Side.STRAIGHT: 0, Side.LEFT: 1}
HERE = 1e-7
"""Share of the range: a goal that is no farther lies in no direction."""
STANDS = 0.1
"""Share of the longest movement below which one leads nowhere."""
IMPATIENCE = 0.5
"""What each decision in a row that led nowhere, from the second on, costs the next such movement,
in movement lengths. A look to the side shows the same things in cells of another grid, by which the
way that was best a moment before no longer is: what turns on the spot would look to and fro for
ever."""
DEAD_BAND = 0.1
"""Share of the range within which a path's end counts as straight towards the goal."""


class Candidates(NamedTuple):
    """Complete trajectories and what they cost."""

    nodes: Ints
    """[candidates] ends: by range, by side, or at the final waypoint."""
    cost_m: Floats
    """[candidates] path, cost to go and cost weights."""
    sides: Ints
    """[candidates]"""
    untouched: Bools
    """[candidates] whether it passes no inflated cell."""
    room_price_m: Floats
    """[candidates] what it costs to have no room to circle early on the way; 0 at the last goal."""
    broken: Ints
    """[candidates] which rules it breaks, one bit each: the higher, the worse; 0 obeys all."""

    def __repr__(self) -> str:
        return brief(self)


def price_candidates(
    planner: Planner,
    rated: Rated,
    goal: Goal,
    before: Commitment,
    route: PlacedRoute | None = None,
) -> Candidates:
    """Return every candidate with its cost: (4.6), risk, and what changing one's mind costs.

    Parameters
    ----------
    planner
        Its stage costs, terminal cost and cost weights count.
    rated
        What can be flown, how safe it is, and what moves around.
    goal
        In the level frame.
    before
        What the last decision binds this one to.
    route
        The time to go round what is known; None where it is not kept.

    Raises
    ------
    ClearwayError
        For costs that are no finite numbers.
    """
    prepared, prices, moving = rated.prepared, planner.prices, rated.hazards.moving
    reach_set, step_m = prepared.reach_set, prepared.step_m
    arrived = arrival(reach_set, goal, prepared.reach_m, route)
    # Who has arrived may have to move off.
    moves_off = planner.automaton.has_inertia and len(moving.radius_m) > 0
    ends = complete_ends(prepared, goal, arrived, leads_past=moves_off)
    if before.planned:
        arrived = replace(arrived, planned=reach_set.node_of(before.planned))
    to_go_m = planner.terminal_cost(reach_set, ends.nodes, goal, arrived, planner.automaton)
    if np.shape(to_go_m) != ends.nodes.shape:
        raise ClearwayError(
            f"terminal cost: must give [{len(ends.nodes)}] numbers, one for every node it is asked "
            f"of; it gave {list(np.shape(to_go_m))}"
        )
    candidates = cost_ends(
        ends,
        np.ascontiguousarray(to_go_m, dtype=np.float64),
        goal,
        arrived.reached,
        grazing_of(arrived, goal),
        rated.reach.node_rating,
        find_untouched(reach_set, rated.cells.evidence.coated),
        float(reach_set.grid.range_m),
        make_weights(prices, before, prepared),
    )
    nodes, cost = candidates.nodes, candidates.cost_m
    # What has inertia loses time by standing from the first such movement on.
    stood = before.stood + 1 if planner.automaton.has_inertia else before.stood - 1
    if stood > 0:
        first_m = reach_set.length_m[prepared.first_node[nodes]]
        cost += IMPATIENCE * stood * step_m * (first_m < STANDS * step_m)
    if prices.ahead > 0.0 and len(moving.radius_m):
        cost += prices.ahead * step_m * crossings_ahead(reach_set, moving)[nodes]
    if prices.closing > 0.0 and any(moving.manoeuvre_mps2.tolist()):
        cost += prices.closing * closing_m(reach_set, nodes, moving)
    if not np.isfinite(cost).all():
        raise ClearwayError(
            f"costs: {np.count_nonzero(~np.isfinite(cost))} of {len(cost)} trajectories cost no "
            "finite number; stage cost, terminal cost and rating must be finite"
        )
    return candidates


def grazing_of(arrived: Arrival, goal: Goal) -> FloatArray:
    """[nodes] how little of the reach radius paths that come to the goal enter, from 0 to 1."""
    grazing = np.zeros(len(arrived.reached))
    if not arrived.is_beyond:
        there = np.flatnonzero(arrived.reached)
        grazing[there] = (arrived.miss_m[there] / goal.reach_radius_m) ** 4
    return grazing


@compiled
def log_ratings(rating: Floats, nodes: Ints) -> Floats:
    """[n] log P_R of some nodes [n]; rating: [nodes]."""
    logs = np.empty(len(nodes))
    for n in range(len(nodes)):
        least = rating[nodes[n]]
        if least < SMALLEST_RATING:  # What is not a number stays so.
            least = SMALLEST_RATING
        logs[n] = np.log(least)
    return logs


class GoalView(NamedTuple):
    """The goal, seen from the vehicle."""

    ahead_m: float
    left_m: float
    away_m: float
    """Level distance to it."""
    here_m: float
    """Nearer than this it lies in no direction."""
    dead_band_m: float


@compiled
def view_goal(target: Floats, range_m: float) -> GoalView:
    """target: [3] level frame; range_m: of the grid."""
    away_m = np.hypot(target[0], target[1])
    return GoalView(target[0], target[1], away_m, HERE * range_m, DEAD_BAND * range_m)


class Weights(NamedTuple):
    """What cost weights come to in metres, and what is committed to."""

    step_m: float
    miss: float
    risk: float
    coated_m: float
    no_room_m: float
    other_side_m: float
    committed: int
    """Side that is kept to; 0 for none."""
    other_plan_m: float
    planned: int
    """Movement that the last plan has next; -1 for none."""


def make_weights(prices: Prices, commitment: Commitment, prepared: PreparedReachSet) -> Weights:
    step_m, first = prepared.step_m, commitment.first_movement
    return Weights(
        step_m,
        price_of(prices.miss),
        price_of(prices.risk),
        step_m * price_of(prices.coated),
        price_of(prices.no_room) * step_m,
        price_of(prices.other_side) * step_m,
        COMMITTED[commitment.side],
        price_of(prices.other_plan) * step_m,
        prepared.reach_set.movement_names.index(first) if first else -1,
    )


@compiled
def cost_ends(
    ends: Ends,
    to_go: Floats,
    goal: Goal,
    reached: Bools,
    grazing: Floats,
    node_rating: Floats,
    untouched: Bools,
    range_m: float,
    weights: Weights,
) -> Candidates:
    """What candidates cost, with no rules broken.

    to_go: [ends]; reached, grazing, node_rating, untouched: [nodes]; range_m: of the grid.
    """
    count, view = len(ends.nodes), view_goal(goal.target_m, range_m)
    log_rating = log_ratings(node_rating, ends.nodes)
    cost, room_price = np.empty(count), np.empty(count)
    sides, is_clear = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.bool_)
    for n in range(count):
        node = ends.nodes[n]
        ends_here = goal.final and reached[node]
        is_clear[n] = untouched[node]
        sides[n] = _side_of(ends.ahead_m[n], ends.left_m[n], view)
        cost[n] = ends.path_cost_m[n] + (0.0 if ends_here else to_go[n])
        cost[n] += weights.step_m * (weights.miss * grazing[node] - weights.risk * log_rating[n])
        if not is_clear[n]:
            cost[n] += weights.coated_m
        if weights.committed != 0 and sides[n] == -weights.committed:
            cost[n] += weights.other_side_m
        if weights.planned >= 0 and ends.first_movement[n] != weights.planned:
            cost[n] += weights.other_plan_m
        room_price[n] = 0.0 if ends_here else weights.no_room_m
    return Candidates(
        ends.nodes, cost, sides, is_clear, room_price, np.zeros(count, dtype=np.int64)
    )


@compiled
def _side_of(ahead_m: float, left_m: float, view: GoalView) -> int:
    """-1 right, 0 straight, 1 left of the way to the goal."""
    if view.away_m < view.here_m:
        return 0
    across = (view.ahead_m * left_m - view.left_m * ahead_m) / view.away_m
    if not abs(across) >= view.dead_band_m:  # What is not a number lies on no side.
        return 0
    return 1 if across > 0.0 else -1


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


def apply_rules(candidates: Candidates, ruling: Ruling) -> Candidates:
    """The candidates with what rules forbid, and with the costs of breaking them."""
    nodes = candidates.nodes
    cost_m = candidates.cost_m + ruling.price_m[nodes]
    return candidates._replace(cost_m=cost_m, broken=ruling.broken[nodes])
