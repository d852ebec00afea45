"""One decision: see, fuse, rate, verify, choose, explain. Start reading here.

`decide` is the whole cycle in the paper's order. It knows no files, clocks or sensors' drivers:
`system.AvoidanceSystem` feeds it in flight, `simulation` in closed loop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.avoidance.choice import (
    Candidates,
    Choice,
    Commitment,
    PreparedReachSet,
    choose,
    choose_by_rules,
    price_candidates,
    reach_of,
)
from clearway.avoidance.costs import Goal, arrival
from clearway.avoidance.evidence import gather_evidence, hazards_of
from clearway.avoidance.fusion import (
    CellAssessment,
    Evidence,
    ReachAssessment,
    assess_cells,
    rate_reach_set,
    untouched,
)
from clearway.avoidance.hazards import Hazards
from clearway.avoidance.planner import Planner
from clearway.avoidance.rules import RuleView, rule_on
from clearway.avoidance.situation import (
    Situation,
    goal_of,
    grid_frame,
    margin_m,
    margin_slope,
)
from clearway.avoidance.verify import sloping
from clearway.base.brief import one_line, runs
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import BoolArray, IntArray, State
from clearway.traffic import Intruder, up_seen_from
from clearway.traffic.models.many import seen_at

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
    prepared: PreparedReachSet
    hazards: Hazards
    decide_within_s: float
    """Latest moment for the next decision: later, the vehicle could no longer turn away."""
    intruders: tuple[str, ...] = ()
    """Names of the moving in `hazards`."""

    def __repr__(self) -> str:
        return one_line("Decision", (runs(self.movements), *self._facts.values()))

    def _repr_html_(self) -> str:
        """For notebooks: what is flown and why, and the plan and the returns from above."""
        position, world_from_grid = grid_frame(self.state)
        seen = self.hazards.points.position_m @ world_from_grid.T + position
        marks = [Marks(seen, "#c0392b", joined=False), Marks(self.path_m, "#d62728")]
        return html_table(runs(self.movements), self._facts, sketch_from_above(marks))

    @property
    def _facts(self) -> dict[str, str]:
        choice = self.choice
        return {
            "clearance": f"{choice.clearance_m:.2f} m clear of {self.margin_m:.2f} m asked",
            "rating": f"rating {choice.rating:.3f}",
            "basis": str(choice.basis),
        }


def decide(
    planner: Planner, situation: Situation, commitment: Commitment | None = None
) -> Decision:
    """Fuse, rate, verify and choose at one decision time: (4.7), (4.19), (4.20), (4.6).

    Raises ClearwayError for detections of another grid, and for costs or a margin that are no
    finite numbers.
    """
    settings = planner.settings
    _check_grids(planner, situation)
    margin = margin_m(settings, situation)
    prepared = planner.prepared_at(situation.state)
    prepared = with_slope(prepared, margin_slope(settings, situation))
    seen = _see(planner, situation, margin, prepared.reach_m)
    cells = assess_cells(
        seen.evidence, planner.cell_rating, settings.unknown, settings.unknown_unseen
    )  # (4.17), (5.54)

    reach = rate_reach_set(prepared.reach_set, cells.rating, settings.threshold)  # (4.22), (4.23)
    clear = untouched(prepared.reach_set, seen.evidence.coated)  # def. 6

    goal = goal_of(situation, stays_level=planner.automaton.stays_level)
    candidates = _candidates(planner, prepared, reach, clear, goal, commitment, seen.hazards)

    def choose_among(candidates: Candidates) -> Choice:
        return choose(
            prepared,
            reach,
            candidates,
            seen.hazards,
            margin_m=margin,
            threshold=settings.threshold,
            verify=settings.verify,
        )

    ruling = None
    if planner.rules:
        ruling = rule_on(planner.rules, _rule_view(planner, situation, prepared, goal, seen))
    if ruling is None:
        choice = choose_among(candidates)
    else:
        choice = choose_by_rules(ruling, candidates, choose_among)  # fig. 7.1
    position, world_from_grid = grid_frame(situation.state)
    return Decision(
        state=situation.state,
        choice=choice,
        movements=prepared.reach_set.movements_to(choice.node),
        path_m=_path(prepared, choice.node) @ world_from_grid.T + position,
        goal=goal,
        margin_m=margin,
        cells=cells,
        reach=reach,
        prepared=prepared,
        hazards=seen.hazards,
        decide_within_s=_decide_within(planner, prepared, choice, seen.hazards, margin),
        intruders=seen.intruders,
    )


class _Seen(NamedTuple):
    """What is known about the surroundings at a decision."""

    hazards: Hazards
    evidence: Evidence
    intruders: tuple[str, ...]
    """Names of the moving in `hazards`."""


class InReach(NamedTuple):
    """What is around, in the grid's frame."""

    hazards: Hazards
    intruders: list[Intruder]
    up: FloatArray
    """[3] world up."""


def in_reach(
    planner: Planner, situation: Situation, margin: float, reach_m: float | None = None
) -> InReach:
    """Bring map, returns and intruders into the grid's frame.

    reach_m: how far trajectories lead; None for the farthest of the planner's.
    """
    state = situation.state
    seen_from = replace(state, attitude_rad=state.attitude_rad * NO_ROLL)
    intruders = seen_at(situation.intruders, seen_from, seen_from.world_from_body)
    hazards = hazards_of(planner, situation, intruders, margin, reach_m)
    return InReach(hazards, intruders, up_seen_from(seen_from))


def _see(planner: Planner, situation: Situation, margin: float, reach_m: float) -> _Seen:
    """What is around, in the grid's frame and in its cells."""
    hazards, intruders, up = in_reach(planner, situation, margin, reach_m)
    evidence = gather_evidence(
        planner.grid,
        situation.detections,
        hazards,
        margin,
        intruders,
        planner.settings,
        up,
    )
    return _Seen(hazards, evidence, tuple(intruder.name for intruder in intruders))


def _candidates(
    planner: Planner,
    prepared: PreparedReachSet,
    reach: ReachAssessment,
    clear: BoolArray,
    goal: Goal,
    commitment: Commitment | None,
    hazards: Hazards,
) -> Candidates:
    """The complete trajectories with their costs, (4.6)."""
    arrived = arrival(prepared.reach_set, goal)

    def to_go(nodes: IntArray) -> FloatArray:
        return planner.terminal_cost(prepared.reach_set, nodes, goal, arrived, planner.automaton)

    return price_candidates(
        prepared,
        reach,
        clear,
        goal,
        arrived,
        to_go,
        planner.settings.prices,
        commitment or Commitment(),
        hazards.moving,
    )


def _check_grids(planner: Planner, situation: Situation) -> None:
    for detection in situation.detections:
        if detection.grid.shape != planner.grid.shape:
            raise ClearwayError(
                f"detection {detection.sensor}: has cells {list(detection.grid.shape)}, "
                f"the planner's grid {list(planner.grid.shape)}"
            )


def _rule_view(
    planner: Planner, situation: Situation, prepared: PreparedReachSet, goal: Goal, seen: _Seen
) -> RuleView:
    """What the rules of a decision see."""
    start = situation.state.position_m if situation.from_m is None else situation.from_m
    route = [start, situation.target_m]
    if situation.next_m is not None:
        route.append(situation.next_m)
    return RuleView(
        prepared.reach_set,
        situation.state,
        goal,
        np.array(route),
        margin_m(planner.settings, situation),
        planner.speed_mps,
        seen.hazards.moving,
        seen.intruders,
    )


def with_slope(prepared: PreparedReachSet, slope: float) -> PreparedReachSet:
    """The reach set to be verified with a margin that grows with the distance from the vehicle."""
    if slope <= 0.0:
        return prepared
    paths = sloping(prepared.paths, slope)
    return replace(prepared, paths=paths, reach_m=reach_of(paths, prepared.reach_set.grid.range_m))


def _path(prepared: PreparedReachSet, node: int) -> FloatArray:
    """[points, 3] samples of a path in the grid frame, from the origin."""
    reach_set = prepared.reach_set
    return np.concatenate([np.zeros((1, 3)), *reach_set.samples_m[reach_set.path(node)]])


def _decide_within(
    planner: Planner, prepared: PreparedReachSet, choice: Choice, hazards: Hazards, margin: float
) -> float:
    """Time for which the plan may be flown without a new decision (section 6.4, item 6).

    What lies beyond the grid is unknown, so a decision is due while the vehicle can still stop or
    turn away inside it; with evidence in reach, at the end of the movement.
    """
    reach_set = prepared.reach_set
    first = reach_set.path(choice.node)[0]
    one_movement = float(reach_set.end_time_s[first])
    in_reach = len(hazards.points.radius_m) + len(hazards.shapes.radius_m)
    if in_reach or len(hazards.moving.radius_m):
        return one_movement
    reaction_m = min(planner.automaton.turning_radius_m, planner.grid.range_m) + margin
    speed = prepared.step_m / one_movement
    free = (planner.grid.range_m - reaction_m) / max(speed, 1e-9)
    plan = float(reach_set.end_time_s[choice.node])
    return max(one_movement, min(plan, free))
