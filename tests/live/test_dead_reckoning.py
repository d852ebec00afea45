"""Own place and scans between rare own states: exact while the plan is flown as decided."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.planner import AvoidanceSettings, Planner
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, simulate_scan
from clearway.vehicle.automaton import MovementAutomaton

SPEED_MPS, TICK_S = 15.0, 0.1
AUTOMATON = MovementAutomaton.plane(speed_mps=SPEED_MPS)
GRID = AvoidanceGrid.uniform(150.0)
LIDAR = Lidar("lidar", BeamPattern.per_cell(GRID, max_range_m=150.0))
BALLS = [Obstacle.ball(place, 20.0) for place in ([90, 5, 0], [260, -25, 10], [420, 10, -5])]
WORLD = ObstacleMap(BALLS)


def fast_system() -> AvoidanceSystem:
    planner = Planner.of(
        ReachLibrary.load_or_build(AUTOMATON, GRID), AvoidanceSettings(safety_margin_m=9.0)
    )
    mission = Mission("fast", State(np.zeros(3)), np.array([[600.0, 0.0, 0.0]]), 22.0)
    return AvoidanceSystem(planner, mission, (LIDAR,))


@pytest.mark.parametrize("every", [1, 2, 5, 10], ids=lambda every: f"{10 // every} Hz")
def test_own_place_and_scans_are_exact_however_rare_own_states_are(every):
    """Scans ten times a second, decisions every half second: plans take over mid-movement."""
    live, truth = fast_system(), State(np.zeros(3))
    worst_m, placed_m, shifted = 0.0, 0.0, set()
    for tick in range(int(24.0 / TICK_S)):
        now = tick * TICK_S
        truth = replace(truth, time_s=now)
        if tick % every == 0:
            live.update(truth)
        live.update(simulate_scan(LIDAR, WORLD, truth))
        decided = tick % 5 == 0 or live.due(now) is not None
        if decided:
            shifted.update(live.decide(now).movements[:1])
        situation, _ = live.situation(now)
        worst_m = max(worst_m, float(np.linalg.norm(situation.state.vector - truth.vector)))
        points = live._sensing.remembered.position_m
        if len(points):
            # Every remembered return lies on the surface that it came from.
            placed_m = max(placed_m, float(np.abs(WORLD.distance_m(points)).max()))
        _, ahead = live.buffer.split(now)
        flown, _ = ahead.split(now + TICK_S)
        vector = flown.rollout(AUTOMATON, truth.vector, np.inf).states[-1]
        truth = State(vector[:3], vector[3:], now)
    assert len(shifted) > 1, "it must have turned"
    assert worst_m < 1e-6
    assert placed_m < reference_m() + 1e-6


def reference_m() -> float:
    """How far merged returns lie off the surface where every place is told: voxels merge them."""
    return 1.0
