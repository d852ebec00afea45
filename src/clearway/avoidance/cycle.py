"""An ordinary decision in two compiled calls: what is known, rated; what can be flown, chosen.

Nothing is computed here. What follows is the paper's order, over the same loops that stand, and are
tested, in the files that they come from; with ratings, costs and rules of a user's own, decisions
call them one by one instead (`assess`, `decide`). Between the two calls stand the logarithms of
ratings, which numpy takes (`candidates.log_ratings`), and what rules are in force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.candidates import Candidates, GoalView, Weights, are_finite, priced_ends
from clearway.avoidance.costs import Goal, TurnsAndClimbs, cost_to_go
from clearway.avoidance.evidence import Sources
from clearway.avoidance.fusion import obstacle_of, rate_nodes, total_of, untouched_nodes
from clearway.avoidance.hazards import MovingHazards, PointBins, PointHazards
from clearway.avoidance.loiter import LoiterCircles
from clearway.avoidance.prepared import Ends
from clearway.avoidance.tiers import NodeRatings, Picked, picked
from clearway.avoidance.verify import Paths
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import GridEdges
from clearway.base.state import BoolArray, IndexArray
from clearway.obstacles.obstacle import Shapes
from clearway.sensors.coating import coated_by


class PassedCells(NamedTuple):
    """Of a reach set, which cells its movements pass."""

    parent: IndexArray
    cell_start: IndexArray
    cell_index: IndexArray
    exit_kind: IndexArray

    def __repr__(self) -> str:
        return brief(self)


class RatedEvidence(NamedTuple):
    """What is known, cell by cell and trajectory by trajectory."""

    coated: BoolArray
    """[cells] def. 5, def. 6."""
    map: FloatArray
    """[cells] P_OM (5.54)."""
    obstacle: FloatArray
    """[cells] P_O (4.17)."""
    rating: FloatArray
    """[cells]"""
    node_rating: FloatArray
    """[nodes] P_R (4.22)."""
    feasibility: FloatArray
    """[nodes] P_D (2.3)."""
    untouched: BoolArray
    """[nodes] paths that pass no coated cell."""

    def __repr__(self) -> str:
        return brief(self)


@compiled
def assessed(
    sources: Sources,
    points: PointHazards,
    margin: float,
    edges: GridEdges,
    unknown: float,
    unknown_unseen: float,
    ways: PassedCells,
) -> RatedEvidence:
    """From evidence to how safe cells and trajectories are, by the rating `total`.

    points: in the grid frame. unknown, unknown_unseen: as of `fusion.assess_cells`.
    """
    # Coating: the cells that the margin around returns and shapes reaches into (def. 5, def. 6).
    coated = coated_by(points.position_m, points.radius_m + margin, edges) | sources.coated_by_map
    # Fusion: P_OM (5.54) and P_O (4.17) of every cell, and how safe it is.
    map_probability, obstacle, unknown_cells = obstacle_of(
        sources.detected,
        sources.visibility,
        sources.map_base,
        sources.intruder,
        sources.seen,
        unknown,
        unknown_unseen,
    )
    rating = total_of(
        sources.detected, sources.visibility, sources.map_base, sources.intruder, unknown_cells
    )
    # Trajectories: P_R along the cells that they pass (4.21), (4.22), and what it leaves (2.3).
    node_rating, feasibility = rate_nodes(
        ways.parent, ways.cell_start, ways.cell_index, ways.exit_kind, rating
    )
    untouched = untouched_nodes(ways.parent, ways.cell_start, ways.cell_index, coated)
    return RatedEvidence(
        coated, map_probability, obstacle, rating, node_rating, feasibility, untouched
    )


class Chosen(NamedTuple):
    """What comes of all that can be flown."""

    priced: bool
    """Whether all costs are finite numbers; else nothing is picked."""
    candidates: Candidates
    picked: Picked
    known: FloatArray
    """[nodes, 3] what was found of movements, as of `verify.KnownClearances.at`."""

    def __repr__(self) -> str:
        return brief(self)


@compiled
def chosen(
    states: FloatArray,
    length_m: FloatArray,
    start_pitch: float,
    ends: Ends,
    goal: Goal,
    able: TurnsAndClimbs,
    reached: BoolArray,
    grazing: FloatArray,
    log_rating: FloatArray,
    untouched: BoolArray,
    view: GoalView,
    weights: Weights,
    ratings: NodeRatings,
    paths: Paths,
    bins: PointBins,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    loiter: LoiterCircles,
) -> Chosen:
    """From ratings to the node to fly to: the cheapest that passes and keeps the margin.

    states, length_m: [nodes] of the reach set. reached, grazing, log_rating, untouched: as of
    `candidates.priced_ends`.
    """
    known = np.full((len(paths.parent), 3), np.nan)
    # Cost to go from where each candidate ends, and all that it costs (4.6).
    to_go = cost_to_go(states, paths.parent, length_m, ends.nodes, start_pitch, reached, goal, able)
    candidates = priced_ends(
        ends, to_go, goal.final, reached, grazing, log_rating, untouched, view, weights
    )
    priced = are_finite(candidates.cost_m)
    # Verification, the cheapest first: against points, shapes, and intruders at equal times.
    found = picked(paths, candidates, ratings, bins, shapes, moving, margin, loiter, known)
    return Chosen(priced, candidates, found, known)
