"""When a way round is looked for, and in how fine cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.avoidance.clear.hazards import PointHazards
from clearway.live.routing.route_map import RouteMap
from clearway.live.routing.seen_route import seen_route
from clearway.sensors.observed.seen_space import NOTHING_SEEN
from clearway.sim import simulate
from clearway.sim.settings import SimulationSettings
from clearway.studies.campaigns.families import make_case

MARGIN_M, RADIUS_M, VOXEL_M, GAP_M = 0.6, 3.82, 0.25, 4.5
START, GOAL = np.zeros(3), np.array([25.0, 0.0, 0.0])


def wall_with_gap(middle_m: float) -> PointHazards:
    """Tall, 10 m ahead, 60 m wide."""
    aside = np.arange(-30.0, 30.25, 0.25)
    aside = aside[np.abs(aside - middle_m) >= 0.5 * GAP_M]
    heights = np.arange(-17.0, 17.5, 0.5)
    y, z = (each.ravel() for each in np.meshgrid(aside, heights))
    return PointHazards(np.stack([np.full(len(y), 10.0), y, z], axis=1), np.full(len(y), 0.1))


def crossed_m(sees_m: float, middle_m: float, *, finer: bool = False) -> float:
    """Where the way leads through the wall's plane."""
    routes = RouteMap(VOXEL_M, MARGIN_M, RADIUS_M, narrow=finer, sees_m=sees_m, finer=finer)
    routes.take(NOTHING_SEEN, wall_with_gap(middle_m), START, 100.0)
    corners = np.concatenate([START[None], seen_route(routes.cells(), START, GOAL).corners_m])
    return float(np.interp(10.0, corners[:, 0], corners[:, 1]))


@pytest.mark.parametrize("middle_m", np.arange(4.0, 8.0, 0.5).tolist())
def test_who_sees_room_to_turn_behind_a_gap_is_led_through_it(middle_m: float) -> None:
    assert abs(crossed_m(15.0, middle_m) - middle_m) < 0.5 * GAP_M - MARGIN_M


def test_for_others_cells_are_as_wide_as_a_turn_allows() -> None:
    """Some gaps have none of them."""
    assert RouteMap(VOXEL_M, MARGIN_M, RADIUS_M, sees_m=10.0).width_m == 8 * VOXEL_M
    assert RouteMap(VOXEL_M, MARGIN_M, RADIUS_M, sees_m=15.0).width_m == 4 * VOXEL_M
    off_m = [abs(crossed_m(10.0, at) - at) for at in np.arange(4.0, 8.0, 0.5)]
    assert max(off_m) > GAP_M


@pytest.mark.parametrize("middle_m", np.arange(4.0, 8.0, 0.5).tolist())
def test_finer_ones_show_the_gap_to_whoever_may_fly_through_it(middle_m: float) -> None:
    assert abs(crossed_m(10.0, middle_m, finer=True) - middle_m) < 0.5 * GAP_M - MARGIN_M


def test_an_escape_before_anything_was_seen_is_no_dead_end(tmp_path: Path) -> None:
    changes = {"lidar": {"max_range_m": 15.0}, "vehicle": {"body_radius_m": 0.1}}
    setup = make_case("forest", 0, {}, changes, tmp_path).setup
    system = setup.system()
    run = simulate(
        system,
        setup.world,
        lidars=setup.lidars,
        settings=SimulationSettings(seed=0, time_limit_s=4.0),
    )
    decisions = [entry.flight.decision for entry in run.decisions]
    assert all(decision.escapes for decision in decisions)
    assert not any(decision.way_out and decision.way_out.certain for decision in decisions)
    assert system.progress.detours == 0


@pytest.mark.parametrize("highest_m", [2.0, np.inf])
def test_no_way_leads_above_a_ceiling(highest_m: float) -> None:
    """Over a low wall without one, past its end with one."""
    points = wall_with_gap(100.0)
    low = points.position_m[:, 2] < 4.0
    low_wall = PointHazards(points.position_m[low], points.radius_m[low])
    routes = RouteMap(VOXEL_M, MARGIN_M, 0.0, heights_m=(-17.0, highest_m))
    window = NOTHING_SEEN.window.copy()
    window[8:11], window[11:14] = -100.0, 100.0  # All is known in there.
    routes.take(NOTHING_SEEN._replace(window=window), low_wall, START, 100.0)
    corners = seen_route(routes.cells(), START, GOAL).corners_m
    assert np.max(corners[:, 2]) <= highest_m + routes.width_m
    assert (np.max(np.abs(corners[:, 1])) > 20.0) == (highest_m < np.inf)
