"""From what is known to evidence per cell, and to what trajectories must keep clear of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from clearway.avoidance.fusion import Evidence
from clearway.avoidance.hazards import (
    Hazards,
    MovingHazards,
    PointHazards,
    no_shapes,
    nothing_moving,
)
from clearway.avoidance.planner import AvoidanceSettings, Planner
from clearway.avoidance.situation import Situation, grid_frame
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.cells import base_probability
from clearway.obstacles.cells import coated_cells as coated_by_map
from clearway.obstacles.obstacle import Shapes
from clearway.sensors import Detection, combine_detections, thin_points
from clearway.sensors import coated_cells as coated_by_points
from clearway.traffic import Intruder, assess_intruders
from clearway.traffic.models.many import deviations_m, speeds_mps, spread_tangents

NO_SHAPES = no_shapes()
THINNING = 0.1
"""Voxels in which points are merged before verification, as a share of the margin."""
MOST_MEASURED = 20_000
"""Shapes of a map of which each is asked for its distance at every decision."""


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
    planner: Planner,
    situation: Situation,
    intruders: Sequence[Intruder],
    margin: float,
    reach_m: float | None = None,
) -> Hazards:
    """All that trajectories could lack the margin of, in the grid frame, as the intruders are.

    reach_m: how far they lead; None for the farthest of the planner's.
    """
    settings = planner.settings
    position, world_from_grid = grid_frame(situation.state)
    within_m = (planner.reach_m if reach_m is None else reach_m) + margin
    points, points_left_out_m = _points(situation, settings, position, world_from_grid, within_m)
    shapes = _shapes_near(situation, position, world_from_grid, planner.grid, within_m)
    return Hazards(
        points,
        shapes,
        _movers(intruders, situation, settings, planner.horizon_s),
        min(points_left_out_m, _left_out_m(situation, shapes, position, within_m)),
    )


def _shapes_near(
    situation: Situation,
    position: FloatArray,
    world_from_grid: FloatArray,
    grid: AvoidanceGrid,
    within_m: float,
) -> Shapes:
    if situation.obstacle_map is None or not len(situation.obstacle_map):
        return NO_SHAPES
    return situation.obstacle_map.in_grid(position, world_from_grid, grid, within_m - grid.range_m)


def _left_out_m(situation: Situation, near: Shapes, position: FloatArray, within_m: float) -> float:
    """At most the distance of the nearest map shape that is out of reach; inf without any."""
    known = situation.obstacle_map
    if known is None or len(known) == len(near.radius_m):
        return np.inf
    if len(known) > MOST_MEASURED:
        return within_m
    away = np.linalg.norm(known.shapes.center_m - position, axis=1) - known.shapes.bound_m
    away[near.source] = np.inf
    return max(within_m, float(away.min()))


def _points(
    situation: Situation,
    settings: AvoidanceSettings,
    position: FloatArray,
    world_from_grid: FloatArray,
    within_m: float,
) -> tuple[PointHazards, float]:
    """What is remembered, or else the returns at hand merged in voxels; grown by range noise.

    Beside it the distance of the nearest return that is out of reach.
    """
    noise_m = settings.point_sigmas * situation.range_sigma_m
    left_out_m = np.inf
    if situation.remembered is not None:
        place = (situation.remembered.position_m - position) @ world_from_grid
        radius = situation.remembered.radius_m
    else:
        place = np.concatenate([np.zeros((0, 3)), *(d.points_m for d in situation.detections)])
        radius = np.concatenate([np.zeros(0), *(d.radius_m for d in situation.detections)])
        away = np.sqrt(np.einsum("ij,ij->i", place, place)) - radius - noise_m
        near = away <= within_m
        left_out_m = float(away[~near].min(initial=np.inf))
        place, radius = thin_points(place[near], radius[near], THINNING * settings.safety_margin_m)
    return PointHazards(np.ascontiguousarray(place), radius + noise_m), left_out_m


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
        return nothing_moving()
    reports = situation.intruders
    ages = situation.state.time_s - np.array([report.time_s for report in reports])
    start = np.array([i.radius_m for i in intruders])
    start += deviations_m(reports, ages, settings.sigmas)
    turning = 0.5 * horizon_s * np.array([i.acceleration_bound_mps2 or 0.0 for i in intruders])
    return MovingHazards(
        np.array([i.position_m for i in intruders]),
        np.array([i.velocity_mps for i in intruders]),
        start,
        spread_tangents(intruders) * speeds_mps(intruders)
        + settings.sigmas * np.array([i.velocity_std_mps for i in intruders])
        + turning,
    )
