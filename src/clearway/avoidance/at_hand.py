"""What is at hand before anything is chosen, and what it makes of the trajectories.

An ordinary decision prices its candidates and picks the first that passes in one compiled call
(`cycle.chosen`). Where costs are a user's own, rules are in force, or something else has a price
that few decisions ask for, candidates are priced first, and picked from as whoever asks says.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.assess import Assessment
from clearway.avoidance.candidates import (
    Candidates,
    Commitment,
    complete_ends,
    grazing_of,
    log_ratings,
    not_finite,
    price_candidates,
    view_of,
    weights_of,
)
from clearway.avoidance.choice import choice_of, ratings_of
from clearway.avoidance.chosen import Choice, Grounds
from clearway.avoidance.costs import Arrival, Goal, TurnsAndClimbs, arrival
from clearway.avoidance.cycle import chosen
from clearway.avoidance.planner import Planner
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.situation import Situation
from clearway.avoidance.verify import KnownClearances
from clearway.base.checks import positive
from clearway.base.frames import FloatArray, length_of
from clearway.base.state import IntArray

SURELY = 1.0 + 1e-6
"""Times as far as anything comes, where rounding must not count."""


class BeforeChoice(NamedTuple):
    """All that is known at a decision before anything is chosen."""

    planner: Planner
    situation: Situation
    before: Commitment
    prepared: PreparedReachSet
    """What can be flown from here."""
    known: Assessment
    goal: Goal


class Priced(NamedTuple):
    """What can be chosen from, and what is known of it."""

    candidates: Candidates
    looked: KnownClearances
    best: Choice | None = None
    """The best of all, clear of all that is around; None where nobody has looked yet."""


def priced(at_hand: BeforeChoice, ruling: Ruling | None) -> Priced:
    """The complete trajectories with their costs (4.6), and the best where no rule has a say."""
    able = at_hand.planner.turns_and_climbs
    if able is not None and ruling is None and _is_ordinary(at_hand):
        return _priced_and_picked(at_hand, able)
    return priced_in_steps(at_hand)


def _is_ordinary(at_hand: BeforeChoice) -> bool:
    """Whether nothing has a price, or a say, that few decisions ask for."""
    planner, before, moving = at_hand.planner, at_hand.before, at_hand.known.near.hazards.moving
    if not planner.settings.verify or before.stood > 1 or before.stays:
        return False
    if not len(moving.radius_m):
        return True
    return not (planner.prices.ahead > 0.0 or any(moving.manoeuvre_mps2.tolist()))


def priced_in_steps(at_hand: BeforeChoice) -> Priced:
    """The same, loop by loop, with whatever has a price; nothing is picked."""
    planner, prepared, known, goal = at_hand.planner, at_hand.prepared, at_hand.known, at_hand.goal
    arrived = arrival(prepared.reach_set, goal)

    def to_go(nodes: IntArray) -> FloatArray:
        return planner.terminal_cost(prepared.reach_set, nodes, goal, arrived, planner.automaton)

    candidates = price_candidates(
        prepared,
        known.reach,
        known.untouched,
        goal,
        arrived,
        to_go,
        planner.prices,
        at_hand.before,
        known.near.hazards.moving,
    )
    return Priced(candidates, KnownClearances(prepared.paths))


def _priced_and_picked(at_hand: BeforeChoice, able: TurnsAndClimbs) -> Priced:
    """In one compiled call."""
    planner, prepared, known, goal = at_hand.planner, at_hand.prepared, at_hand.known, at_hand.goal
    reach_set, hazards, margin_m = prepared.reach_set, known.near.hazards, known.near.margin_m
    positive("safety margin", margin_m)
    arrived = _arrived(prepared, goal)
    ends = complete_ends(prepared, goal, arrived)
    found = chosen(
        reach_set.states,
        reach_set.length_m,
        reach_set.start_pitch_rad,
        ends,
        goal,
        able,
        arrived.reached,
        grazing_of(arrived, goal),
        log_ratings(known.reach, ends.nodes),
        known.untouched,
        view_of(goal, prepared),
        weights_of(planner.prices, at_hand.before, prepared),
        ratings_of(prepared, known.reach, planner.settings.threshold),
        prepared.paths,
        hazards.bins,
        hazards.shapes,
        hazards.moving,
        margin_m,
        prepared.loiter,
    )
    if not found.priced:
        raise not_finite(found.candidates.cost_m)
    looked = KnownClearances(prepared.paths)
    looked.note(hazards, margin_m, found.known)
    grounds = Grounds(prepared, known.reach, hazards)
    best = choice_of(grounds, found.candidates, found.picked, margin_m, looked)
    return Priced(found.candidates, looked, best)


def _arrived(prepared: PreparedReachSet, goal: Goal) -> Arrival:
    """Which paths come to the goal; of one that is farther than any leads, nothing is measured."""
    if length_of(goal.target_m) <= SURELY * (prepared.reach_m + goal.reach_radius_m):
        return arrival(prepared.reach_set, goal)
    nodes = prepared.reach_set.nodes
    nowhere = np.zeros(nodes, dtype=np.bool_)
    return Arrival(nowhere, nowhere, np.full(nodes, np.inf))
