"""What reactive baselines see: everything known as balls around the vehicle, in the level frame."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import Hazards, MovingHazards, PointHazards
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray, cartesian_from_spherical, world_from_body

MAP_SPACING_RAD = np.radians(5.0)
"""Between the directions in which the map is looked at."""


class MovingBalls(NamedTuple):
    """Solid balls in the level frame that fly straight on and grow."""

    position_m: FloatArray
    """[n, 3]"""
    velocity_mps: FloatArray
    """[n, 3] zero for what stands still."""
    radius_m: FloatArray
    """[n]"""
    growth_mps: FloatArray
    """[n] of the radius, for what is uncertain of an intruder."""


def hazards_around(planner: Planner, situation: Situation) -> Hazards:
    """Remembered points, map shapes and intruders in the grid frame, as clearway verifies them."""
    return gather_in_reach(planner, situation).hazards


def balls_around(planner: Planner, situation: Situation) -> PointHazards:
    """The same as solid balls in the level frame (origin at the vehicle, x along its heading):
    intruders where they come nearest, map surfaces at spaced directions."""
    hazards = hazards_around(planner, situation)
    moving = _where_nearest(hazards.moving, planner)
    charted = _map_surfaces(situation, planner.grid.range_m)
    position = np.concatenate([hazards.points.position_m, moving.position_m, charted.position_m])
    radius = np.concatenate([hazards.points.radius_m, moving.radius_m, charted.radius_m])
    level_from_grid = world_from_body([0.0, float(situation.state.attitude_rad[1]), 0.0])
    return PointHazards(np.ascontiguousarray(position @ level_from_grid.T), radius)


def moving_balls_around(planner: Planner, situation: Situation) -> MovingBalls:
    """The same as balls that move: intruders with their velocity, all else at rest."""
    hazards = hazards_around(planner, situation)
    points, moving = hazards.points, hazards.moving
    charted = _map_surfaces(situation, planner.grid.range_m)
    at_rest = len(points.radius_m) + len(charted.radius_m)
    position = np.concatenate([points.position_m, charted.position_m, moving.position_m])
    velocity = np.concatenate([np.zeros((at_rest, 3)), moving.velocity_mps])
    level_from_grid = world_from_body([0.0, float(situation.state.attitude_rad[1]), 0.0])
    return MovingBalls(
        np.ascontiguousarray(position @ level_from_grid.T),
        np.ascontiguousarray(velocity @ level_from_grid.T),
        np.concatenate([points.radius_m, charted.radius_m, moving.radius_m]),
        np.concatenate([np.zeros(at_rest), moving.growth_mps]),
    )


def _where_nearest(moving: MovingHazards, planner: Planner) -> PointHazards:
    """What moves, at the closest approach to a vehicle that flies straight on, grown until then."""
    horizon = planner.grid.range_m / planner.speed_mps
    relative = moving.velocity_mps - np.array([planner.speed_mps, 0.0, 0.0])
    closing = -np.einsum("ij,ij->i", moving.position_m, relative)
    speed2 = np.maximum(np.einsum("ij,ij->i", relative, relative), 1e-12)
    when = np.clip(closing / speed2, 0.0, horizon)
    return PointHazards(
        moving.position_m + when[:, None] * moving.velocity_mps,
        moving.radius_m + when * moving.growth_mps,
    )


def _map_surfaces(situation: Situation, range_m: float) -> PointHazards:
    """Where rays meet the map, in the grid frame, with half the spacing there as radius."""
    charted = situation.obstacle_map
    if charted is None or not len(charted):
        return PointHazards(np.zeros((0, 3)), np.zeros(0))
    frame, rays = situation.frame, _directions()
    towards = np.ascontiguousarray(frame.world_vectors(rays))
    distance = charted.cast(frame.origin_m, towards, range_m)
    hit = np.isfinite(distance)
    return PointHazards(distance[hit, None] * rays[hit], 0.5 * MAP_SPACING_RAD * distance[hit])


@cache
def _directions() -> FloatArray:
    """[n, 3] unit vectors all around, evenly in azimuth and elevation."""
    azimuth = np.arange(-np.pi, np.pi, MAP_SPACING_RAD)
    elevation = np.arange(-0.5 * np.pi, 0.5 * np.pi, MAP_SPACING_RAD) + 0.5 * MAP_SPACING_RAD
    mesh = np.meshgrid(azimuth, elevation, indexing="ij")
    angles = np.stack([np.ones_like(mesh[0]), *mesh], axis=-1).reshape(-1, 3)
    return cartesian_from_spherical(angles)
