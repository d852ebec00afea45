"""The wish as the cost of a decision: of all safe trajectories the one that is nearest to it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.goal import Arrival, Goal
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray, State
from clearway.reach.tree import LAST_LAYER, ReachSet
from clearway.vehicle.automaton import MovementAutomaton

FAR = 10.0
"""Ranges of the grid at which the goal of a decision lies: nothing arrives there."""
FADES = 0.5
"""Weight of a movement beside the one before it: what is flown first counts most."""
TURN = 0.05
"""Of a movement's length per radian: what is equally near does not turn the nose."""
NO_PRICES = Prices(
    turn=0.0,
    change=0.0,
    vertical=0.0,
    risk=0.0,
    coated=0.0,
    miss=0.0,
    other_side=0.0,
    other_plan=0.1,
    no_room=0.0,
    off_level=0.0,
    closing=0.0,
)
"""Nothing but the wish counts, and a little to stay with what was begun."""


class NearnessToWish:
    """A terminal cost: how far trajectories lie from the wish at equal times.

    Told anew before every decision where the wish leads.
    """

    def __init__(self) -> None:
        self._velocity_mps = np.zeros(3)

    def towards(
        self, wished_mps: FloatArray, situation: Situation, planner: Planner, unsure_m: float
    ) -> Situation:
        """A situation from which decisions lead where a wish does: a velocity [3], world frame.

        unsure_m: more by which the vehicle may be off its movements.
        """
        fast = float(np.linalg.norm(wished_mps))
        wished = wished_mps * min(1.0, planner.speed_mps / fast) if fast > 0.0 else wished_mps
        self._velocity_mps = wished @ situation.frame.world_from_grid
        state = situation.state
        direction = wished_mps / fast if fast > 0.0 else state.world_from_body[:, 0]
        return replace(
            situation,
            target_m=state.position_m + FAR * planner.grid.range_m * direction,
            next_m=None,
            from_m=None,
            unsure_m=situation.unsure_m + unsure_m,
        )

    def __call__(
        self,
        reach_set: ReachSet,
        nodes: IntArray,
        _goal: Goal,
        _arrived: Arrival,
        _automaton: MovementAutomaton,
    ) -> FloatArray:
        """[n] metres off the wish on the way to each node, and at its end for all that follows."""
        parent, ends = reach_set.parent, reach_set.end_time_s
        begins = np.where(parent >= 0, ends[parent], 0.0)
        samples = reach_set.samples_m
        shares = np.arange(1, samples.shape[1] + 1) / samples.shape[1]
        times = begins[:, None] + (ends - begins)[:, None] * shares
        wished = times[..., None] * self._velocity_mps
        off = np.sqrt(((samples - wished) ** 2).sum(axis=2))
        weight, flown = np.ones(len(parent)), off.mean(axis=1)
        for node in np.flatnonzero(parent >= 0).tolist():  # Parents come first.
            weight[node] = FADES * weight[parent[node]]
            flown[node] = flown[parent[node]] + weight[node] * flown[node]
        later = weight * FADES / (1.0 - FADES) * off[:, -1]
        turned = TURN * _step_m(reach_set) * np.abs(reach_set.states[:, 5])
        cost: FloatArray = (flown + later + turned)[nodes]
        return cost


def overshoot_m(
    automaton: MovementAutomaton, state: State, velocity_mps: FloatArray, acceleration_mps2: float
) -> float:
    """By how much a velocity [3] that cannot change at once puts movements off their way; of a
    vehicle with inertia they begin with it."""
    if math.isinf(acceleration_mps2) or automaton.has_inertia:
        return 0.0
    yaw = float(state.attitude_rad[2])
    ways = [
        np.array([m.speed_mps * math.cos(yaw), m.speed_mps * math.sin(yaw), m.climb_mps or 0.0])
        for m in automaton.movements
    ]
    own = max(float(np.linalg.norm(way - velocity_mps)) for way in ways)
    between = max(float(np.linalg.norm(a - b)) for a in ways for b in ways)
    return max(own, between) ** 2 / (2.0 * acceleration_mps2)


def _step_m(reach_set: ReachSet) -> float:
    """Length of the longest single movement."""
    return float(reach_set.length_m[reach_set.parent < 0].max())


def planner_towards(planner: Planner, wish: NearnessToWish) -> Planner:
    """The planner for which the wish alone is the cost.

    A single movement is a trajectory to it, and so is standing still: what comes after the first
    movement is the escape.
    """

    def each(prepared: PreparedReachSet) -> PreparedReachSet:
        reach_set = prepared.reach_set
        ends = np.full_like(reach_set.exit_kind, LAST_LAYER)
        return replace(
            prepared,
            reach_set=replace(reach_set, exit_kind=ends),
            path_cost_m=np.zeros_like(prepared.path_cost_m),
            may_stay=True,
        )

    prepared = tuple((pitch, each(one)) for pitch, one in planner.prepared_sets)
    settings = replace(planner.settings, prices=NO_PRICES, threshold=0.0)
    return replace(planner, prepared_sets=prepared, settings=settings, terminal_cost=wish)
