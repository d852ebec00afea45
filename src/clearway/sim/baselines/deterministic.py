"""The paper's deterministic predecessor (2.1): cells with hits are closed, all others are free.

It knows neither visibility nor a map nor intruders nor a margin around what was hit, and nothing
of earlier scans. A trajectory that passes a closed cell is unreachable; the cheapest other one is
flown.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.reach_rating import find_untouched
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.live.mission import Mode
from clearway.reach.choose.select import tree_of
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import movements_deep
from clearway.reach.expand.replay import complete_buffers
from clearway.reach.sets import lattice_for
from clearway.reach.tree import ReachSet
from clearway.sensors import combine_detections
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import Routes, routes
from clearway.vehicle.automaton import Movement, MovementAutomaton

CLOSING_HITS = 5
"""Hits that close a cell, after fig. 2.1: the same object gives five hits near and three far."""
HELD = (1, 1, 1, 2, 2, 3)
"""How long the choices of the full tree are held, in tenths of its depth: a choice at every one of
ten movements makes more nodes than any vehicle rates in flight."""


def full(craft: Craft) -> ManoeuvreRule:
    """The paper's predecessor: cells with hits are closed, all else is free; full reach set.

    Every sequence of the movements about one axis, chosen anew six times on the way.
    """
    planner = craft.planner
    prepared_sets = [
        PreparedReachSet.of(
            reach_set,
            planner.prices,
            turning_radius_m=planner.automaton.turning_radius_m,
        )
        for reach_set in _full_sets(planner)
    ]

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        pitch = float(situation.state.attitude_rad[1])
        nearest = min(prepared_sets, key=lambda r: abs(r.reach_set.start_pitch_rad - pitch))
        return _cheapest_open(routes(planner, situation, nearest), situation, CLOSING_HITS)

    return rule


def make_reduced(craft: Craft, closing_hits: int = CLOSING_HITS) -> ManoeuvreRule:
    """As `deterministic`, with the reach set that clearway itself flies."""

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        return _cheapest_open(routes(craft.planner, situation), situation, closing_hits)

    return rule


def first_hit(craft: Craft) -> ManoeuvreRule:
    """As `deterministic-reduced`, closed from the first hit on: the most careful threshold."""
    return make_reduced(craft, closing_hits=1)


def _cheapest_open(ways: Routes, situation: Situation, closing_hits: int) -> Manoeuvre:
    """The cheapest trajectory without a closed cell, else the one that comes farthest."""
    closed = _find_closed(ways.prepared.reach_set.grid, situation, closing_hits)
    open_nodes = find_untouched(ways.prepared.reach_set, closed)
    free = open_nodes[ways.nodes]
    if free.any():
        best = int(np.argmax(free))
        reason = f"{best} cheaper ways pass closed cells" if best else "the cheapest way is open"
        mode = Mode.AVOIDANCE if best else Mode.NAVIGATION
        return ways.fly_to(int(ways.nodes[best]), reason, mode)
    farthest = max(ways.nodes, key=lambda node: _open_length(ways.prepared, open_nodes, node))
    return ways.fly_to(int(farthest), "every way is closed; the one open longest", Mode.EMERGENCY)


def _find_closed(grid: AvoidanceGrid, situation: Situation, closing_hits: int) -> BoolArray:
    """[cells] that enough beams ended in."""
    if not situation.detections:
        return np.zeros(grid.cells, dtype=np.bool_)
    return combine_detections(situation.detections).hits >= closing_hits


def _open_length(prepared: PreparedReachSet, open_nodes: BoolArray, node: int) -> float:
    """Length flown along the path to a node before the movement that enters a closed cell."""
    reach_set = prepared.reach_set
    flown = [float(reach_set.length_m[n]) for n in reach_set.path(node) if open_nodes[n]]
    return max(flown, default=0.0)


def _full_sets(planner: Planner) -> list[ReachSet]:
    automaton, grid = planner.automaton, planner.grid
    pitches = automaton.start_pitches_rad
    lattice = lattice_for(automaton, grid, pitches, {})
    deep = movements_deep(automaton, grid)
    buffers = _list_held_sequences(automaton, deep)
    return [
        tree_of(complete_buffers(buffers, lattice, grid, pitch), lattice, grid, pitch)
        for pitch in pitches
    ]


def _list_held_sequences(automaton: MovementAutomaton, deep: int) -> ByteArray:
    """[sequences, deep] every sequence of the movements about one axis, held ever longer."""
    single = [index + 1 for index, m in enumerate(automaton.movements) if _about_one_axis(m)]
    ends = np.cumsum(HELD)
    holder = np.searchsorted(ends / ends[-1] * deep, np.arange(deep), side="right")
    choices = np.unique(holder)
    rows = np.array(list(product(single, repeat=len(choices))), dtype=np.uint8)
    return np.ascontiguousarray(rows[:, np.searchsorted(choices, holder)])


def _about_one_axis(movement: Movement) -> bool:
    rates: Sequence[float] = (
        movement.roll_rate_rps,
        movement.pitch_rate_rps,
        movement.yaw_rate_rps,
    )
    return sum(rate != 0.0 for rate in rates) <= 1
