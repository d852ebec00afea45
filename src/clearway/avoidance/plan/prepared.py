"""A reach set with all that decisions need of it: paths, costs, room to circle, worked out once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.loiter import NO_LOITER, LoiterCircles, loiter_circles
from clearway.avoidance.clear.verify import Paths, paths_of
from clearway.avoidance.plan.costs import Prices, StageCost, length_and_prices, price_of
from clearway.avoidance.rate.goal import Arrival, Goal
from clearway.base.arrays import Bools, Floats, Ints
from clearway.base.brief import brief
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import RANGE_TOLERANCE
from clearway.base.state import BoolArray, IntArray
from clearway.reach.drifted import drift_reach_set
from clearway.reach.flown import AttitudeTurns, fly_reach_set, is_flown, turns_of
from clearway.reach.tree import SIDE, ReachSet
from clearway.vehicle.automaton import MovementAutomaton

CALM = np.zeros(3)
LEADS_ON = 0.5
"""Of a movement, that a trajectory leads at least from the place that it begins above or below."""


@dataclass(frozen=True, eq=False)
class PreparedReachSet:
    """A reach set with what every decision needs of it, worked out once.

    Built for one of few start pitches; `fly_reach_set` says where the same movements lead from the
    attitude that the vehicle really has.
    """

    reach_set: ReachSet
    paths: Paths
    loiter: LoiterCircles
    path_cost_m: FloatArray
    """[nodes] stage costs from the start to each node."""
    off_level_m: FloatArray
    """[nodes] what it costs that a trajectory leaves the grid above or below there."""
    first_movement: IntArray
    """[nodes] index of the first movement on the way to each node."""
    first_node: IntArray
    """[nodes] node of that first movement."""
    step_m: float
    """Length of one movement: the unit of cost weights."""
    turns: AttitudeTurns
    flyable: BoolArray
    """[nodes] whether the path to the node's end keeps the automaton's pitch limit."""
    reach_m: float
    """How far from the vehicle its paths lead, at least the range of the grid."""
    tube_m: FloatArray | None = None
    """[nodes] within how far of its prediction the vehicle is on a movement; None for there."""
    may_stay: bool = False
    """Whether trajectories that lead nowhere count too, for costs that know what they are worth."""

    __repr__ = brief

    @classmethod
    def of(
        cls,
        reach_set: ReachSet,
        prices: Prices,
        stage_cost: StageCost = length_and_prices,
        turning_radius_m: float = 0.0,
        tube_m: FloatArray | None = None,
    ) -> PreparedReachSet:
        """Evaluate the stage cost (4.6) on a reach set; without a turning radius none circles.

        tube_m: [nodes] within how far of its prediction the vehicle is; None for exactly there.
        """
        cost = np.array(stage_cost(reach_set, prices), dtype=np.float64)
        if cost.shape != (reach_set.nodes,) or not np.all(np.isfinite(cost)):
            raise ClearwayError("stage cost: must be a finite number for every node")
        first = reach_set.movement.astype(np.int64)
        first_node = np.arange(reach_set.nodes)
        for node, parent in enumerate(reach_set.parent):
            if parent >= 0:
                cost[node] += cost[parent]
                first[node], first_node[node] = first[parent], first_node[parent]
        step_m = float(np.max(reach_set.length_m[reach_set.parent < 0]))
        loiter = loiter_circles(reach_set, turning_radius_m)
        return cls(
            reach_set,
            paths_of(reach_set, tube_m),
            loiter,
            cost,
            price_of(prices.off_level) * step_m * _leaves_level(reach_set),
            first,
            first_node,
            step_m,
            turns_of(reach_set),
            np.ones(reach_set.nodes, dtype=np.bool_),
            reach_of(paths_of(reach_set, tube_m), reach_set.grid.range_m),
            tube_m,
        )

    @cached_property
    def away_m(self) -> FloatArray:
        """[nodes] how far from the start each movement may come."""
        return away_of(self.paths)

    @cached_property
    def without_loiter(self) -> PreparedReachSet:
        """The same, asking for no room to circle."""
        return replace(self, loiter=NO_LOITER)

    @cached_property
    def ends(self) -> Ends:
        """Of the complete trajectories that can be flown."""
        return ends_of(self, self.reach_set.complete)

    @cached_property
    def leading_on(self) -> Ends:
        """Of those among them that lead anywhere but up or down; all where none does."""
        return self.ends.some(self.ends.leads_on) if self.ends.leads_on.any() else self.ends

    def in_wind(self, wind_mps: FloatArray, unsure_mps: float = 0.0) -> PreparedReachSet:
        """The same trajectories in air that moves, [3] m/s in the grid frame.

        unsure_mps: how far off the wind may be; the margin grows by it with the time flown.
        """
        if not any(wind_mps.tolist()):
            return self
        carried = drift_reach_set(self.reach_set, wind_mps)
        paths = paths_of(carried, self.tube_m)
        paths = paths._replace(sagitta_m=paths.sagitta_m + unsure_mps * paths.end_time_s)
        return replace(
            self,
            reach_set=carried,
            paths=paths,
            loiter=loiter_circles(carried, self.loiter.radius_m, self.loiter.stops),
            reach_m=reach_of(paths, carried.grid.range_m),
        )

    def fly_from(
        self, automaton: MovementAutomaton, roll_rad: float, pitch_rad: float
    ) -> PreparedReachSet:
        """The same trajectories from a true attitude; cells and costs of movements stay."""
        if is_flown(self.reach_set, automaton, roll_rad, pitch_rad):
            return self
        flown, flyable = fly_reach_set(self.reach_set, self.turns, automaton, roll_rad, pitch_rad)
        if automaton.classes is not None:  # Rooted at another previous movement: other cells too.
            flown = drift_reach_set(flown, CALM)
        return replace(
            self,
            reach_set=flown,
            paths=paths_of(flown, self.tube_m),
            loiter=loiter_circles(flown, self.loiter.radius_m, self.loiter.stops),
            flyable=flyable,
            reach_m=reach_of(paths_of(flown, self.tube_m), flown.grid.range_m),
        )


class Ends(NamedTuple):
    """Where trajectories end, and what decisions ask of them that is the same at all of them."""

    nodes: Ints
    """[ends]"""
    path_cost_m: Floats
    """[ends]"""
    first_movement: Ints
    """[ends]"""
    ahead_m: Floats
    """[ends] along the heading, in the level frame."""
    left_m: Floats
    """[ends]"""
    leads_on: Bools
    """[ends] whether the trajectory leads anywhere but up or down.

    Straight up leaves the grid at once and passes no cell: what it costs to go from there is a
    guess, and a vehicle that believes in it rises and sinks for ever.
    """

    def __repr__(self) -> str:
        return brief(self)

    def some(self, keep: BoolArray) -> Ends:
        """Those of a mask [ends]."""
        return Ends(
            self.nodes[keep],
            self.path_cost_m[keep],
            self.first_movement[keep],
            self.ahead_m[keep],
            self.left_m[keep],
            self.leads_on[keep],
        )


def ends_of(prepared: PreparedReachSet, complete: BoolArray) -> Ends:
    """Of the trajectories to those of the nodes, by a mask [nodes], that can be flown."""
    reach_set = prepared.reach_set
    nodes = np.flatnonzero(complete & prepared.flyable)
    states, pitch = reach_set.states[nodes], reach_set.start_pitch_rad
    ahead = np.cos(pitch) * states[:, 0] + np.sin(pitch) * states[:, 2]
    left = states[:, 1]
    return Ends(
        nodes,
        prepared.path_cost_m[nodes] + prepared.off_level_m[nodes],
        prepared.first_movement[nodes],
        ahead,
        left,
        np.hypot(ahead, left) > LEADS_ON * prepared.step_m,
    )


def _leaves_level(reach_set: ReachSet) -> FloatArray:
    """[nodes] how near to the start a trajectory leaves the grid above or below, from 0 to 1."""
    places, grid = reach_set.states[:, :3], reach_set.grid
    azimuth = np.arctan2(places[:, 1], places[:, 0])
    edges = grid.azimuth_edges_rad
    between = (azimuth >= edges[0]) & (azimuth <= edges[-1])
    nearness = np.maximum(0.0, 1.0 - np.linalg.norm(places, axis=1) / grid.range_m)
    return np.where(between & (reach_set.exit_kind == SIDE), nearness, 0.0)


def complete_ends(
    prepared: PreparedReachSet, goal: Goal, arrived: Arrival, *, leads_past: bool = False
) -> Ends:
    """Of complete trajectories that can be flown: at the last goal, none leads past it, unless that
    is asked for."""
    if leads_past or not goal.final or arrived.is_beyond or not np.count_nonzero(arrived.reached):
        return prepared.ends if prepared.may_stay else prepared.leading_on
    complete = (prepared.reach_set.complete & ~arrived.reached) | arrived.first
    ends = ends_of(prepared, complete)
    if prepared.may_stay or not ends.leads_on.any():
        return ends
    return ends.some(ends.leads_on | arrived.reached[ends.nodes])


def away_of(paths: Paths) -> FloatArray:
    """[nodes] how far from the start each movement may come; what is added to the margin on the
    way, as to the sagitta, counts."""
    samples = paths.samples_m
    farthest = np.sqrt(np.einsum("nsi,nsi->ns", samples, samples).max(axis=1))
    away: FloatArray = farthest + paths.sagitta_m
    return away


def reach_of(paths: Paths, range_m: float) -> float:
    """How far from the start any path comes, at least the range of the grid."""
    reach_m = float(away_of(paths).max())
    return reach_m if reach_m > (1.0 + RANGE_TOLERANCE) * range_m else range_m
