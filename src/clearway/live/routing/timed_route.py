"""The route planner of a flight: what it keeps to, and which cells it needs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.held_escape import Escape, Narrow
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.time_cost import ARRIVAL_MPS, speed_abilities
from clearway.avoidance.rate.route_field import Pace
from clearway.base.frames import FloatArray
from clearway.live.mission import Mission
from clearway.live.routing.field.clearance_speed import BARRED_M
from clearway.live.routing.field.known_space import BaseClearance, RouteCells
from clearway.live.routing.route_planner import (
    MOST_LAYERS,
    SLOW,
    WIDE,
    RoutePlanner,
    RouteSettings,
    route_cells_for,
)
from clearway.live.routing.seen_planner import SeenPlanner
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import VOXEL_OF_MARGIN

OF_MARGIN = 0.5
OF_TURN = 0.25
"""Edge of the finest cells, in margins, and in turning radii where these are more."""
MOST = 0.9
"""Share of the movements from rest that the margin of ways round suffices for: where none of them
fits, a way leads nowhere."""
BESIDE_M = 3.0
"""How far above and below the heights of the mission ways round are looked for, at least."""
LAYERS_BY_WAYS = 14
"""Layers at most where ways alone are made, now and then."""
OF_NARROW_TURN = 0.27
OF_WIDE_TURN = 0.43
"""Edge of cells that are known to be seen or not, in turning radii, for who may fly through narrow
places and for others: walls of which beams show little have no gaps then, and one of 1.2 turning
radii is seen however cells lie."""
OF_SEEN = 1.67
SEEN_LAYERS = 13
"""The same in margins, for who turns on the spot, and layers of such cells at most: an odd number
has one at the height of a level mission."""
NEAR = 2.6
"""Cells or layers to which clearance is known at least: goals lie on one side of a wall."""
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


def turning_room_m(automaton: MovementAutomaton) -> float:
    """Room that a turn takes; 0 where the vehicle can stop, or turns nowhere."""
    room = automaton.room_to_turn_m
    return room if np.isfinite(room) else 0.0


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
    needs, has_inertia = _needs_of(planner), planner.automaton.has_inertia
    turning_m = turning_room_m(planner.automaton)
    beside_m = max(BESIDE_M, turning_m, 0.0 if has_inertia else planner.grid.range_m)
    width_m = max(OF_MARGIN * planner.settings.safety_margin_m, OF_TURN * turning_m)
    most_layers = MOST_LAYERS if has_inertia else LAYERS_BY_WAYS
    return RoutePlanner(
        _settings_of(needs, mission),
        _cells_for(planner, mission, width_m, beside_m, most_layers),
        find_known_clearance(planner, mission, obstacle_map),
    )


def make_seen_planner(
    planner: Planner, mission: Mission, obstacle_map: ObstacleMap | None
) -> SeenPlanner:
    """Return the route planner of a flight that keeps seen space, as of `route_planner_for`."""
    margin_m, turning_m = planner.settings.safety_margin_m, turning_room_m(planner.automaton)
    cells = _make_seen_cells(planner, mission)
    wide_m = max(margin_m + turning_m, NEAR * max(cells.width_m, cells.layer_m))
    needs = _needs_of(planner)._replace(margin_m=margin_m, wide_m=wide_m)
    return SeenPlanner(
        _settings_of(needs, mission),
        cells,
        find_known_clearance(planner, mission, obstacle_map),
        turning_m=turning_m,
        narrow=_may_be_narrow(planner),
    )


def suits(routes: RoutePlanner, planner: Planner, mission: Mission) -> bool:
    """Return whether the cells of a route planner hold another mission, too."""
    had, wanted = routes.space.layout, _make_seen_cells(planner, mission)
    heights = np.append(mission.goals_m[:, 2], mission.start.position_m[2])
    top_m = had.lowest_m + (had.layers - 1) * had.layer_m
    if had.layers > 1 and not (had.lowest_m <= heights.min() and heights.max() <= top_m):
        return False
    return wanted.levels <= had.levels


def _may_be_narrow(planner: Planner) -> bool:
    """Whether what leaves no room to turn may be flown through."""
    settings = planner.settings
    return settings.narrow == Narrow.ALLOW or settings.escape == Escape.KNOWN


def _make_seen_cells(planner: Planner, mission: Mission) -> RouteCells:
    turning_m = turning_room_m(planner.automaton)
    of_turn = OF_NARROW_TURN if _may_be_narrow(planner) else OF_WIDE_TURN
    unit_m = VOXEL_OF_MARGIN * planner.settings.safety_margin_m
    wanted_m = max(OF_SEEN * planner.settings.safety_margin_m, of_turn * turning_m)
    # Whole voxels: a world that is moved by whole cells of all that is kept looks the same.
    width_m = unit_m * int(wanted_m / unit_m)
    beside_m = SEEN_LAYERS // 2 * max(LAYER_M, width_m)
    cells = _cells_for(planner, mission, width_m, beside_m, SEEN_LAYERS)
    return cells._replace(voxel_m=OF_MARGIN * planner.settings.safety_margin_m)


def _settings_of(needs: _Needs, mission: Mission) -> RouteSettings:
    return RouteSettings(
        needs.pace,
        needs.margin_m,
        mission.reach_radius_m,
        needs.asked_within_m,
        SLOW * needs.pace.fastest_mps,
        needs.wide_m,
    )


def _cells_for(
    planner: Planner, mission: Mission, width_m: float, beside_m: float, most_layers: int
) -> RouteCells:
    """Return the cells for a mission, the finest so wide, and layers so far beside its heights."""
    settings = planner.settings
    goals = np.concatenate([mission.start.position_m[None], mission.goals_m])
    low, high = float(goals[:, 2].min()), float(goals[:, 2].max())
    if planner.automaton.stays_level:
        beside_m = 0.0
    lowest_m = max(low - beside_m, min(settings.lowest_m, low))
    highest_m = min(high + beside_m, max(settings.highest_m, high))
    away_m = float(np.ptp(goals[:, :2], axis=0).max()) + planner.grid.range_m
    return route_cells_for(width_m, away_m, lowest_m, highest_m, max(LAYER_M, width_m), most_layers)


def find_known_clearance(
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
