"""What is at hand before anything is rated, and what it makes of the trajectories.

An ordinary decision rates cells and trajectories, prices its candidates and picks the first that
passes in one compiled call (`cycle.decided`). Where ratings or costs are a user's own, rules are in
force, or something else has a price that few decisions ask for, these are steps of their own, and
candidates are picked from as whoever asks says.
"""

from __future__ import annotations

from typing import NamedTuple

from clearway.avoidance.assess import Assessment, KnownCells, assess_near
from clearway.avoidance.candidates import (
    Candidates,
    Commitment,
    complete_ends,
    grazing_of,
    not_finite,
    price_candidates,
    weights_of,
)
from clearway.avoidance.choice import choice_of
from clearway.avoidance.chosen import Choice, Grounds
from clearway.avoidance.costs import TurnsAndClimbs
from clearway.avoidance.cycle import Decided, decided
from clearway.avoidance.evidence import InReach, Sources, sources_but_sensors, sources_of
from clearway.avoidance.fusion import total
from clearway.avoidance.goal import Arrival, Goal, arrival
from clearway.avoidance.planner import Planner
from clearway.avoidance.prepared import PreparedReachSet
from clearway.avoidance.reach_rating import ReachAssessment
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.situation import Situation
from clearway.avoidance.verify import KnownClearances
from clearway.base.checks import positive
from clearway.base.frames import FloatArray, length_of
from clearway.base.state import IntArray
from clearway.sensors.detection import scan_of
from clearway.sensors.placing import scan_of_nothing
from clearway.traffic import IntruderCells

SURELY = 1.0 + 1e-6
"""Times as far as anything comes, where rounding must not count."""


class BeforeChoice(NamedTuple):
    """All that is known at a decision before anything is rated."""

    planner: Planner
    situation: Situation
    before: Commitment
    prepared: PreparedReachSet
    """What can be flown from here."""
    near: InReach
    intruders: tuple[IntruderCells, ...]
    """What they mean for the cells."""
    goal: Goal


class Priced(NamedTuple):
    """What can be chosen from, and what is known of it."""

    known: Assessment
    candidates: Candidates
    looked: KnownClearances
    best: Choice | None = None
    """The best of all, clear of all that is around; None where nobody has looked yet."""


def priced(at_hand: BeforeChoice, ruling: Ruling | None) -> Priced:
    """What all is rated (4.17)-(4.23), the complete trajectories with their costs (4.6), and the
    best of them where no rule has a say."""
    able = at_hand.planner.turns_and_climbs
    if able is not None and ruling is None and _is_ordinary(at_hand):
        return _decided_in_one(at_hand, able)
    return priced_in_steps(at_hand)


def _is_ordinary(at_hand: BeforeChoice) -> bool:
    """Whether nothing has a price, or a say, that few decisions ask for."""
    planner, before, moving = at_hand.planner, at_hand.before, at_hand.near.hazards.moving
    if not planner.settings.verify or before.stood > 1 or before.stays:
        return False
    if planner.cell_rating is not total:
        return False
    if not len(moving.radius_m):
        return True
    return not (planner.prices.ahead > 0.0 or any(moving.manoeuvre_mps2.tolist()))


def priced_in_steps(at_hand: BeforeChoice) -> Priced:
    """The same, loop by loop, with whatever has a price; nothing is picked."""
    planner, prepared, goal = at_hand.planner, at_hand.prepared, at_hand.goal
    near, reach_set = at_hand.near, prepared.reach_set
    known = assess_near(planner, at_hand.situation, near, at_hand.intruders, reach_set)
    arrived = arrival(reach_set, goal)

    def to_go(nodes: IntArray) -> FloatArray:
        return planner.terminal_cost(reach_set, nodes, goal, arrived, planner.automaton)

    candidates = price_candidates(
        prepared,
        known.reach,
        known.untouched,
        goal,
        arrived,
        to_go,
        planner.prices,
        at_hand.before,
        near.hazards.moving,
    )
    return Priced(known, candidates, KnownClearances(prepared.paths))


def _decided_in_one(at_hand: BeforeChoice, able: TurnsAndClimbs) -> Priced:
    """In one compiled call."""
    planner, prepared, near, goal = at_hand.planner, at_hand.prepared, at_hand.near, at_hand.goal
    settings, hazards, margin_m = planner.settings, near.hazards, near.margin_m
    positive("safety margin", margin_m)
    scan = scan_of(at_hand.situation.detections, planner.grid)
    if scan is None:
        sources = sources_of(planner, at_hand.situation, near, at_hand.intruders)
    else:
        sources = sources_but_sensors(planner, near, at_hand.intruders)
    arrived = _arrived(prepared, goal)
    found = decided(
        scan is not None,
        scan or scan_of_nothing(planner.grid),
        sources,
        hazards.points,
        hazards.shapes,
        hazards.moving,
        margin_m,
        float(settings.unknown),
        float(settings.unknown_unseen),
        float(settings.threshold),
        prepared.ways,
        complete_ends(prepared, goal, arrived),
        goal,
        arrived.reached,
        grazing_of(arrived, goal),
        able,
        weights_of(planner.prices, at_hand.before, prepared),
    )
    if not found.priced:
        raise not_finite(found.candidates.cost_m)
    hazards.note_bins(found.bins)
    known = _known(at_hand, sources, found)
    looked = KnownClearances(prepared.paths)
    looked.note(hazards, margin_m, found.known)
    grounds = Grounds(prepared, known.reach, hazards)
    best = choice_of(grounds, found.candidates, found.picked, margin_m, looked)
    return Priced(known, found.candidates, looked, best)


def _known(at_hand: BeforeChoice, sources: Sources, found: Decided) -> Assessment:
    """What was assessed on the way."""
    planner, near = at_hand.planner, at_hand.near
    told = Sources(found.detected, found.visibility, found.seen, *sources[3:])
    cells = KnownCells(planner, near, told)
    reach = ReachAssessment(
        found.node_rating,
        found.feasibility,
        at_hand.prepared.reach_set,
        cells.rating,
        float(planner.settings.threshold),
    )
    return Assessment(near, at_hand.intruders, cells, reach, found.untouched)


def _arrived(prepared: PreparedReachSet, goal: Goal) -> Arrival:
    """Which paths come to the goal; of one that is farther than any leads, nothing is measured."""
    if length_of(goal.target_m) <= SURELY * (prepared.reach_m + goal.reach_radius_m):
        return arrival(prepared.reach_set, goal)
    return prepared.leads_nowhere
