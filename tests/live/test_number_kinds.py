"""Settings are numbers of any kind: whole ones and those of 4 bytes decide as floats do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import clearway as cw


def decided(number: Callable[[float], float], escape: str) -> tuple[object, ...]:
    """What is decided where every setting and reading is a number of one kind."""
    automaton = cw.MovementAutomaton.plane(speed_mps=number(1))
    grid = cw.AvoidanceGrid.uniform(range_m=number(10))
    settings = cw.AvoidanceSettings(
        safety_margin_m=number(1),
        sigmas=number(2),
        point_sigmas=number(2),
        threshold=number(0),
        unknown=number(0),
        smallest_object_m=number(1),
        start_free_m=number(3),
        body_radius_m=number(1),
        escape=escape,
        state_s=number(2),
        scan_s=number(3),
        ground_height_m=number(-9),
    )
    beams = cw.BeamPattern.per_cell(grid, 20, min_range_m=number(1), max_range_m=number(30))
    start = cw.State(np.zeros(3), time_s=number(0), position_std_m=number(0))
    system = cw.AvoidanceSystem(
        cw.Planner.of(cw.ReachLibrary.load_or_build(automaton, grid), settings),
        cw.Mission("m", start, waypoints_m=[[30, 0, 0], [50, 0, 0]], reach_radius_m=number(2)),
        lidars=(cw.Lidar("one", beams, sigma_m=number(1), airframe_radius_m=number(0)),),
        obstacle_map=cw.ObstacleMap([cw.Obstacle.ball([8.0, 1.0, 0.0], number(1))]),
    )
    system.update(start)
    system.update(cw.Scan(np.array([[8.0, 1.0, 0.0]]), number(0), sensor="one"))
    system.update(cw.Intruder([8.0, 2.0, 0.0], [-1.0, 0.0, 0.0], radius_m=number(1), name="a"))
    decision = system.decide(number(0)).decision
    return decision.movements, decision.choice.clearance_m, decision.choice.cost_m


@pytest.mark.parametrize("escape", ["off", "strict"])
@pytest.mark.parametrize("number", [int, np.float32, np.int64])
def test_other_kinds_of_numbers_decide_as_floats(
    number: Callable[[float], float], escape: str
) -> None:
    assert decided(number, escape) == decided(float, escape)
