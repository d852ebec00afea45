"""One decision: see, fuse, rate, verify, choose, explain. Start reading here.

`decide` is the whole cycle in the paper's order; what an ordinary one computes, from the returns of
a scan to the node to fly to, is `cycle.decided`. It knows no files, clocks or sensors' drivers:
`live.AvoidanceSystem` feeds it in flight, `sim.simulate` in closed loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from clearway.avoidance.assess import Assessment
from clearway.avoidance.at_hand import BeforeChoice, Priced, priced, priced_in_steps
from clearway.avoidance.candidates import Candidates, Commitment
from clearway.avoidance.choice import choose_by_rules, pick
from clearway.avoidance.chosen import Choice
from clearway.avoidance.costs import price_of
from clearway.avoidance.decision import Decision
from clearway.avoidance.evidence import intruder_cells
from clearway.avoidance.from_here import FromHere, near_from, prepared_from
from clearway.avoidance.hazards import Hazards
from clearway.avoidance.in_force import InForce, in_force, warm_up_rules
from clearway.avoidance.leaving import ChooseAmong, Leaving, Taken
from clearway.avoidance.passing import noted, passings_after
from clearway.avoidance.planner import Planner
from clearway.avoidance.rules.rule import Ruling
from clearway.avoidance.situation import Situation, goal_of
from clearway.avoidance.way_out import Narrow
from clearway.avoidance.ways_out import WaysOut
from clearway.base.errors import ClearwayError

MANOEUVRE_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
"""How much of what intruders may do is kept clear of, the most that leaves a way."""


def decide(
    planner: Planner, situation: Situation, *, commitment: Commitment | None = None
) -> Decision:
    """Fuse, rate, verify and choose at one decision time: (4.7), (4.19), (4.20), (4.6).

    Raises ClearwayError for detections of another grid, and for costs or a margin that are no
    finite numbers.

    >>> import numpy as np
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> tree = cw.ObstacleMap([cw.Obstacle.ball([6.0, 0.5, 0.0], 1.5)])
    >>> here, there = cw.State(np.zeros(3)), np.array([20.0, 0.0, 0.0])
    >>> decision = cw.decide(cw.Planner.of(library), cw.Situation(here, there, obstacle_map=tree))
    >>> bool(decision.choice.clearance_m >= decision.margin_m)
    True
    """
    _check_grids(planner, situation)
    at_hand = _at_hand(planner, situation, commitment or Commitment())
    near, before = at_hand.near, at_hand.before
    rules = in_force(planner, situation, at_hand.prepared, at_hand.goal, near, before)
    found = priced(at_hand, rules.ruling)  # (4.17), (4.22), (4.23), (4.6)
    leaving = _leaving(at_hand, found, _choosing(at_hand, rules.ruling, found))
    taken = _taken(leaving, near.hazards, nothing_leads_on=before.stays)
    return _decision(at_hand, found.known, leaving.ways, rules, taken)


def warm_up_steps(planner: Planner, situation: Situation, *, none_passes: bool = False) -> None:
    """Load the loops that are called one by one where a choice is not made in one call.

    none_passes: as of `choice.pick`.
    """
    at_hand = _at_hand(planner, situation, Commitment())
    found, near, settings = priced_in_steps(at_hand), at_hand.near, planner.settings
    pick(
        at_hand.prepared,
        found.known.reach,
        found.candidates,
        near.hazards,
        margin_m=near.margin_m,
        threshold=settings.threshold,
        verify=settings.verify,
        none_passes=none_passes,
        looked=found.looked,
    )


def warm_up_rare(planner: Planner, situation: Situation) -> None:
    """Load what rules ask for only at times, and what is run where none of them is in force."""
    at_hand = _at_hand(planner, replace(situation, intruders=()), Commitment())
    warm_up_rules(planner, situation, at_hand.prepared, at_hand.goal, at_hand.near)
    priced(at_hand, None)


def _at_hand(planner: Planner, situation: Situation, before: Commitment) -> BeforeChoice:
    """What is around, and what can be flown: all that comes before rating and choice."""
    prepared = prepared_from(planner, situation)
    near = near_from(planner, situation, prepared)
    intruders = intruder_cells(planner, near)  # (5.36)
    goal = goal_of(situation, stays_level=planner.automaton.stays_level)
    return BeforeChoice(planner, situation, before, prepared, near, intruders, goal)


def _check_grids(planner: Planner, situation: Situation) -> None:
    for detection in situation.detections:
        if detection.grid is not planner.grid and detection.grid.shape != planner.grid.shape:
            raise ClearwayError(
                f"detection {detection.sensor}: has cells {list(detection.grid.shape)}, "
                f"the planner's grid {list(planner.grid.shape)}"
            )


def _choosing(at_hand: BeforeChoice, ruling: Ruling | None, found: Priced) -> ChooseAmong:
    """The choice among some candidates clear of some hazards, by a share of the margin."""
    settings, prepared, near = at_hand.planner.settings, at_hand.prepared, at_hand.near

    def pick_clear_of(
        hazards: Hazards, share: float, candidates: Candidates, none_passes: bool = False
    ) -> Choice:
        return pick(
            prepared,
            found.known.reach,
            candidates,
            hazards,
            margin_m=share * near.margin_m,
            threshold=settings.threshold,
            verify=settings.verify,
            none_passes=none_passes,
            looked=found.looked,
        )

    def choose_among(hazards: Hazards, candidates: Candidates, share: float) -> Choice:
        clear_of = partial(pick_clear_of, hazards, share)
        if ruling is None:
            return clear_of(candidates)
        return choose_by_rules(ruling, candidates, clear_of)  # fig. 7.1

    return choose_among


def _leaving(at_hand: BeforeChoice, found: Priced, choose_among: ChooseAmong) -> Leaving:
    """The choice among candidates that leave a way out, as far as one is asked for."""
    planner, before, prepared = at_hand.planner, at_hand.before, at_hand.prepared
    settings, near, ways = planner.settings, at_hand.near, None
    if planner.escapes is not None:
        ways = WaysOut(planner, planner.escapes, at_hand.situation, near, before.under_way)
    allowed = settings.narrow == Narrow.ALLOW and ways is not None and ways.strict
    held = before.way_out
    return Leaving(
        prepared,
        found.known.reach,
        found.candidates,
        choose_among,
        at_hand.goal,
        ways,
        held,
        before.certain_within,
        narrow_price_m=price_of(planner.prices.no_room) * prepared.step_m if allowed else np.inf,
        thin=settings.smallest_object_m is not None,
        had_certain=before.had_certain or (held is not None and held.certain),
        blind=before.blind,
        best=found.best,
        stood=before.stood,
    )


def _taken(leaving: Leaving, hazards: Hazards, *, nothing_leads_on: bool) -> Taken:
    """What is flown: the best that leaves a way out, or else the way out in hand."""
    stay = leaving.stay(hazards, nothing_leads_on=nothing_leads_on)
    taken = stay or choose_for_manoeuvres(hazards, leaving.choose)
    return leaving.look_all_round(taken if taken.good else leaving.fall_back(taken, hazards))


def choose_for_manoeuvres(hazards: Hazards, choose_with: Callable[[Hazards], Taken]) -> Taken:
    """The choice clear of as much as can be of what intruders may do.

    All that an intruder that has turned may do next soon leaves no way at all: then a lesser share
    of it is kept clear of, and its straight way at the least.
    """
    if not any(hazards.moving.manoeuvre_mps2.tolist()):
        return choose_with(hazards)
    tried: list[Taken] = []
    for share in MANOEUVRE_SHARES:
        tried.append(choose_with(hazards.keeping_clear_of(share)))
        if tried[-1].good:
            return tried[-1]
    return tried[0]


def _decision(
    at_hand: BeforeChoice, known: Assessment, ways: WaysOut | None, rules: InForce, taken: Taken
) -> Decision:
    """What was taken, with all that it was taken from."""
    near, prepared = at_hand.near, at_hand.prepared
    choice, finishes = taken.choice, taken.finishes
    movements = prepared.reach_set.movements_to(choice.node)
    if finishes:
        movements, within_s = (finishes.movement,), finishes.left_s
    else:
        within_s = _decide_within(at_hand, choice, strict=ways is not None and ways.strict)
    return Decision(
        state=at_hand.situation.state,
        choice=replace(choice, rules=noted(choice.rules)) if choice.rules else choice,
        movements=movements,
        goal=at_hand.goal,
        margin_m=near.margin_m,
        known=known.known,
        found_again=FromHere(at_hand.planner, at_hand.situation.without_readings),
        under_way_s=finishes.left_s if finishes else None,
        decide_within_s=within_s,
        intruders=near.intruders.names,
        passings=passings_after(
            at_hand.before.passings, rules.met, near.frame, choice.node, near.margin_m
        ),
        way_out=taken.way_out,
        no_way_out=taken.banned,
        wind_mps=at_hand.situation.wind_mps,
        long_range=None if rules.afar is None else rules.afar.told(choice.node),
    )


def _decide_within(at_hand: BeforeChoice, choice: Choice, *, strict: bool) -> float:
    """Time for which the plan may be flown without a new decision (section 6.4, item 6).

    What lies beyond the grid is unknown, so a decision is due while the vehicle can still stop or
    turn away inside it; with evidence in reach, and where a way out has to be seen, at the end of
    the movement.
    """
    planner, prepared, near = at_hand.planner, at_hand.prepared, at_hand.near
    reach_set, hazards = prepared.reach_set, near.hazards
    first = prepared.first_node[choice.node]
    one_movement = float(reach_set.end_time_s[first])
    in_reach = len(hazards.points.radius_m) + len(hazards.shapes.radius_m)
    if in_reach or len(hazards.moving.radius_m) or strict:
        return one_movement
    reaction_m = min(planner.automaton.room_to_turn_m, planner.grid.range_m) + near.margin_m
    speed = prepared.step_m / one_movement
    free = (planner.grid.range_m - reaction_m) / speed
    plan = float(reach_set.end_time_s[choice.node])
    return max(one_movement, min(plan, free))
