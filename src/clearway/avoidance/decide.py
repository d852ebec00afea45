"""One decision: see, inflate, fuse, rate, cost, verify and choose, escape, explain. Start here.

`decide` is the whole cycle in the paper's order. Each step is Python that calls compiled loops, and
a user's own rating, cost or rule is called at its place. It knows no files, clocks or sensors'
drivers: `live.AvoidanceSystem` feeds it in flight, `sim.simulate` in closed loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from clearway.avoidance.choose.candidates import Commitment, price_candidates
from clearway.avoidance.choose.chosen import Choice
from clearway.avoidance.choose.fall_back import FallBack
from clearway.avoidance.choose.from_here import FromHere, near_from, prepare_here
from clearway.avoidance.choose.in_force import InForce, in_force
from clearway.avoidance.choose.leaving import Leaving, Taken
from clearway.avoidance.choose.passing import note_passing, passings_after
from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.decision import Decision
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.evidence import InReach, evidence_of, intruder_cells
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.rated import Rated
from clearway.avoidance.plan.situation import Situation, goal_of
from clearway.avoidance.rate.fusion import assess_cells
from clearway.avoidance.rate.reach_rating import rate_reach_set
from clearway.base.checks import kind_of
from clearway.base.errors import ClearwayError

MANOEUVRE_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
"""How much of what intruders may do is kept clear of, the most that leaves a way."""


def decide(
    planner: Planner, situation: Situation, *, commitment: Commitment | None = None
) -> Decision:
    """Return what to fly at one decision time, and why: (4.7), (4.19), (4.20), (4.6).

    Parameters
    ----------
    planner
        What stays the same from decision to decision: reach sets, costs, settings, rules.
    situation
        All that is known at the decision time.
    commitment
        What the last decision binds this one to; None binds to nothing.

    Returns
    -------
    Decision
        Movements and path, world frame, with everything that they were derived from.

    Raises
    ------
    ClearwayError
        For detections of another grid, for costs or a margin that are no finite numbers, and for
        a user's own rating, cost or rule that fails.

    Examples
    --------
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
    kind_of("decide: planner", planner, Planner)
    kind_of("decide: situation", situation, Situation)
    if commitment is not None:
        kind_of("decide: commitment", commitment, Commitment)
    _check_grids(planner, situation)
    before, settings = commitment or Commitment(), planner.settings
    # What can be flown from here, where to, and what stands and moves around.
    prepared = prepare_here(planner, situation)
    goal = goal_of(situation, stays_level=planner.automaton.stays_level)
    near = near_from(planner, situation, prepared)
    # Sense and inflate: what sensors, map and intruders say of every cell, (5.36) to (5.53), and
    # the cells that the margin around points and shapes reaches into (def. 5, def. 6).
    evidence = evidence_of(planner, situation, near, intruder_cells(planner, near))
    # Fuse: how safe every cell is, (4.17), (5.54).
    cells = assess_cells(evidence, planner.cell_rating, settings.unknown, settings.unknown_unseen)
    # Rate: how safe every trajectory is (4.21), (4.22), (4.23), and what it leaves (2.3).
    reach = rate_reach_set(prepared.reach_set, cells.rating, planner.threshold)
    rated = Rated(prepared, near, cells, reach)
    # Costs: stage costs, cost to go and risk (4.6); what rules forbid and cost (fig. 7.1).
    rules = in_force(planner, situation, prepared, goal, near, before)
    candidates = price_candidates(planner, rated, goal, before, situation.placed_route)
    # Verify and choose, the cheapest first, among what leaves an escape; else fly the one held.
    ways = _ways_out(planner, situation, near, before)
    leaving = Leaving(planner, rated, candidates, rules.ruling, goal, ways, before)
    taken = _choose_taken(leaving)
    # Explain: what was taken, with all that it was taken from.
    return _decision(situation, rules, leaving, taken)


def _check_grids(planner: Planner, situation: Situation) -> None:
    for detection in situation.detections:
        if detection.grid is not planner.grid and detection.grid.shape != planner.grid.shape:
            raise ClearwayError(
                f"detection {detection.sensor}: has cells {list(detection.grid.shape)}, "
                f"the planner's grid {list(planner.grid.shape)}"
            )


def _ways_out(
    planner: Planner, situation: Situation, near: InReach, before: Commitment
) -> WaysOut | None:
    """Escapes of this moment; None where none is asked for."""
    if planner.escapes is None:
        return None
    return WaysOut(planner, planner.escapes, situation, near, before.under_way)


def _choose_taken(leaving: Leaving) -> Taken:
    """What is flown: the best that leaves an escape, or else the escape that is held."""
    hazards, ways = leaving.rated.hazards, leaving.ways
    if ways is None:
        return choose_for_manoeuvres(hazards, leaving.choose)
    fall_back = FallBack(leaving, ways)
    taken = fall_back.stay() or choose_for_manoeuvres(hazards, leaving.choose)
    return fall_back.look_all_round(taken if taken.good else fall_back.instead_of(taken))


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


def _decision(situation: Situation, rules: InForce, leaving: Leaving, taken: Taken) -> Decision:
    """What was taken, with all that it was taken from."""
    rated, before, finishes = leaving.rated, leaving.before, taken.finishes
    choice, near = taken.choice.with_rule_notes(), rated.near
    movements = rated.prepared.reach_set.movements_to(choice.node)
    if finishes:
        movements, within_s = (finishes.movement,), finishes.left_s
    else:
        within_s = _decide_within(leaving, choice)
    return Decision(
        state=situation.state,
        choice=replace(choice, rules=note_passing(choice.rules)) if choice.rules else choice,
        movements=movements,
        goal=leaving.goal,
        margin_m=near.margin_m,
        found_again=FromHere(leaving.planner, situation.without_readings),
        under_way_s=finishes.left_s if finishes else None,
        decide_within_s=within_s,
        intruders=near.intruders.names,
        passings=passings_after(before.passings, rules.met, near.frame, choice.node, near.margin_m),
        way_out=taken.way_out,
        no_way_out=taken.banned,
        wind_mps=situation.wind_mps,
        long_range=None if rules.afar is None else rules.afar.describe_node(choice.node),
        ways=leaving.ways if leaving.planner.automaton.has_inertia else None,
    )


def _decide_within(leaving: Leaving, choice: Choice) -> float:
    """Time for which the plan may be flown without a new decision (section 6.4, item 6).

    What lies beyond the grid is unknown, so a decision is due while the vehicle can still stop or
    turn away inside it; with evidence in reach, and where an escape has to be seen, at the end of
    the movement.
    """
    planner, prepared, near = leaving.planner, leaving.prepared, leaving.rated.near
    reach_set, hazards, ways = prepared.reach_set, near.hazards, leaving.ways
    strict = ways is not None and ways.strict
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
