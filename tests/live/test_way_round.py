"""When a way round is looked for, and in how fine cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.rules.airspace import keep_out
from clearway.base.arrays import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.live.routing.timed_route import make_seen_planner
from clearway.obstacles.obstacle import Obstacle
from clearway.reach import ReachLibrary
from clearway.sim import simulate
from clearway.sim.settings import SimulationSettings
from clearway.studies.campaigns.families import make_case
from seen_ways_for_tests import MARGIN_M, START, look, planner
from worlds_for_tests import AUTOMATON, LIBRARY, mission

GAP_M = 4.5
GOAL = np.array([25.0, 0.0, 0.0])
FAR_LIBRARY = ReachLibrary.build(AUTOMATON, AvoidanceGrid.uniform(range_m=20.0))
MIDDLES = np.arange(4.0, 8.0, 0.5).tolist()


def wall_with_gap(middle_m: float) -> FloatArray:
    """[n, 3] tall, 10 m ahead, 120 m wide."""
    aside = np.arange(-60.0, 60.25, 0.25)
    aside = aside[np.abs(aside - middle_m) >= 0.5 * GAP_M]
    heights = np.arange(-17.0, 17.5, 0.5)
    y, z = (each.ravel() for each in np.meshgrid(aside, heights))
    return np.stack([np.full(len(y), 10.0), y, z], axis=1)


def crossed_m(middle_m: float, asks: str, range_m: float, narrow: str) -> float:
    """Where the way of a plane leads through the wall's plane."""
    changed = AvoidanceSettings(safety_margin_m=MARGIN_M, escape=asks, narrow=narrow)
    library = LIBRARY if range_m == 10.0 else FAR_LIBRARY
    routes = make_seen_planner(Planner.of(library, changed), mission(tuple(GOAL)), None)
    look(routes, wall_with_gap(middle_m), seen=True)
    corners = np.concatenate([START[None], routes.find_seen_route(START, GOAL).corners_m])
    return float(np.interp(10.0, corners[:, 0], corners[:, 1]))


@pytest.mark.parametrize("range_m", [10.0, 20.0])
@pytest.mark.parametrize("middle_m", MIDDLES)
def test_a_gap_wider_than_a_turning_radius_is_found_however_far_sensors_see(
    middle_m: float, range_m: float
) -> None:
    crossed = crossed_m(middle_m, "strict", range_m, "refuse")
    assert abs(crossed - middle_m) < 0.5 * GAP_M - MARGIN_M


@pytest.mark.parametrize("middle_m", MIDDLES)
def test_who_may_fly_through_narrow_places_sees_gaps_of_less(middle_m: float) -> None:
    for asks, narrow in (("known", "refuse"), ("strict", "allow")):
        crossed = crossed_m(middle_m, asks, 10.0, narrow)
        assert abs(crossed - middle_m) < 0.5 * GAP_M - MARGIN_M


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


@pytest.mark.parametrize("highest_m", [2.0, 9.0])
def test_no_way_leads_above_a_ceiling(highest_m: float) -> None:
    """Over a low wall without one, past its end with one."""
    returns = wall_with_gap(100.0)
    low_wall = returns[(returns[:, 2] < 4.0) & (np.abs(returns[:, 1]) < 30.0)]
    routes = look(planner(0.0, heights_m=(-9.0, highest_m)), low_wall, seen=True)
    corners = routes.find_seen_route(START, GOAL).corners_m
    assert np.max(corners[:, 2]) <= highest_m
    assert (np.max(np.abs(corners[:, 1])) > 20.0) == (highest_m < 9.0)


def test_no_way_leads_through_what_rules_forbid() -> None:
    """A keep-out volume across the straight way, which nobody sees."""
    box = keep_out([Obstacle.cuboid((10.0, 0.0, 0.0), (4.0, 12.0, 200.0))])
    planned = Planner.of(LIBRARY, AvoidanceSettings(safety_margin_m=MARGIN_M), rules=(box,))
    routes = make_seen_planner(planned, mission(tuple(GOAL)), None)
    look(routes, np.zeros((0, 3)), seen=True)
    corners = np.concatenate([START[None], routes.find_seen_route(START, GOAL).corners_m])
    assert abs(np.interp(10.0, corners[:, 0], corners[:, 1])) > 6.0
