"""Scale does not decide: everything made larger or smaller alike, the same node is chosen."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rules import Rule
from clearway.avoidance.rules.airspace import altitude_ceiling, altitude_floor, keep_out, near_route
from clearway.avoidance.rules.traffic import horizontal_only, right_of_way
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, PointMemory, Scan, detect, update_memory
from clearway.sensors.beams.simulate import simulate_scan
from clearway.traffic import Intruder
from clearway.vehicle.automaton import MovementAutomaton

SCENES = 12
POWERS = [-20, -10, -4, 4, 10]
OTHERS = [1e-3, 0.01, 0.3, 7.0, 1e3]


@cache
def _planner(scale: float, pitched: bool) -> Planner:
    """Sets are built at every scale, those of pitched flight once: their file holds no lengths."""
    automaton = MovementAutomaton.plane(scale, pitch_limit_deg=30.0 if pitched else 0.0)
    grid = AvoidanceGrid.uniform(10.0 * scale)
    library = (ReachLibrary.load_or_build if pitched else ReachLibrary.build)(automaton, grid)
    settings = AvoidanceSettings(safety_margin_m=0.6 * scale, own_drift_mps=0.05 * scale)
    return Planner.of(library, settings)


def _rules(seed: int, scale: float) -> tuple[Rule, ...]:
    """Every rule that states a length, two or three at a time."""
    volume = Obstacle.cuboid(scale * np.array([6.0, 2.0, 0.0]), (4.0 * scale,) * 3)
    rules = (
        altitude_floor(-1.5 * scale),
        near_route(2.0 * scale),
        keep_out([volume]),
        horizontal_only(8.0 * scale),
        altitude_ceiling(1.0 * scale),
        right_of_way(),
    )
    return rules[seed % 6 :: 2]


@cache
def _obstacles(seed: int, scale: float) -> tuple[Obstacle, ...]:
    """Of every shape, turned every way."""
    rng = np.random.default_rng(seed)
    made: list[Obstacle] = []
    for n in range(int(rng.integers(1, 8))):
        place = scale * rng.uniform([3.5, -7, -3], [12, 7, 3])
        turned, size = rng.uniform(-1.5, 1.5, 3), scale * rng.uniform(0.5, 4.0, 3)
        radius = scale * rng.uniform(0.1, 1.6)
        made.append(
            (
                Obstacle.ball(place, radius),
                Obstacle.line(place, size[0], radius_m=0.1 * radius, orientation_rad=turned),
                Obstacle.plane(
                    place, tuple(size[:2]), radius_m=0.1 * radius, orientation_rad=turned
                ),
                Obstacle.cuboid(place, tuple(size), radius_m=0.1 * radius, orientation_rad=turned),
                Obstacle.cuboid(place, tuple(size), orientation_rad=turned),
            )[(seed + n) % 5]
        )
    if seed % 3 == 0:
        wide = rng.uniform(2.0, 12.0)
        made.append(
            Obstacle.cuboid(scale * np.array([9.0, 0.5, 0.0]), (scale, wide * scale, 8 * scale))
        )
    return tuple(made)


def _intruders(seed: int, scale: float) -> list[Intruder]:
    """Up to four, with and without a body, a spread, deviations and manoeuvres."""
    rng = np.random.default_rng(1000 + seed)
    return [
        Intruder(
            scale * rng.uniform([4, -6, -1], [9, 6, 1]),
            scale * rng.uniform(-1, 1, 3),
            radius_m=0.3 * scale * (n % 2),
            name=f"i{n}",
            spread_rad=np.array([0.15, 0.05]) * (n % 3 == 1),
            position_std_m=0.05 * scale * (n == 2),
            velocity_std_mps=0.02 * scale * (n == 2),
            acceleration_bound_mps2=0.05 * scale if n == 3 else None,
            manoeuvre_mps2=0.1 * scale * (n == 1),
        )
        for n in range(seed % 5)
    ]


@cache
def _returns(seed: int, pitched: bool) -> FloatArray:
    """Of one scan at the scale of 1, body frame."""
    lidar = Lidar("lidar", BeamPattern.per_cell(_planner(1.0, pitched).grid, max_range_m=10.0))
    here = replace(_state(seed, 1.0, pitched), position_m=np.zeros(3))
    rng = np.random.default_rng(seed)
    return simulate_scan(lidar, ObstacleMap(list(_obstacles(seed, 1.0))), here, rng).points_m


def _state(seed: int, scale: float, pitched: bool) -> State:
    rng = np.random.default_rng(2000 + seed)
    attitude = rng.uniform(-0.5, 0.5, 3) if pitched else np.zeros(3)
    return State(np.zeros(3), attitude, position_std_m=0.02 * scale * (seed % 2))


def _chosen(seed: int, scale: float, pitched: bool) -> tuple[int, float, str, Any]:
    """Node, clearance in the scene's own measure, basis, and what rules did."""
    planner = _planner(scale, pitched)
    if pitched:
        planner = replace(planner, rules=_rules(seed, scale))
    lidar = Lidar("lidar", BeamPattern.per_cell(planner.grid, max_range_m=10.0 * scale))
    returns = scale * _returns(seed, pitched)
    state = _state(seed, scale, pitched)
    memory = PointMemory.empty(0.12 * scale, reach_m=15.0 * scale, smallest_m=0.05 * scale)
    memory = update_memory(memory, lidar, Scan(returns), state, tolerance_m=0.02 * scale)
    situation = Situation(
        state,
        scale * np.array([30.0, 3.0 * (seed % 3), 2.0 * pitched]),
        reach_radius_m=1.5 * scale,
        detections=(detect(planner.grid, lidar, Scan(returns)),),
        remembered=PointHazards(*memory.near(state.position_m, 11.2 * scale)),
        obstacle_map=ObstacleMap(list(_obstacles(seed, scale)[: seed % 4])),
        intruders=_intruders(seed, scale),
        range_sigma_m=0.01 * scale,
    )
    choice = decide(planner, situation).choice
    notes = [(note.name, note.decided) for note in choice.rules]
    return choice.node, choice.clearance_m / scale, choice.basis.name, notes


@pytest.mark.parametrize("pitched", [False, True], ids=["level", "pitched, rules"])
@pytest.mark.parametrize("exponent", POWERS)
def test_powers_of_two_change_nothing(exponent: int, pitched: bool) -> None:
    for seed in range(SCENES):
        assert _chosen(seed, 2.0**exponent, pitched) == _chosen(seed, 1.0, pitched), f"scene {seed}"


@pytest.mark.parametrize("pitched", [False, True], ids=["level", "pitched, rules"])
@pytest.mark.parametrize("scale", OTHERS)
def test_any_scale_chooses_the_same_node(scale: float, pitched: bool) -> None:
    for seed in range(SCENES):
        node, clearance, *rest = _chosen(seed, scale, pitched)
        expected = _chosen(seed, 1.0, pitched)
        assert (node, *rest) == (expected[0], *expected[2:]), f"scene {seed}"
        assert clearance == pytest.approx(expected[1], rel=1e-6)
