"""Route planners that keep seen space, told of made-up returns."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards, no_points
from clearway.avoidance.rate.route_field import Pace
from clearway.base.arrays import BoolArray, FloatArray
from clearway.live.routing.route_planner import RouteSettings, route_cells_for
from clearway.live.routing.seen_planner import SeenPlanner
from clearway.live.routing.timed_route import NEAR
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors.observed.seen_space import NOTHING_SEEN

MARGIN_M, RADIUS_M, REACH_M = 0.6, 3.82, 15.0
START = np.zeros(3)
FAST_MPS = 1.0


def planner(
    turning_m: float = RADIUS_M,
    world: ObstacleMap | None = None,
    *,
    width_m: float | None = None,
    heights_m: tuple[float, float] = (-10.0, 10.0),
) -> SeenPlanner:
    """Of a plane, or of a vehicle that turns on the spot; as `seen_planner_for` makes them."""
    pace = Pace(FAST_MPS, np.inf, FAST_MPS, 0.5 * FAST_MPS, 0.5 * FAST_MPS)
    width = width_m or (1.5 if turning_m else 1.0)
    cells = route_cells_for(width, 70.0, *heights_m, max(width, 1.5), 13)
    wide_m = max(MARGIN_M + turning_m, NEAR * max(width, cells.layer_m))
    return SeenPlanner(
        RouteSettings(pace, MARGIN_M, 1.5, 10.0, 0.15, wide_m),
        cells._replace(voxel_m=0.5 * MARGIN_M),
        None if world is None else world.distance_m,
        turning_m=turning_m,
    )


def look(
    routes: SeenPlanner,
    returns_m: FloatArray,
    place_m: FloatArray = START,
    reach_m: float = 100.0,
    *,
    seen: bool = False,
) -> SeenPlanner:
    """Take in returns; with `seen`, all that is kept counts as seen besides."""
    points = (
        PointHazards(returns_m, np.full(len(returns_m), 0.1)) if len(returns_m) else no_points()
    )
    routes.look(NOTHING_SEEN, points, place_m, reach_m, 15.0)
    if seen:
        routes.space.seen[:] = True
    return routes


def wall(start: tuple[float, float], end: tuple[float, float], top_m: float = 17.0) -> FloatArray:
    """[n, 3] returns of a tall wall between two places from above."""
    count = int(2.0 * np.hypot(end[0] - start[0], end[1] - start[1])) + 1
    level = np.linspace(start, end, count)
    heights = np.arange(-17.0, top_m + 0.5, 0.5)
    return np.concatenate([np.insert(level, 2, z, axis=1) for z in heights])


def near_cells_seen(routes: SeenPlanner) -> BoolArray:
    """[n, n, layers] of the finest level, to be changed: whether they were seen."""
    layout = routes.space.layout
    shape = (layout.levels, layout.along, layout.along, layout.layers)
    seen: BoolArray = routes.space.seen.reshape(shape)[0]
    return seen
