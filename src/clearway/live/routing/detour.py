"""A way round what is known, when flying on brings the goal no nearer."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.base.frames import FloatArray
from clearway.live.routing.distance_field import Distance
from clearway.live.routing.route import Route, find_route
from clearway.obstacles.obstacle_map import ObstacleMap

VOXELS = 12_000
"""Enough to get round a wall, few enough to be found within a movement."""


def known_distance(obstacle_map: ObstacleMap | None, remembered: PointHazards) -> Distance:
    """Distance [n] of points [n, 3] of the world to the nearest mapped or remembered surface.

    Remembered balls count with their largest radius, which never overstates the distance.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(remembered.position_m) if len(remembered.radius_m) else None
    largest = float(remembered.radius_m.max(initial=0.0))

    def distance(points_m: FloatArray) -> FloatArray:
        nearest = np.full(len(points_m), np.inf)
        if obstacle_map is not None and len(obstacle_map):
            nearest = obstacle_map.distance_m(points_m)
        if tree is not None:
            nearest = np.minimum(nearest, tree.query(points_m)[0] - largest)
        return nearest

    return distance


def known_way(
    obstacle_map: ObstacleMap | None,
    remembered: PointHazards,
    position_m: FloatArray,
    target_m: FloatArray,
    margins_m: tuple[float, ...],
) -> tuple[FloatArray, ...]:
    """Corners [3] of a way to the target, without its ends; the first margin with a way counts.

    Empty where no way is known, or the straight one is free.
    """
    distance = known_distance(obstacle_map, remembered)
    for margin in margins_m:
        route = find_route(distance, position_m, target_m, margin, voxels=VOXELS)
        if isinstance(route, Route) and len(route.points_m) > 2:
            return tuple(route.points_m[1:-1])
    return ()
