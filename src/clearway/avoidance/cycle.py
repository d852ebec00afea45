"""An ordinary decision in one compiled call: what is known, rated; what can be flown, chosen.

Nothing is computed here. What follows is the paper's order, over the same loops that stand, and are
tested, in the files that they come from; with ratings, costs and rules of a user's own, decisions
call them one by one instead (`assess`, `at_hand`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.candidates import (
    Candidates,
    Weights,
    are_finite,
    log_ratings,
    priced_ends,
    view_of,
)
from clearway.avoidance.costs import TurnsAndClimbs, cost_to_go
from clearway.avoidance.evidence import Sources
from clearway.avoidance.fusion import total_of, unknown_of
from clearway.avoidance.goal import Goal
from clearway.avoidance.hazards import MovingHazards, PointBins, PointHazards, bin_points
from clearway.avoidance.prepared import Ends, WayArrays
from clearway.avoidance.reach_rating import PassedCells, rate_nodes, untouched_nodes
from clearway.avoidance.tiers import NodeRatings, Picked, picked
from clearway.base.arrays import Bools, Floats, Floats2
from clearway.base.brief import brief
from clearway.base.by_leaf import by_leaf
from clearway.base.compiled import compiled
from clearway.base.grid import GridEdges
from clearway.obstacles.obstacle import Shapes
from clearway.sensors.coating import coated_by
from clearway.sensors.scan_cells import PlacedScan, detected_in, looked_into


class RatedWays(NamedTuple):
    """What is known, as far as trajectories go by it."""

    rating: Floats
    """[cells] how safe a passage is."""
    node_rating: Floats
    """[nodes] P_R (4.22)."""
    feasibility: Floats
    """[nodes] P_D (2.3)."""
    untouched: Bools
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
    passed: PassedCells,
) -> RatedWays:
    """From evidence to how safe trajectories are, by the rating `total`.

    points: in the grid frame. unknown, unknown_unseen: as of `fusion.assess_cells`. That rating
    goes by the sources alone: P_OM (5.54) and P_O (4.17) are worked out by who asks for them.
    """
    # Coating: the cells that the margin around returns and shapes reaches into (def. 5, def. 6).
    coated = coated_by(points.position_m, points.radius_m + margin, edges) | sources.coated_by_map
    # Fusion: how safe every cell is, by total probability.
    rating = total_of(
        sources.detected,
        sources.visibility,
        sources.map_base,
        sources.intruder,
        unknown_of(sources.seen, unknown, unknown_unseen),
    )
    # Trajectories: P_R along the cells that they pass (4.21), (4.22), and what it leaves (2.3).
    node_rating, feasibility = rate_nodes(
        passed.parent, passed.cell_start, passed.cell_index, passed.exit_kind, rating
    )
    untouched = untouched_nodes(passed.parent, passed.cell_start, passed.cell_index, coated)
    return RatedWays(rating, node_rating, feasibility, untouched)


class Decided(NamedTuple):
    """What comes of all that can be flown, and what it comes of."""

    detected: Floats
    """[cells] as of `Sources`, these and the next two."""
    visibility: Floats
    seen: Bools
    node_rating: Floats
    """[nodes] as of `RatedWays`, these and the next two."""
    feasibility: Floats
    untouched: Bools
    bins: PointBins
    """Of the points."""
    priced: bool
    """Whether all costs are finite numbers; else nothing is picked."""
    candidates: Candidates
    picked: Picked
    known: Floats2
    """[nodes, 3] what was found of movements, as of `verify.KnownClearances.at`."""

    def __repr__(self) -> str:
        return brief(self)


@by_leaf
@compiled
def decided(
    sensed: bool,
    scan: PlacedScan,
    sources: Sources,
    points: PointHazards,
    shapes: Shapes,
    moving: MovingHazards,
    margin: float,
    unknown: float,
    unknown_unseen: float,
    threshold: float,
    ways: WayArrays,
    ends: Ends,
    goal: Goal,
    reached: Bools,
    grazing: Floats,
    able: TurnsAndClimbs,
    weights: Weights,
) -> Decided:
    """From the returns of a scan to the node to fly to: the cheapest that passes and keeps the
    margin, by the rating `total`.

    sensed: whether there is a scan; else sources say what sensors do. points, shapes, moving: in
    the grid frame. ends: of complete trajectories. reached, grazing: [nodes] as of `priced_ends`.
    """
    edges, paths = scan.tables.edges, ways.paths
    # Sensors: P_OD (5.41) and P_V (5.47) of every cell.
    detected, visibility, seen = sources.detected, sources.visibility, sources.seen
    if sensed:
        cells = detected_in(scan)
        detected, visibility = cells.share, cells.visibility
        seen = looked_into(scan.beams, len(edges.range_m) - 1)
    known_cells = Sources(
        detected, visibility, seen, sources.map_base, sources.intruder, sources.coated_by_map
    )
    # Fusion, and how safe trajectories are: (4.21), (4.22), (2.3).
    rated = assessed(known_cells, points, margin, edges, unknown, unknown_unseen, ways.passed)
    # Cost to go from where each candidate ends, and all that it costs (4.6).
    states, length_m, pitch_rad = ways.states, ways.length_m, ways.start_pitch_rad
    to_go = cost_to_go(states, paths.parent, length_m, ends.nodes, pitch_rad, reached, goal, able)
    candidates = priced_ends(
        ends,
        to_go,
        goal.final,
        reached,
        grazing,
        log_ratings(rated.node_rating, ends.nodes),
        rated.untouched,
        view_of(goal.target_m, ways.range_m),
        weights,
    )
    priced = are_finite(candidates.cost_m)
    # Verification, the cheapest first: against points, shapes, and intruders at equal times.
    bins = bin_points(points.position_m, points.radius_m)
    ratings = NodeRatings(rated.node_rating, rated.feasibility, ways.first_node, threshold)
    known = np.full((len(paths.parent), 3), np.nan)
    found = picked(paths, candidates, ratings, bins, shapes, moving, margin, ways.loiter, known)
    return Decided(
        detected,
        visibility,
        seen,
        rated.node_rating,
        rated.feasibility,
        rated.untouched,
        bins,
        priced,
        candidates,
        found,
        known,
    )
