"""One decision: see, fuse, rate, verify, choose, explain. Start reading here.

`decide` is the whole cycle in the paper's order. It knows no files, clocks or sensors' drivers:
`system.AvoidanceSystem` feeds it in flight, `simulation` in closed loop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.costs import Goal, arrival
from clearway.decision import (
    Candidates,
    Choice,
    Commitment,
    Repertoire,
    choose,
    choose_by_rules,
    price_candidates,
)
from clearway.evidence import gather_evidence, hazards_of
from clearway.frames import FloatArray
from clearway.fusion import (
    CellAssessment,
    ReachAssessment,
    assess_cells,
    rate_reach_set,
    untouched,
)
from clearway.hazards import Hazards
from clearway.intruders import up_seen_from
from clearway.planner import Planner
from clearway.rules import RuleView, rule_on
from clearway.situation import Situation, goal_of, grid_frame, margin_m
from clearway.state import IntArray, State

NO_ROLL = np.array([0.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Decision:
    """What to fly and why, with everything that it was derived from."""

    state: State
    choice: Choice
    movements: tuple[str, ...]
    """The movement buffer to execute."""
    path_m: FloatArray
    """[points, 3] planned path, world frame, from the vehicle's position."""
    goal: Goal
    margin_m: float
    cells: CellAssessment
    reach: ReachAssessment
    repertoire: Repertoire
    hazards: Hazards
    decide_within_s: float
    """Latest moment for the next decision: later, the vehicle could no longer turn away."""
    intruders: tuple[str, ...] = ()
    """Names of the movers in `hazards`."""


def decide(
    planner: Planner, situation: Situation, commitment: Commitment | None = None
) -> Decision:
    """Fuse, rate, verify and choose at one decision time, (4.19), (4.20), (4.6)."""
    settings, grid = planner.settings, planner.grid
    position, world_from_grid = grid_frame(situation.state)
    margin = margin_m(settings, situation)

    seen_from = replace(situation.state, attitude_rad=situation.state.attitude_rad * NO_ROLL)
    rotation = seen_from.world_from_body
    intruders = [intruder.seen_at(seen_from, rotation) for intruder in situation.intruders]
    hazards = hazards_of(planner, situation, intruders, margin)
    up = up_seen_from(seen_from)
    evidence = gather_evidence(grid, situation.detections, hazards, margin, intruders, settings, up)
    cells = assess_cells(
        evidence, planner.cell_rating, settings.unknown, settings.unknown_unseen
    )  # (4.17), (5.54)

    repertoire = planner.repertoire(float(situation.state.attitude_rad[1]))
    reach = rate_reach_set(repertoire.reach_set, cells.rating, settings.threshold)  # (4.22), (4.23)
    clear = untouched(repertoire.reach_set, evidence.coated)  # def. 6

    goal = goal_of(situation)
    arrived = arrival(repertoire.reach_set, goal)

    def to_go(nodes: IntArray) -> FloatArray:
        return planner.terminal_cost(repertoire.reach_set, nodes, goal, arrived, planner.automaton)

    candidates = price_candidates(
        repertoire,
        reach,
        clear,
        goal,
        arrived,
        to_go,
        settings.prices,
        commitment or Commitment(),
        hazards.movers,
    )  # (4.6)
    names = tuple(intruder.name for intruder in intruders)

    def choose_among(candidates: Candidates) -> Choice:
        return choose(
            repertoire,
            reach,
            candidates,
            hazards,
            margin_m=margin,
            threshold=settings.threshold,
            verify=settings.verify,
        )

    ruling = None
    if planner.rules:
        ruling = rule_on(planner.rules, _rule_view(planner, situation, goal, hazards, names))
    if ruling is None:
        choice = choose_among(candidates)
    else:
        choice = choose_by_rules(ruling, candidates, choose_among)  # fig. 7.1
    path = _path(repertoire, choice.node) @ world_from_grid.T + position
    return Decision(
        state=situation.state,
        choice=choice,
        movements=repertoire.reach_set.movements_to(choice.node),
        path_m=path,
        goal=goal,
        margin_m=margin,
        cells=cells,
        reach=reach,
        repertoire=repertoire,
        hazards=hazards,
        decide_within_s=_decide_within(planner, repertoire, choice, hazards, margin),
        intruders=names,
    )


def _rule_view(
    planner: Planner, situation: Situation, goal: Goal, hazards: Hazards, names: tuple[str, ...]
) -> RuleView:
    """What the rules of a decision see."""
    start = situation.state.position_m if situation.from_m is None else situation.from_m
    route = [start, situation.target_m]
    if situation.next_m is not None:
        route.append(situation.next_m)
    return RuleView(
        planner.repertoire(float(situation.state.attitude_rad[1])).reach_set,
        situation.state,
        goal,
        np.array(route),
        margin_m(planner.settings, situation),
        planner.speed_mps,
        hazards.movers,
        names,
    )


def _path(repertoire: Repertoire, node: int) -> FloatArray:
    """[points, 3] samples of a path in the grid frame, from the origin."""
    reach_set = repertoire.reach_set
    return np.concatenate([np.zeros((1, 3)), *reach_set.samples_m[reach_set.path(node)]])


def _decide_within(
    planner: Planner, repertoire: Repertoire, choice: Choice, hazards: Hazards, margin: float
) -> float:
    """Time for which the plan may be flown without a new decision (6.4, item 6).

    What lies beyond the grid is unknown, so a decision is due while the vehicle can still stop or
    turn away inside it; with evidence in reach, at the end of the movement.
    """
    reach_set = repertoire.reach_set
    first = reach_set.path(choice.node)[0]
    one_movement = float(reach_set.end_time_s[first])
    in_reach = len(hazards.points.radius_m) + len(hazards.shapes.radius_m)
    if in_reach or len(hazards.movers.radius_m):
        return one_movement
    reaction_m = min(planner.automaton.turning_radius_m, planner.grid.range_m) + margin
    speed = repertoire.step_m / one_movement
    free = (planner.grid.range_m - reaction_m) / max(speed, 1e-9)
    plan = float(reach_set.end_time_s[choice.node])
    return max(one_movement, min(plan, free))
