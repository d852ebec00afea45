"""The route planner of a flight: what it keeps to, and which cells it needs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.time_cost import ARRIVAL_MPS, speed_abilities
from clearway.avoidance.rate.route_field import Pace
from clearway.base.frames import FloatArray
from clearway.live.mission import Mission
from clearway.live.routing.field.clearance_speed import BARRED_M
from clearway.live.routing.field.known_space import BaseClearance
from clearway.live.routing.route_map import turning_room_m
from clearway.live.routing.route_planner import (
    MOST_LAYERS,
    SLOW,
    WIDE,
    RoutePlanner,
    RouteSettings,
    route_cells_for,
)
from clearway.obstacles.obstacle_map import ObstacleMap

OF_MARGIN, OF_TURN = 0.5, 0.25
"""Edge of the finest cells, in margins, and in turning radii where these are more."""
MOST = 0.9
"""Share of the movements from rest that the margin of ways round suffices for: where none of them
fits, a way leads nowhere."""
BESIDE_M = 3.0
"""How far above and below the heights of the mission ways round are looked for, at least."""
LAYERS_BY_WAYS = 14
"""Layers at most where ways alone are made, now and then."""
LAYER_M = 1.5
"""From one layer of cells to the next, at least."""
SLIGHT_M = 1e-6
"""How much deeper than it began a vehicle may be where a rule forbids to fly: rounding."""
VERTICAL = 2.0
"""What a metre up or down costs a vehicle without inertia, in metres ahead."""


class _Needs(NamedTuple):
    """What a vehicle needs of a route."""

    pace: Pace
    margin_m: float
    wide_m: float
    """From that clearance on it is as fast as it can be."""
    asked_within_m: float


def route_planner_for(
    planner: Planner, mission: Mission, obstacle_map: ObstacleMap | None
) -> RoutePlanner:
    """Return the route planner of a flight.

    Parameters
    ----------
    planner
    mission
        Its heights say between which ways round are looked for.
    obstacle_map
        What is known before take-off.
    """
    settings, needs = planner.settings, _needs_of(planner)
    turning_m = turning_room_m(planner.automaton)
    goals = np.concatenate([mission.start.position_m[None], mission.goals_m])
    low, high = float(goals[:, 2].min()), float(goals[:, 2].max())
    beside_m = max(BESIDE_M, turning_m)
    if planner.automaton.stays_level:
        beside_m = 0.0
    elif not planner.automaton.has_inertia:
        beside_m = max(beside_m, planner.grid.range_m)
    lowest_m = max(low - beside_m, min(settings.lowest_m, low))
    highest_m = min(high + beside_m, max(settings.highest_m, high))
    away_m = float(np.ptp(goals[:, :2], axis=0).max()) + planner.grid.range_m
    width_m = max(OF_MARGIN * settings.safety_margin_m, OF_TURN * turning_m)
    most_layers = MOST_LAYERS if planner.automaton.has_inertia else LAYERS_BY_WAYS
    cells = route_cells_for(
        width_m, away_m, lowest_m, highest_m, max(LAYER_M, width_m), most_layers
    )

    return RoutePlanner(
        RouteSettings(
            needs.pace,
            needs.margin_m,
            mission.reach_radius_m,
            needs.asked_within_m,
            SLOW * needs.pace.fastest_mps,
            needs.wide_m,
        ),
        cells,
        known_besides(planner, mission, obstacle_map),
    )


def known_besides(
    planner: Planner, mission: Mission, obstacle_map: ObstacleMap | None
) -> BaseClearance | None:
    """Return what ways round keep clear of besides points: the map, and where rules forbid to fly.

    A mission that begins where a rule forbids it may stay as deep there.
    """
    depths = [rule.depth for rule in planner.rules if rule.depth is not None]
    if not depths and not obstacle_map:
        return None
    start_m = mission.start.position_m[None]
    route_m = np.concatenate([start_m, mission.goals_m])
    allowed = [max(0.0, float(depth(start_m, route_m)[0])) + SLIGHT_M for depth in depths]

    def clearance_m(places_m: FloatArray, within_m: float) -> FloatArray:
        clear = np.full(len(places_m), np.inf)
        if obstacle_map:
            clear = obstacle_map.distance_m(places_m, within_m)
        for depth, most in zip(depths, allowed, strict=True):
            clear = np.where(depth(places_m, route_m) > most, 2.0 * BARRED_M, clear)
        return clear

    return clearance_m


def _needs_of(planner: Planner) -> _Needs:
    margin_m, classes = planner.settings.safety_margin_m, planner.automaton.classes
    if classes is not None and classes.has_speeds:
        able = speed_abilities(planner.automaton)
        # With the tube, and what chords leave out, of most movements from rest.
        at_rest = planner.prepared_sets[classes.first][1].paths
        margin_m += float(np.quantile(at_rest.sagitta_m, MOST))
        pace = Pace(
            able.fastest_mps, able.acceleration_mps2, ARRIVAL_MPS, able.climb_mps, able.sink_mps
        )
        return _Needs(pace, margin_m, WIDE * margin_m, able.fastest_mps * planner.horizon_s)
    speed = planner.speed_mps
    pace = Pace(speed, np.inf, speed, speed / VERTICAL, speed / VERTICAL)
    # With room to turn, where there is any.
    wide_m = max(WIDE * margin_m, margin_m + 0.5 * turning_room_m(planner.automaton))
    return _Needs(pace, margin_m, wide_m, planner.grid.range_m)
