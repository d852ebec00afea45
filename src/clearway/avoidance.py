"""One decision: see, fuse, rate, verify, choose, explain. Start reading here.

`decide` is the whole cycle in the paper's order. It knows no files, clocks or sensors' drivers:
`system.AvoidanceSystem` feeds it in flight, `simulation` in closed loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.costs import (
    Goal,
    Prices,
    StageCost,
    TerminalCost,
    arrival,
    curved_distance_to_go,
    length_and_prices,
)
from clearway.decision import (
    Candidates,
    Choice,
    Commitment,
    Repertoire,
    choose,
    choose_by_rules,
    price_candidates,
)
from clearway.errors import ClearwayError
from clearway.frames import FloatArray, world_from_body
from clearway.fusion import (
    CellAssessment,
    Evidence,
    Rating,
    ReachAssessment,
    assess_cells,
    rate_reach_set,
    rating_named,
    untouched,
)
from clearway.grid import AvoidanceGrid
from clearway.hazards import Hazards, MovingHazards, PointHazards, no_movers, no_shapes
from clearway.intruders import Intruder, assess_intruders, up_seen_from
from clearway.map_cells import base_probability
from clearway.map_cells import coated_cells as coated_by_map
from clearway.movements import MovementAutomaton
from clearway.obstacle_map import ObstacleMap
from clearway.obstacles import Shapes
from clearway.reach.store import ReachLibrary
from clearway.rules import MOST_RULES, Rule, RuleView, rule_on
from clearway.sensors import Detection, combine_detections, combine_rule_named, thin_points
from clearway.sensors import coated_cells as coated_by_points
from clearway.state import IntArray, State

NO_SHAPES = no_shapes()
NO_ROLL = np.array([0.0, 1.0, 1.0])
PLANNED_REACH = 0.9
"""Share of the reach radius that plans aim for, so that flying them does not just miss it."""
THINNING = 0.1
"""Voxels in which points are merged before verification, as a share of the margin."""


@dataclass(frozen=True, slots=True)
class AvoidanceSettings:
    """How decisions are taken; defaults are those of the paper's static mission."""

    rating: str = "total"
    unknown: float = 0.0
    """How far hidden space counts as blocked, u in [0, 1]."""
    unknown_unseen: float = 1.0
    """The same for columns that no beam looks into."""
    threshold: float = 0.3
    """P_R that a trajectory must have."""
    verify: bool = True
    """Hold candidates against the evidence itself; without, cell ratings alone decide."""
    safety_margin_m: float = 0.6
    """From the vehicle's centre to any obstacle's surface."""
    sigmas: float = 3.0
    """Standard deviations of the own position by which the margin grows."""
    own_drift_mps: float = 0.05
    """Growth of the margin with the age of the own state."""
    point_sigmas: float = 2.0
    """Standard deviations of the range by which a hit point grows."""
    intruder_models: tuple[str, ...] = ("line", "spread")
    sensor_fusion: str = "conjunction"
    """How several sensors become one: (5.38), or weighted by precision and trust."""
    prices: Prices = field(default_factory=Prices)

    def __post_init__(self) -> None:
        rating_named(self.rating)
        combine_rule_named(self.sensor_fusion)
        for name in ("unknown", "unknown_unseen", "threshold"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ClearwayError(f"{name}: {getattr(self, name)} is not within [0, 1]")
        for name in ("safety_margin_m", "sigmas", "own_drift_mps", "point_sigmas"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ClearwayError(f"{name}: {getattr(self, name)} is not a number >= 0")
        if self.safety_margin_m == 0.0:
            raise ClearwayError("safety_margin_m: must be above 0")


@dataclass(frozen=True, eq=False)
class Planner:
    """What stays the same from decision to decision: reach sets, costs, settings."""

    automaton: MovementAutomaton
    grid: AvoidanceGrid
    repertoires: tuple[tuple[float, Repertoire], ...]
    """(start pitch, reach set with its costs), ascending."""
    settings: AvoidanceSettings
    terminal_cost: TerminalCost = curved_distance_to_go
    rules: tuple[Rule, ...] = ()
    """The most important first."""
    rating: Rating | None = None
    """The user's own, in place of the one that the settings name."""

    @classmethod
    def of(
        cls,
        library: ReachLibrary,
        settings: AvoidanceSettings | None = None,
        *,
        stage_cost: StageCost = length_and_prices,
        terminal_cost: TerminalCost = curved_distance_to_go,
        rules: Sequence[Rule] = (),
        rating: Rating | None = None,
    ) -> Planner:
        """Evaluate the costs of (4.6) that do not change; either cost can be the user's own.

        rules: the most important first; see `clearway.rules`. rating: the user's own, in place of
        the one that the settings name.
        """
        settings = settings or AvoidanceSettings()
        if len(rules) > MOST_RULES:
            raise ClearwayError(f"rules: {len(rules)} are too many; at most {MOST_RULES}")
        repertoires = tuple(
            (
                reach_set.start_pitch_rad,
                Repertoire.of(
                    reach_set, settings.prices, stage_cost, library.automaton.turning_radius_m
                ),
            )
            for reach_set in library.reach_sets
        )
        return cls(
            library.automaton,
            library.grid,
            repertoires,
            settings,
            terminal_cost,
            tuple(rules),
            rating,
        )

    @property
    def cell_rating(self) -> Rating:
        """How evidence becomes a rating."""
        return self.rating or rating_named(self.settings.rating)

    @property
    def speed_mps(self) -> float:
        """Fastest speed of the automaton."""
        return max(movement.speed_mps for movement in self.automaton.movements)

    def repertoire(self, pitch_rad: float) -> Repertoire:
        """The reach set whose start pitch is nearest."""
        return min(self.repertoires, key=lambda entry: abs(entry[0] - pitch_rad))[1]


@dataclass(frozen=True, eq=False)
class Situation:
    """All that is known at the decision time, in the world frame unless said otherwise."""

    state: State
    """Expected own state at the decision time; its grid frame leaves out the roll."""
    target_m: FloatArray
    """[3] waypoint to go to."""
    next_m: FloatArray | None = None
    """[3] the waypoint after it; None for the final one."""
    from_m: FloatArray | None = None
    """[3] where the leg to the waypoint began; None for the own position."""
    reach_radius_m: float = 1.5
    detections: Sequence[Detection] = ()
    """One per sensor, in the grid frame; none at all leaves everything visible (4.19)."""
    remembered: PointHazards | None = None
    """Points of all scans up to now, world frame; None takes those of the detections alone."""
    obstacle_map: ObstacleMap | None = None
    intruders: Sequence[Intruder] = ()
    """As reported, each with its own time."""
    state_age_s: float = 0.0
    """Age of the measurement behind `state`."""
    range_sigma_m: float = 0.0
    """Standard deviation of the range, by which all points grow: of the best sensor where the radii
    of the others' points hold the difference, else of the worst."""


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


def grid_frame(state: State) -> tuple[FloatArray, FloatArray]:
    """Origin [3] and rotation [3, 3] (world from grid) of the grid at a state, roll left out."""
    _, pitch, yaw = state.attitude_rad
    return state.position_m, world_from_body([0.0, pitch, yaw])


def decide(
    planner: Planner, situation: Situation, commitment: Commitment | None = None
) -> Decision:
    """Fuse, rate, verify and choose at one decision time, (4.19), (4.20), (4.6)."""
    settings, grid = planner.settings, planner.grid
    position, world_from_grid = grid_frame(situation.state)
    margin = margin_m(settings, situation)

    seen_from = replace(situation.state, attitude_rad=situation.state.attitude_rad * NO_ROLL)
    intruders = [i.at(seen_from.time_s).seen_from(seen_from) for i in situation.intruders]
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


def margin_m(settings: AvoidanceSettings, situation: Situation) -> float:
    """Safety margin grown by the uncertainty and the age of the own state."""
    return (
        settings.safety_margin_m
        + settings.sigmas * situation.state.position_std_m
        + settings.own_drift_mps * max(0.0, situation.state_age_s)
    )


def gather_evidence(
    grid: AvoidanceGrid,
    detections: Sequence[Detection],
    hazards: Hazards,
    margin: float,
    intruders: Sequence[Intruder],
    settings: AvoidanceSettings,
    up: FloatArray,
) -> Evidence:
    """Per-cell evidence of all sources: sensors 5.2 and 5.3, map 5.4, intruders 5.1, coating."""
    free = Evidence.free(grid)
    changes: dict[str, object] = {}
    if detections:
        sensed = combine_detections(detections, settings.sensor_fusion)
        changes |= {
            "detected": sensed.detected,
            "visibility": sensed.visibility,
            "seen": sensed.seen,
        }
    coated = coated_by_points(grid, hazards.points.position_m, hazards.points.radius_m + margin)
    if len(hazards.shapes.radius_m):
        changes["map_base"] = base_probability(hazards.shapes, grid)
        coated = coated | coated_by_map(hazards.shapes, grid, margin)
    if intruders:
        changes["intruder"] = assess_intruders(
            grid, intruders, models=settings.intruder_models, up=up
        ).probability
    return replace(free, coated=coated, **changes)  # type: ignore[arg-type]


def hazards_of(
    planner: Planner, situation: Situation, intruders: Sequence[Intruder], margin: float
) -> Hazards:
    """All that is known to be in reach, in the grid frame, as the intruders are."""
    settings, grid = planner.settings, planner.grid
    position, world_from_grid = grid_frame(situation.state)
    return Hazards(
        _points(situation, settings, position, world_from_grid, grid.range_m + margin),
        _shapes_near(situation, position, world_from_grid, grid),
        _movers(intruders, situation, settings, grid.range_m / planner.speed_mps),
    )


def goal_of(situation: Situation) -> Goal:
    """The waypoints in the level frame of the vehicle."""
    level_from_world = world_from_body([0.0, 0.0, situation.state.attitude_rad[2]]).T
    origin = situation.state.position_m
    target = level_from_world @ (situation.target_m - origin)
    final = situation.next_m is None
    following = (
        target if situation.next_m is None else level_from_world @ (situation.next_m - origin)
    )
    return Goal(target, following, PLANNED_REACH * situation.reach_radius_m, final)


def _shapes_near(
    situation: Situation, position: FloatArray, world_from_grid: FloatArray, grid: AvoidanceGrid
) -> Shapes:
    if situation.obstacle_map is None or not len(situation.obstacle_map):
        return NO_SHAPES
    return situation.obstacle_map.in_grid(position, world_from_grid, grid)


def _points(
    situation: Situation,
    settings: AvoidanceSettings,
    position: FloatArray,
    world_from_grid: FloatArray,
    reach_m: float,
) -> PointHazards:
    """What is remembered, or else the returns at hand merged in voxels; grown by range noise."""
    if situation.remembered is not None:
        place = (situation.remembered.position_m - position) @ world_from_grid
        radius = situation.remembered.radius_m
    else:
        place = np.concatenate([np.zeros((0, 3)), *(d.points_m for d in situation.detections)])
        radius = np.concatenate([np.zeros(0), *(d.radius_m for d in situation.detections)])
        near = np.einsum("ij,ij->i", place, place) <= (reach_m + radius) ** 2
        place, radius = thin_points(place[near], radius[near], THINNING * settings.safety_margin_m)
    return PointHazards(
        np.ascontiguousarray(place), radius + settings.point_sigmas * situation.range_sigma_m
    )


def _movers(
    intruders: Sequence[Intruder],
    situation: Situation,
    settings: AvoidanceSettings,
    horizon_s: float,
) -> MovingHazards:
    """Intruders as balls that grow with time by all that they may deviate.

    intruders: at the decision time, in the grid frame. What a report's age adds is there from the
    start; an acceleration bound counts as growth to what it allows at the horizon.
    """
    if not intruders:
        return no_movers()
    ages = [situation.state.time_s - report.time_s for report in situation.intruders]
    start = [
        intruder.radius_m + report.deviation_m(age, settings.sigmas)
        for intruder, report, age in zip(intruders, situation.intruders, ages, strict=True)
    ]
    growth = [
        np.tan(intruder.spread_rad.max()) * intruder.speed_mps
        + settings.sigmas * intruder.velocity_std_mps
        + 0.5 * (intruder.acceleration_bound_mps2 or 0.0) * horizon_s
        for intruder in intruders
    ]
    return MovingHazards(
        np.array([i.position_m for i in intruders]),
        np.array([i.velocity_mps for i in intruders]),
        np.array(start),
        np.array(growth),
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
