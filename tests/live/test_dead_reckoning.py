"""Own place and scans between rare own states: exact while the plan is flown as decided."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, Scan
from clearway.vehicle.automaton import MovementAutomaton

SPEED_MPS, TICK_S, LASTS_S = 15.0, 0.1, 16.0
AUTOMATON = MovementAutomaton.plane(speed_mps=SPEED_MPS)
GRID = AvoidanceGrid.uniform(150.0, layers=4)
LIDAR = Lidar("lidar", BeamPattern.per_cell(GRID, max_range_m=150.0))
LANDMARKS = np.array([[x, y, z] for x in range(70, 330, 20) for y in (-14, 9) for z in (-6, 5)])
"""Each in a voxel of its own, and in the way."""


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner.of(
        ReachLibrary.load_or_build(AUTOMATON, GRID), AvoidanceSettings(safety_margin_m=9.0)
    )


def scan_from(truth: State) -> Scan:
    """Returns of the landmarks ahead."""
    seen: FloatArray = (LANDMARKS - truth.position_m) @ truth.world_from_body
    near = np.linalg.norm(seen, axis=1) < 140.0
    return Scan(seen[near & (seen[:, 0] > 5.0)], truth.time_s, sensor="lidar")


@pytest.mark.parametrize("every", [1, 2, 5, 10], ids=lambda every: f"{10 / every:g} Hz")
def test_own_place_and_scans_are_exact_however_rare_own_states_are(planner, every):
    """Ten scans a second, and decisions every 0.7 s: plans take over in the middle of movements."""
    mission = Mission(
        "fast", State(np.zeros(3)), waypoints_m=np.array([[600.0, 0.0, 0.0]]), reach_radius_m=22.0
    )
    live = AvoidanceSystem(planner, mission, lidars=(LIDAR,))
    truth, turned = State(np.zeros(3)), 0
    place_m, scans_m = 0.0, 0.0
    for tick in range(int(LASTS_S / TICK_S)):
        now = tick * TICK_S
        if tick % every == 0:
            live.update(truth)
        live.update(scan_from(truth))
        if tick % 7 == 0 or live.due(now) is not None:
            live.decide(now)
        situation, _ = live.situation(now)
        place_m = max(place_m, float(np.linalg.norm(situation.state.vector - truth.vector)))
        remembered = situation.remembered.position_m
        if len(remembered):
            off = np.linalg.norm(remembered[:, None] - LANDMARKS, axis=2).min(axis=1)
            scans_m = max(scans_m, float(off.max()))
        movement = live.movement_at(now)
        turned += movement.name != "Straight"
        vector = AUTOMATON.fly(truth.vector, [(movement, TICK_S)], np.inf, 0.0).states[-1]
        truth = State(vector[:3], vector[3:], time_s=now + TICK_S)
    assert turned > 10
    assert place_m < 1e-6
    assert scans_m < 1e-6
