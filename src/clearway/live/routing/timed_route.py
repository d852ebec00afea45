"""The route planner of a vehicle with inertia: what it keeps to, and which cells it needs."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.time_cost import SLOWEST_MPS, speed_abilities
from clearway.avoidance.rate.route_field import Pace
from clearway.base.frames import FloatArray
from clearway.live.mission import Mission
from clearway.live.routing.route_planner import (
    SLOW,
    WIDE,
    RoutePlanner,
    RouteSettings,
    route_cells_for,
)
from clearway.obstacles.obstacle_map import ObstacleMap

OF_MARGIN = 1.0
"""Edge of the finest cells, in margins."""
BESIDE_M = 3.0
"""How far above and below the heights of the mission ways round are looked for."""
LAYER_M = 1.0
"""From one layer of cells to the next."""


def route_planner_for(
    planner: Planner, mission: Mission, obstacle_map: ObstacleMap | None
) -> RoutePlanner:
    """Return the route planner of a flight.

    Parameters
    ----------
    planner
        Of a vehicle with inertia.
    mission
        Its heights say between which ways round are looked for.
    obstacle_map
        What is known before take-off.
    """
    settings, able = planner.settings, speed_abilities(planner.automaton)
    classes = planner.automaton.classes
    assert classes is not None  # By its class table it has inertia.
    margin_m = settings.safety_margin_m + float(classes.class_tube_m[classes.first])
    pace = Pace(
        able.fastest_mps, able.acceleration_mps2, SLOWEST_MPS, able.climb_mps, able.sink_mps
    )
    goals = np.concatenate([mission.start.position_m[None], mission.goals_m])
    low, high = float(goals[:, 2].min()), float(goals[:, 2].max())
    lowest_m = max(low - BESIDE_M, min(settings.lowest_m, low))
    highest_m = min(high + BESIDE_M, max(settings.highest_m, high))
    away_m = float(np.ptp(goals[:, :2], axis=0).max()) + planner.grid.range_m
    width_m = OF_MARGIN * settings.safety_margin_m
    layout = route_cells_for(width_m, away_m, lowest_m, highest_m, LAYER_M)
    reach_m = able.fastest_mps * planner.horizon_s

    def mapped(places_m: FloatArray, within_m: float) -> FloatArray:
        assert obstacle_map is not None
        return obstacle_map.distance_m(places_m, within_m)

    return RoutePlanner(
        RouteSettings(
            pace,
            margin_m,
            mission.reach_radius_m,
            reach_m,
            SLOW * able.fastest_mps,
            WIDE * margin_m,
        ),
        layout,
        None if obstacle_map is None else mapped,
    )
