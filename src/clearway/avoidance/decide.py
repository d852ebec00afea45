"""One decision: see, fuse, rate, verify, choose, explain. Start reading here.

`decide` is the whole cycle in the paper's order; its first half is `assess_situation`. It knows no
files, clocks or sensors' drivers: `live.AvoidanceSystem` feeds it in flight, `sim.simulate` in
closed loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from clearway.avoidance.assess import Assessment, assess_situation
from clearway.avoidance.candidates import Candidates, Commitment, price_candidates
from clearway.avoidance.choice import choose_by_rules, pick
from clearway.avoidance.chosen import Basis, Choice
from clearway.avoidance.costs import Goal, arrival, price_of
from clearway.avoidance.evidence import InReach
from clearway.avoidance.floor import above_floor
from clearway.avoidance.fusion import CellAssessment, ReachAssessment, untouched
from clearway.avoidance.hazards import Hazards
from clearway.avoidance.leaving import Leaving, Taken
from clearway.avoidance.long_range.resolve import LongRangeChoice
from clearway.avoidance.long_range.two_horizons import LongRange, long_range
from clearway.avoidance.passing import (
    Meetings,
    Passing,
    noted,
    passing_rules,
    passings_after,
)
from clearway.avoidance.planner import Planner
from clearway.avoidance.prepared import PreparedReachSet, reach_of
from clearway.avoidance.rules import RuleView, rule_on
from clearway.avoidance.situation import CALM, Situation, goal_of, margin_slope
from clearway.avoidance.verify import KnownClearances, sloping
from clearway.avoidance.way_out import Escape, Narrow, WayOut
from clearway.avoidance.ways_out import WaysOut, carried_m
from clearway.base.brief import one_line, runs
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.positional import keywords_beyond_two
from clearway.base.state import BoolArray, IntArray, State

MANOEUVRE_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
"""How much of what intruders may do is kept clear of, the most that leaves a way."""


@dataclass(frozen=True, eq=False)
class Decision:
    """What to fly and why, with everything that it was derived from.

    >>> import numpy as np
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> ahead = cw.Situation(cw.State(np.zeros(3)), target_m=np.array([20.0, 0.0, 0.0]))
    >>> decision = cw.decide(cw.Planner.of(library), ahead)
    >>> decision.movements[0], decision.path_m.shape[1], decision.margin_m
    ('Straight', 3, 0.6)
    """

    state: State
    choice: Choice
    movements: tuple[str, ...]
    """The movement buffer to execute."""
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
    passings: tuple[Passing, ...] = ()
    """Which of them are being passed, and on which side."""
    way_out: WayOut | None = None
    """What is flown from the end of the first movement on if no later decision finds better."""
    no_way_out: tuple[str, ...] = ()
    """First movements after which no way out was found."""
    wind_mps: FloatArray = field(default_factory=lambda: CALM)
    """[3] wind that was reckoned with, world frame."""
    long_range: LongRangeChoice | None = None
    """What it comes to in the next minute: side, sense, speed and reason; None where no volumes are
    kept, or nobody is heard of."""
    under_way_s: float | None = None
    """What is left of the first movement, where a decision in the middle of one finds nothing
    better than to finish it and fly the way out; else None."""

    @property
    def escapes(self) -> bool:
        """Whether the way out is what is flown now."""
        return self.choice.basis is Basis.WAY_OUT

    @property
    def goes_narrow(self) -> bool:
        """Whether it leads, as the mission allows, where there is no way out."""
        return self.choice.basis is Basis.NARROW

    @cached_property
    def path_m(self) -> FloatArray:
        """[points, 3] planned path, world frame, from the vehicle's position."""
        reach_set = self.prepared.reach_set
        along = reach_set.samples_m[reach_set.path(self.choice.node)].reshape(-1, 3)
        path = np.zeros((len(along) + 1, 3))
        path[1:] = along
        return self.frame.world_points(path)

    @property
    def tube_m(self) -> FloatArray:
        """[points] within how far of `path_m` the vehicle is to be expected: def. 13.

        0 where nothing was measured of how far flights stray from predictions.
        """
        tube = self.prepared.tube_m
        if tube is None:
            return np.zeros(len(self.path_m))
        ends = np.concatenate([[0.0], tube[self.prepared.reach_set.path(self.choice.node)]])
        samples = self.prepared.reach_set.samples_m.shape[1]
        at = np.arange(len(self.path_m)) / samples
        radii: FloatArray = np.interp(at, np.arange(len(ends)), ends)
        return radii

    @property
    def way_out_path_m(self) -> FloatArray:
        """[points, 3] the way out from where it begins, up to the end of its first round, world
        frame; none where there is no way out."""
        way = self.way_out
        if way is None or not len(way.path_m):
            return np.zeros((0, 3))
        if self.under_way_s is not None:
            return np.concatenate([self.state.position_m[None], way.path_m])
        reach_set = self.prepared.reach_set
        first = reach_set.path(self.choice.node)[0]
        begins = self.frame.world_points(reach_set.samples_m[first, -1:])
        return np.concatenate([begins, way.path_m])

    @cached_property
    def frame(self) -> GridFrame:
        """Where the avoidance grid sits."""
        return GridFrame.of(self.state)

    def __repr__(self) -> str:
        return one_line("Decision", (runs(self.movements), *self._facts.values()))

    def _repr_html_(self) -> str:
        """For notebooks: what is flown and why; plan, way out and returns from above."""
        seen = self.frame.world_points(self.hazards.points.position_m)
        marks = [
            Marks(seen, "#c0392b", joined=False),
            Marks(self.way_out_path_m, "#088c82", dashed=True),
            Marks(self.path_m, "#d62728"),
        ]
        facts = self._facts | self._ways
        return html_table(runs(self.movements), facts, sketch_from_above(marks))

    @property
    def _facts(self) -> dict[str, str]:
        choice = self.choice
        return {
            "clearance": f"{choice.clearance_m:.2f} m clear of {self.margin_m:.2f} m asked",
            "rating": f"rating {choice.rating:.3f}",
            "basis": str(choice.basis),
        }

    @property
    def _ways(self) -> dict[str, str]:
        """What notebooks tell of ways out; nothing where none is asked for."""
        told = {}
        if self.way_out is not None:
            way, round_ = self.way_out, f"then {runs(self.way_out.loop)} again and again"
            kept = f"{way.margin_m:.2f} m clear"
            unsure = "" if way.certain else ", through what nobody has seen"
            begins = f"{runs(way.begins)}, " if way.begins else ""
            told["way out (dashed)"] = f"{begins}{round_}; {kept}{unsure}"
        if self.no_way_out:
            told["no way out after"] = ", ".join(self.no_way_out)
        return told


@keywords_beyond_two
def decide(
    planner: Planner, situation: Situation, commitment: Commitment | None = None
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
    settings = planner.settings
    _check_grids(planner, situation)
    prepared = planner.prepared_at(situation.state)
    escapes = planner.escapes
    if escapes is not None and settings.escape != Escape.KNOWN:
        # It finds room where it is needed, and in all that can be flown.
        prepared = prepared.without_loiter
    if any(situation.wind_mps.tolist()):
        wind_in_grid = situation.frame.world_from_grid.T @ situation.wind_mps
        unsure_mps = settings.sigmas * situation.wind_sigma_mps
        prepared = prepared.in_wind(wind_in_grid, unsure_mps)
    prepared = with_slope(prepared, margin_slope(settings, situation))
    if situation.floor_m > -np.inf:
        above = above_floor(prepared, situation.frame, situation.floor_m)
        prepared = replace(prepared, flyable=prepared.flyable & above)
    known = assess_situation(
        planner,
        situation,
        prepared.reach_set,
        reach_m=max(prepared.reach_m, planner.escape_reach_m + carried_m(planner, situation)),
        horizon_s=planner.horizon_s,
    )  # (4.17), (4.22), (4.23)
    near, margin = known.near, known.near.margin_m
    clear = untouched(prepared.reach_set, known.cells.evidence.coated)  # def. 6

    goal = goal_of(situation, stays_level=planner.automaton.stays_level)
    candidates = _candidates(planner, prepared, known, clear, goal, commitment)

    looked = KnownClearances(prepared.paths)

    def pick_clear_of(
        hazards: Hazards, share: float, candidates: Candidates, none_passes: bool = False
    ) -> Choice:
        return pick(
            prepared,
            known.reach,
            candidates,
            hazards,
            margin_m=share * margin,
            threshold=settings.threshold,
            verify=settings.verify,
            none_passes=none_passes,
            looked=looked,
        )

    def choose_among(hazards: Hazards, candidates: Candidates, share: float) -> Choice:
        clear_of = partial(pick_clear_of, hazards, share)
        if ruling is None:
            return clear_of(candidates)
        return choose_by_rules(ruling, candidates, clear_of)  # fig. 7.1

    names = near.intruders.names
    begun = commitment.passings if commitment else ()
    met = Meetings(prepared.reach_set, near.hazards.moving, names)
    afar = _afar(planner, situation, prepared, goal, commitment)
    rules = planner.rules if afar is None else (*planner.rules, *afar.rules(planner.grid.range_m))
    rules = (*rules, *passing_rules(begun, met)) if names else rules
    ruling = None
    if rules:
        view = _rule_view(planner, situation, prepared, goal, near, names)
        ruling = rule_on(rules, view)

    ways = (
        None
        if escapes is None
        else WaysOut(
            planner, escapes, situation, near, commitment.under_way if commitment else None
        )
    )
    held = None if commitment is None else commitment.way_out
    allowed = settings.narrow == Narrow.ALLOW and ways is not None and ways.strict
    narrow_price_m = price_of(planner.prices.no_room) * prepared.step_m if allowed else np.inf
    leaving = Leaving(
        prepared,
        known.reach,
        candidates,
        choose_among,
        goal,
        ways,
        held,
        None if commitment is None else commitment.certain_within,
        narrow_price_m,
        settings.smallest_object_m is not None,
        commitment is not None and (commitment.had_certain or _certain(commitment.way_out)),
    )
    stays = leaving.stay(near.hazards) if commitment and commitment.stays else None
    taken = stays or choose_for_manoeuvres(near.hazards, leaving.choose)
    if not taken.good:
        taken = leaving.fall_back(taken, near.hazards)
    choice, finishes = taken.choice, taken.finishes
    return Decision(
        state=situation.state,
        choice=replace(choice, rules=noted(choice.rules)) if choice.rules else choice,
        movements=(finishes.movement,)
        if finishes
        else prepared.reach_set.movements_to(choice.node),
        goal=goal,
        margin_m=margin,
        cells=known.cells,
        reach=known.reach,
        prepared=prepared,
        hazards=taken.hazards,
        under_way_s=finishes.left_s if finishes else None,
        decide_within_s=finishes.left_s
        if finishes
        else _decide_within(
            planner,
            prepared,
            choice,
            near.hazards,
            margin,
            strict=ways is not None and ways.strict,
        ),
        intruders=names,
        passings=passings_after(begun, met, near.frame, choice.node, margin),
        way_out=taken.way_out,
        no_way_out=taken.banned,
        wind_mps=situation.wind_mps,
        long_range=None if afar is None else afar.told(choice.node),
    )


def _certain(way: WayOut | None) -> bool:
    return way is not None and way.certain


def _afar(
    planner: Planner,
    situation: Situation,
    prepared: PreparedReachSet,
    goal: Goal,
    commitment: Commitment | None,
) -> LongRange | None:
    """What the next minute says of every trajectory, where volumes are kept."""
    volumes = planner.settings.volumes
    if volumes is None:
        return None
    before = None if commitment is None else commitment.long_range
    heights_m = (planner.settings.lowest_m, planner.settings.highest_m)
    return long_range(
        volumes,
        planner.performance,
        situation,
        prepared.reach_set,
        goal,
        before,
        heights_m=heights_m,
    )


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


def _candidates(
    planner: Planner,
    prepared: PreparedReachSet,
    known: Assessment,
    clear: BoolArray,
    goal: Goal,
    commitment: Commitment | None,
) -> Candidates:
    """The complete trajectories with their costs, (4.6)."""
    arrived = arrival(prepared.reach_set, goal)

    def to_go(nodes: IntArray) -> FloatArray:
        return planner.terminal_cost(prepared.reach_set, nodes, goal, arrived, planner.automaton)

    return price_candidates(
        prepared,
        known.reach,
        clear,
        goal,
        arrived,
        to_go,
        planner.prices,
        commitment or Commitment(),
        known.near.hazards.moving,
    )


def _check_grids(planner: Planner, situation: Situation) -> None:
    for detection in situation.detections:
        if detection.grid.shape != planner.grid.shape:
            raise ClearwayError(
                f"detection {detection.sensor}: has cells {list(detection.grid.shape)}, "
                f"the planner's grid {list(planner.grid.shape)}"
            )


def _rule_view(
    planner: Planner,
    situation: Situation,
    prepared: PreparedReachSet,
    goal: Goal,
    near: InReach,
    names: tuple[str, ...],
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
        near.margin_m,
        planner.speed_mps,
        near.hazards.moving,
        names,
    )


def with_slope(prepared: PreparedReachSet, slope: float) -> PreparedReachSet:
    """The reach set to be verified with a margin that grows with the distance from the vehicle."""
    if slope <= 0.0:
        return prepared
    paths = sloping(prepared.paths, slope)
    return replace(prepared, paths=paths, reach_m=reach_of(paths, prepared.reach_set.grid.range_m))


def _decide_within(
    planner: Planner,
    prepared: PreparedReachSet,
    choice: Choice,
    hazards: Hazards,
    margin: float,
    *,
    strict: bool,
) -> float:
    """Time for which the plan may be flown without a new decision (section 6.4, item 6).

    What lies beyond the grid is unknown, so a decision is due while the vehicle can still stop or
    turn away inside it; with evidence in reach, and where a way out has to be seen, at the end of
    the movement.
    """
    reach_set = prepared.reach_set
    first = prepared.first_node[choice.node]
    one_movement = float(reach_set.end_time_s[first])
    in_reach = len(hazards.points.radius_m) + len(hazards.shapes.radius_m)
    if in_reach or len(hazards.moving.radius_m) or strict:
        return one_movement
    reaction_m = min(planner.automaton.room_to_turn_m, planner.grid.range_m) + margin
    speed = prepared.step_m / one_movement
    free = (planner.grid.range_m - reaction_m) / speed
    plan = float(reach_set.end_time_s[choice.node])
    return max(one_movement, min(plan, free))
