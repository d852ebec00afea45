"""Neither place nor heading counts with memory and seen space: whole voxels, quarter turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.avoidance.decision import Decision
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan, simulate_scan
from worlds_for_tests import LIDAR, planner

PLANNER = planner()
WHOLE_M = 192.0
"""Whole voxels of memory (0.12 m and its doubles up to 64) and of seen space (0.25 m)."""
QUARTERS = tuple(
    np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for c, s in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
)


def flight(seed: int) -> tuple[list[State], list[Scan], FloatArray]:
    """Three own states, the sweep at each, and a waypoint, in a world of balls."""
    rng = np.random.default_rng(seed)
    places = rng.uniform([2.0, -7.0, -4.0], [14.0, 7.0, 4.0], (12, 3))
    world = ObstacleMap([Obstacle.ball(place, rng.uniform(0.1, 0.9)) for place in places])
    start = rng.uniform(-0.5, 0.5, 3)
    states = [State(start + np.array([float(n), 0.0, 0.0]), time_s=float(n)) for n in range(3)]
    scans = [simulate_scan(LIDAR, world, state, seed=seed + n) for n, state in enumerate(states)]
    return states, scans, rng.uniform([20.0, -9.0, -4.0], [30.0, 9.0, 4.0])


def decided(seed: int, quarter: int, shift_m: FloatArray) -> tuple[list[Decision], int]:
    """Decisions of that flight elsewhere, and how many balls are remembered at its end."""
    states, scans, target_m = flight(seed)
    turn = QUARTERS[quarter]
    moved = [
        State(
            turn @ state.position_m + shift_m,
            [0.0, 0.0, quarter * np.pi / 2.0],
            time_s=state.time_s,
        )
        for state in states
    ]
    mission = Mission(
        "moved", moved[0], waypoints_m=np.array([turn @ target_m + shift_m]), reach_radius_m=1.5
    )
    system = AvoidanceSystem(PLANNER, mission, lidars=(LIDAR,))
    decisions = []
    for state, scan in zip(moved, scans, strict=True):
        system.update(state)
        system.update(scan)
        decisions.append(system.decide(state.time_s).decision)
    remembered = system.situation(2.0)[0].remembered
    assert remembered is not None
    return decisions, len(remembered.radius_m)


@settings(max_examples=8)
@given(
    seed=st.integers(0, 2**31),
    quarter=st.integers(0, 3),
    voxels=st.tuples(*[st.integers(-20, 20)] * 3),
)
def test_neither_place_nor_heading_counts_with_memory(seed, quarter, voxels) -> None:
    """The same node, basis and way out; numbers to 1e-6, since coordinates are rounded."""
    here, remembered = decided(seed, 0, np.zeros(3))
    there, again = decided(seed, quarter, WHOLE_M * np.array(voxels, dtype=float))
    assert remembered == again > 0
    for one, other in zip(here, there, strict=True):
        assert other.choice.node == one.choice.node
        assert other.choice.basis is one.choice.basis
        assert other.choice.clearance_m == pytest.approx(one.choice.clearance_m, abs=1e-6)
        assert (other.way_out is None) is (one.way_out is None)
        if one.way_out is not None and other.way_out is not None:
            assert other.way_out.movements == one.way_out.movements
