"""A fast copter and what moves slowly, seen by its LiDAR alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.dynamic_objects import DynamicObjectSettings
from clearway.live.mission import Mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
from clearway.sim import SimulationSettings, simulate
from clearway.sim.scripted import ScriptedIntruder, Traffic
from clearway.vehicle.automaton import MovementAutomaton

SPEED_MPS, ACCELERATION_MPS2, MARGIN_M = 8.0, 5.0, 0.4
PATTERN = BeamPattern.from_angles(
    np.radians(np.arange(-179.5, 180.0, 1.0)), np.radians(np.arange(-29.5, 30.0, 1.0))
)


@cache
def planner() -> Planner:
    automaton = MovementAutomaton.multirotor(
        speed_mps=SPEED_MPS, acceleration_mps2=ACCELERATION_MPS2
    )
    library = ReachLibrary.load_or_build(automaton, AvoidanceGrid.uniform(range_m=30.0))
    settings = AvoidanceSettings(
        safety_margin_m=MARGIN_M, body_radius_m=0.2, smallest_object_m=0.3, follow_movers=True
    )
    return Planner.of(library, settings)


def test_what_moves_half_a_margin_between_two_decisions_is_followed() -> None:
    assert DynamicObjectSettings.of(0.4, 8.0, 0.4).slowest_mps == pytest.approx(0.5)
    assert DynamicObjectSettings.of(0.6, 1.0, 1.0).slowest_mps == 0.25


@pytest.mark.parametrize(
    ("speed_mps", "course_deg"),
    [
        (1.8, -75.0),
        (0.7, 60.0),
        *(pytest.param(*one, marks=pytest.mark.nightly) for one in ((1.2, 100.0), (1.8, 120.0))),
    ],
)
def test_a_slow_ball_across_the_way_of_a_fast_copter_keeps_its_margin(
    speed_mps: float, course_deg: float
) -> None:
    """Straight flight would meet it in its middle, after six seconds."""
    course, meets_s = np.radians(course_deg), 6.0
    velocity = speed_mps * np.array([np.cos(course), np.sin(course), 0.0])
    reached_m = SPEED_MPS * meets_s - SPEED_MPS**2 / (2.0 * ACCELERATION_MPS2)
    start_m = np.array([reached_m, 0.0, 0.0]) - meets_s * velocity
    slow = ScriptedIntruder(
        "slow", 0.0, start_m, velocity, radius_m=0.7, spawn="world", transponder=False, visible=True
    )
    lidar = Lidar("lidar", replace(PATTERN, max_range_m=30.0), sigma_m=0.02)
    mission = Mission("slow", State(np.zeros(3)), waypoints_m=np.array([[65.0, 0.0, 0.0]]))
    run = simulate(
        AvoidanceSystem(planner(), mission, lidars=(lidar,)),
        ObstacleMap(),
        lidars=(lidar,),
        settings=SimulationSettings(scan_rate_hz=10.0, step_s=0.01, time_limit_s=9.0),
        traffic=Traffic([slow], mission, SPEED_MPS),
    )
    assert run.metrics.intruders is not None
    assert run.metrics.intruders.min_distance_m >= MARGIN_M + 0.7
