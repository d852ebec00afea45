"""Scale does not decide: everything made larger or smaller alike, the same node is chosen."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from clearway.avoidance.decide import decide
from clearway.avoidance.planner import AvoidanceSettings, Planner
from clearway.avoidance.situation import Situation
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, Scan, detect
from clearway.sensors.simulate import simulate_scan
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton

SCENES = 10


@cache
def _planner(scale: float) -> Planner:
    automaton = MovementAutomaton.plane(scale, pitch_limit_deg=0.0)
    grid = AvoidanceGrid.uniform(10.0 * scale)
    settings = AvoidanceSettings(safety_margin_m=0.6 * scale, own_drift_mps=0.05 * scale)
    return Planner.of(ReachLibrary.build(automaton, grid), settings)


@cache
def _scene(seed: int) -> tuple[tuple[Obstacle, ...], np.ndarray, tuple[np.ndarray, ...]]:
    """Obstacles seen and mapped, returns, and intruders [n, 7] (position, velocity, radius)."""
    rng = np.random.default_rng(seed)
    world = [
        Obstacle.ball(rng.uniform([3.5, -7, -3], [12, 7, 3]), rng.uniform(0.3, 1.6))
        for _ in range(rng.integers(1, 8))
    ]
    if seed % 3 == 0:
        world.append(Obstacle.cuboid([9.0, 0.5, 0.0], (0.5, rng.uniform(2.0, 12.0), 8.0)))
    pattern = BeamPattern.per_cell(_planner(1.0).grid, max_range_m=10.0)
    here = State(np.zeros(3))
    scan = simulate_scan(Lidar("lidar", pattern), ObstacleMap(world), here, rng)
    intruders = tuple(
        np.concatenate([rng.uniform([4, -6, -1], [9, 6, 1]), rng.uniform(-1, 1, 3), [0.3]])
        for _ in range(seed % 3)
    )
    return tuple(world), scan.points_m, intruders


def _scaled(obstacle: Obstacle, scale: float) -> Obstacle:
    if obstacle.shape == "ball":
        return Obstacle.ball(scale * obstacle.position_m, scale * obstacle.radius_m)
    return Obstacle.cuboid(
        scale * obstacle.position_m, tuple(scale * size for size in obstacle.size_m)
    )


def _chosen(seed: int, scale: float) -> tuple[int, float, str]:
    """Node, clearance in the scene's own measure, and basis."""
    planner = _planner(scale)
    world, points, intruders = _scene(seed)
    lidar = Lidar("lidar", BeamPattern.per_cell(planner.grid, max_range_m=10.0 * scale))
    situation = Situation(
        State(np.zeros(3)),
        scale * np.array([30.0, 0.0, 0.0]),
        reach_radius_m=1.5 * scale,
        detections=(detect(planner.grid, lidar, Scan(scale * points)),),
        obstacle_map=ObstacleMap([_scaled(each, scale) for each in world[: seed % 4]]),
        intruders=[
            Intruder(scale * row[:3], scale * row[3:6], radius_m=scale * row[6], name=f"i{n}")
            for n, row in enumerate(intruders)
        ],
    )
    choice = decide(planner, situation).choice
    return choice.node, choice.clearance_m / scale, choice.basis.name


@pytest.mark.parametrize("exponent", [-20, -10, -4, 4, 10])
def test_powers_of_two_change_nothing(exponent: int) -> None:
    for seed in range(SCENES):
        assert _chosen(seed, 2.0**exponent) == _chosen(seed, 1.0), f"scene {seed}"


@pytest.mark.parametrize("scale", [1e-3, 0.01, 0.3, 7.0, 1e3])
def test_any_scale_chooses_the_same_node(scale: float) -> None:
    for seed in range(SCENES):
        node, clearance, basis = _chosen(seed, scale)
        expected = _chosen(seed, 1.0)
        assert (node, basis) == (expected[0], expected[2]), f"scene {seed}"
        assert clearance == pytest.approx(expected[1], rel=1e-6)
