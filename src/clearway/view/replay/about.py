"""What stays the same during a run: mission, vehicle, grid, what was there and what was known."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from clearway.avoidance.past import VOXELS_IN_RANGE
from clearway.avoidance.rules import GroundHeights
from clearway.base.frames import FloatArray
from clearway.base.own_code import shorten_own_name
from clearway.base.packed import one_a_voxel
from clearway.base.version import __version__
from clearway.io.json_values import round_number
from clearway.missions.setup import FlightSetup
from clearway.obstacles.columns import Columns
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.point_world import PointWorld
from clearway.obstacles.world import CombinedWorld, World
from clearway.sim import Run
from clearway.sim.pilot import Steering
from clearway.view.replay.schemas import FORMAT

MOST_HEIGHTS = 120
"""Heights of the ground along each side that the file keeps to show it."""
MOST_WORLD_POINTS = 60_000
"""Points of a surveyed world that the file keeps to show it."""


def mission_message(run: Run[Steering], setup: FlightSetup, begins_s: float) -> dict[str, Any]:
    """Everything that does not change, in the world frame; begins_s: UTC, seconds since 1970."""
    mission, grid, settings = run.mission, setup.planner.grid, setup.planner.settings
    traffic = run.metrics.intruders
    radii = {}
    if traffic is not None:
        bodies = traffic.margin_m - run.safety_margin_m
        radii = {
            name: round_number(float(r)) for name, r in zip(traffic.names, bodies, strict=True)
        }
    ground_m = settings.ground_height_m
    return {
        "format": FORMAT,
        "clearway": __version__,
        "name": mission.name,
        "planner": run.planner,
        "rating": shorten_own_name(settings.rating),
        "threshold": settings.threshold,
        "margin_m": run.safety_margin_m,
        "body_radius_m": setup.craft.body_radius_m,
        "speed_mps": setup.planner.speed_mps,
        "ground_m": None if ground_m is None else round_number(ground_m),
        "start_m": mission.start.position_m.tolist(),
        "waypoints_m": mission.waypoints_m.tolist(),
        "landing_m": mission.landing_m.tolist(),
        "reach_radius_m": mission.reach_radius_m,
        "obstacles": obstacles_message(setup),
        "intruder_radius_m": radii,
        "grid": {
            "range_edges_m": grid.range_edges_m.tolist(),
            "azimuth_edges_rad": grid.azimuth_edges_rad.tolist(),
            "elevation_edges_rad": grid.elevation_edges_rad.tolist(),
        },
        "voxel_m": grid.range_m / VOXELS_IN_RANGE,
        "vehicle": "copter" if setup.planner.automaton.can_stop else "plane",
        "origin_geodetic": None if setup.place.origin is None else list(setup.place.origin),
        "begins_unix_s": begins_s,
        "terrain": terrain_message(setup.place.ground),
        "summary": run.summary(),
    }


def terrain_message(ground: GroundHeights | None) -> dict[str, Any] | None:
    """Heights of the ground on a raster thinned to what can be shown; unknown ones are null."""
    if ground is None:
        return None
    thin = -(-max(ground.height_m.shape) // MOST_HEIGHTS)
    heights = np.rint(100.0 * ground.height_m[::thin, ::thin])
    return {
        "corner_m": np.round(ground.corner_m, 3).tolist(),
        "step_m": round(ground.step_m * thin, 6),
        "rows": heights.shape[0],
        "columns": heights.shape[1],
        "heights_cm": [int(one) if np.isfinite(one) else None for one in heights.ravel()],
    }


def obstacles_message(setup: FlightSetup) -> list[dict[str, Any]]:
    """Shapes of world and map; `known` says where each stands: world, map, both, or rule."""
    there = {_key(one): one for one in _shapes(setup.world)}
    charted = {_key(one): one for one in setup.obstacle_map.obstacles}
    forbidden = {} if setup.kept_out is None else {_key(o): o for o in _shapes(setup.kept_out)}
    return [
        {
            "name": one.name,
            "shape": one.shape,
            "known": _describe_known(key in there, key in charted),
            "position_m": np.round(one.position_m, 4).tolist(),
            "orientation_rad": np.round(one.orientation_rad, 5).tolist(),
            "size_m": list(one.size_m),
            "radius_m": one.radius_m,
        }
        for key, one in (there | charted | forbidden).items()
    ]


def list_surveyed_points(world: World) -> FloatArray:
    """[n, 3] points of the surveyed parts of a world, thinned to a number that can be shown."""
    points = [part.points_m for part in _parts(world) if isinstance(part, PointWorld)]
    if not points:
        return np.zeros((0, 3))
    cloud = np.concatenate(points)
    extent = np.maximum(cloud.max(axis=0) - cloud.min(axis=0), 1e-3)
    voxel = float(np.cbrt(np.prod(extent) / MOST_WORLD_POINTS)) / 4.0
    thinned = cloud
    while len(thinned) > MOST_WORLD_POINTS:
        thinned = cloud[one_a_voxel(cloud, voxel)]
        voxel *= 1.5
    return thinned


def _parts(world: World) -> Iterator[World]:
    if isinstance(world, CombinedWorld):
        for part in world.worlds:
            yield from _parts(part)
    else:
        yield world


def _shapes(world: World) -> Iterator[Obstacle]:
    for part in _parts(world):
        if isinstance(part, Columns | ObstacleMap):
            yield from part.obstacles


def _key(obstacle: Obstacle) -> tuple[object, ...]:
    """World and map build their own; the same shape at the same place is the same thing."""
    return (
        obstacle.name,
        obstacle.shape,
        tuple(obstacle.position_m),
        tuple(obstacle.orientation_rad),
        obstacle.size_m,
        obstacle.radius_m,
    )


def _describe_known(there: bool, charted: bool) -> str:
    if not there and not charted:
        return "rule"
    return "both" if there and charted else "world" if there else "map"
