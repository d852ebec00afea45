"""In a closed box no way leads to the goal: that is said, and the vehicle stays safe inside."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode
from clearway.live.outputs.explain import NOT_REACHABLE
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sim import Run, SimulationSettings, simulate
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import GRID, LIBRARY, LIDAR, mission

BEYOND = mission((45.0, 4.0, 0.0))
MARGIN_M = 0.6


def box(length: float, width: float, height: float, ahead: float) -> ObstacleMap:
    """Walls, floor and roof 1 m thick; the start lies inside, so far from the wall ahead."""
    x, sizes = ahead - 0.5 * length, np.array([length, width, height])
    parts = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            center = np.array([x, 0.0, 0.0])
            center[axis] += side * 0.5 * (sizes[axis] + 1.0)
            size = sizes + 2.0
            size[axis] = 1.0
            parts.append(Obstacle.cuboid(center, size))
    return ObstacleMap(parts)


def in_the_box(library: ReachLibrary, world: ObstacleMap, time_s: float) -> Run:
    planner = Planner.of(library, AvoidanceSettings(safety_margin_m=MARGIN_M))
    system = AvoidanceSystem(planner, BEYOND, lidars=(LIDAR,))
    return simulate(
        system, world, lidars=(LIDAR,), settings=SimulationSettings(time_limit_s=time_s)
    )


def stays_safe(run: Run) -> None:
    summary = run.summary()
    assert not run.reached
    assert run.metrics.margin_violations == 0
    assert summary["decisions_without_escape"] == 0
    assert summary["no_guarantee_s"] == []


def holds_and_says_why(run: Run) -> None:
    stays_safe(run)
    assert run.summary()["reason"] == NOT_REACHABLE
    modes = [entry.flight.mode for entry in run.decisions]
    begun = modes.index(Mode.HOLD)
    kept = [mode in (Mode.HOLD, Mode.ESCAPE) for mode in modes[begun:]]
    assert np.mean(kept) > 0.8, "now and then a way is tried again"
    hold = run.decisions[begun].flight
    assert hold.explanation.startswith(f"holds safely: goal {NOT_REACHABLE}")
    assert "as far as is seen" in hold.mode_state.transition


def test_a_multirotor_holds_inside_and_says_why() -> None:
    library = ReachLibrary.build(MovementAutomaton.inertialess(), GRID)
    holds_and_says_why(in_the_box(library, box(16.0, 14.0, 9.0, 9.0), 160.0))


def test_a_plane_stays_safe_inside() -> None:
    stays_safe(in_the_box(LIBRARY, box(26.0, 24.0, 14.0, 14.0), 90.0))


@pytest.mark.nightly
def test_a_plane_says_why_once_every_way_has_come_to_nothing() -> None:
    holds_and_says_why(in_the_box(LIBRARY, box(26.0, 24.0, 14.0, 14.0), 1200.0))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(20))
def test_nor_is_any_other_box_left(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = box(*rng.uniform([22.0, 20.0, 10.0], [34.0, 34.0, 20.0]), rng.uniform(11.0, 14.0))
    stays_safe(in_the_box(LIBRARY, world, 900.0))
