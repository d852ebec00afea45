"""What was truly there at a decision: in which cells, and how near each trajectory came to it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from clearway.avoidance import Decision
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import BoolArray
from clearway.obstacles.cell_nodes import cell_nodes
from clearway.obstacles.world import World
from clearway.reach.tree import ReachSet
from clearway.sim import Run

NUDGE_M = 1e-4
"""By which points are moved to see which way a surface lies."""
STEP_S = 0.2
"""Between the moments at which it is looked where an intruder is."""


@dataclass(frozen=True, slots=True, eq=False)
class TruePassage:
    """Where an intruder truly was, and went on to straight after what was recorded."""

    time_s: FloatArray
    """[n] ascending."""
    position_m: FloatArray
    """[n, 3] world frame."""
    radius_m: float

    def at(self, time_s: FloatArray) -> FloatArray:
        """[..., 3] positions at times; far away before it appears."""
        last = len(self.time_s) - 1
        k = np.clip(np.searchsorted(self.time_s, time_s) - 1, 0, max(last - 1, 0))
        begin, span = self.time_s[k], np.diff(self.time_s)[k]
        share = ((time_s - begin) / span)[..., None]
        placed: FloatArray = self.position_m[k] * (1.0 - share) + self.position_m[k + 1] * share
        return np.where((time_s < self.time_s[0])[..., None], np.inf, placed)


def true_passages(run: Run[Any]) -> tuple[TruePassage, ...]:
    """Of all intruders of a flight."""
    met = run.metrics.intruders
    if met is None:
        return ()
    radii_m = dict(zip(met.names, met.margin_m - run.safety_margin_m, strict=True))
    return tuple(
        TruePassage(track[:, 0], track[:, 1:], float(radii_m[name]))
        for name, track in run.intruder_tracks.items()
        if len(track) > 1
    )


def find_obstructed_cells(
    decision: Decision, world: World, passages: tuple[TruePassage, ...], horizon_s: float
) -> BoolArray:
    """[cells] true where something solid stands, or an intruder's body passes within the horizon.

    Looked at from about a hundred nodes of each cell, and where the surface nearest to each of them
    lies: a wire between the nodes is found.
    """
    grid, frame = decision.cells.evidence.grid, decision.frame
    nodes = cell_nodes(grid)
    places_m = np.ascontiguousarray(nodes.position_m.T)
    cell = np.repeat(np.arange(grid.cells), np.diff(nodes.first))
    centre_m = world.distance_m(np.ascontiguousarray(frame.world_points(nodes.center_m)))
    inside = (centre_m <= -nodes.radius_m)[cell]
    near = np.flatnonzero((np.abs(centre_m) < nodes.radius_m)[cell])
    if len(near):
        points = frame.world_points(places_m[near])
        surface_m, distance_m = _nearest_surface(world, points)
        touched = grid.cell_of(frame.grid_points(surface_m)) == cell[near]
        inside[near] = (distance_m <= 0.0) | touched
    hit = inside
    for passage in passages:
        hit |= _passes_over(frame, places_m, passage, decision.state.time_s, horizon_s)
    return np.asarray(np.logical_or.reduceat(hit, nodes.first[:-1]))


def _nearest_surface(world: World, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[n, 3] the place on a surface nearest to each point, world frame, and [n] how far it is."""
    points = np.ascontiguousarray(points_m)
    distance = world.distance_m(points)
    slope = np.empty_like(points)
    for axis, off in enumerate(NUDGE_M * np.eye(3)):
        ahead, behind = (world.distance_m(np.ascontiguousarray(points + by)) for by in (off, -off))
        slope[:, axis] = (ahead - behind) / (2.0 * NUDGE_M)
    return points - distance[:, None] * slope, distance


def _passes_over(
    frame: GridFrame, node_m: FloatArray, passage: TruePassage, now_s: float, horizon_s: float
) -> BoolArray:
    """[nodes] whether the body comes over them."""
    times = now_s + np.arange(0.0, horizon_s + STEP_S, STEP_S)
    places = passage.at(times)
    known = np.isfinite(places).all(axis=1)
    over = np.zeros(len(node_m), dtype=np.bool_)
    if known.sum() < 2:
        return over
    path_m = frame.grid_points(places[known])
    for begin, end in pairwise(path_m):
        along = end - begin
        share = np.clip((node_m - begin) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        off = node_m - begin - share[:, None] * along
        over |= np.einsum("nk,nk->n", off, off) <= passage.radius_m**2
    return over


def distances_m(decision: Decision, world: World, passages: tuple[TruePassage, ...]) -> FloatArray:
    """[nodes, samples] how far from any surface each sample of the reach set truly is, were it
    flown: intruders are where they are at the same moment."""
    reach_set = decision.prepared.reach_set
    points = np.ascontiguousarray(decision.frame.world_points(reach_set.samples_m))
    nearest = world.distance_m(points.reshape(-1, 3)).reshape(points.shape[:2])
    times = decision.state.time_s + sample_times_s(reach_set)
    for passage in passages:
        apart = np.linalg.norm(points - passage.at(times), axis=2) - passage.radius_m
        nearest = np.minimum(nearest, apart)
    return np.asarray(nearest)


def sample_times_s(reach_set: ReachSet) -> FloatArray:
    """[nodes, samples] after the start."""
    ends, parents = reach_set.end_time_s, np.maximum(reach_set.parent, 0)
    begins = np.where(reach_set.parent < 0, 0.0, ends[parents])
    samples = reach_set.samples_m.shape[1]
    share = np.arange(1, samples + 1) / samples
    return np.asarray(begins[:, None] + share * (ends - begins)[:, None])
