"""In flight nothing is compiled or loaded from the disk: whatever comes, warming up has met it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import clearway as cw
from asked_in_flight import asked_apart, asked_in_flight, mission, told_to
from clearway.live import AvoidanceSystem
from clearway.live.readings import DataLimits
from clearway.sensors import Scan

TWO = [{"name": "a"}, {"name": "b", "attitude_deg": [0, 0, 15]}]


def falls_silent(scan: Scan) -> list[Scan]:
    return [scan] if scan.time_s < 2.0 else []


def sets_a_floor(system: AvoidanceSystem) -> None:
    system.floor_m = -2


def decides(number: Callable[[float], float], escape: str) -> None:
    """A system is warmed up and decides, whose numbers are all of a kind."""
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
    )
    beams = cw.BeamPattern.per_cell(grid, 20, min_range_m=number(1), max_range_m=number(30))
    world = cw.ObstacleMap([cw.Obstacle.ball([8.0, 1.0, 0.0], number(1))])
    start = cw.State(np.zeros(3), time_s=number(0), position_std_m=number(0))
    system = AvoidanceSystem(
        cw.Planner.of(cw.ReachLibrary.load_or_build(automaton, grid), settings),
        cw.Mission("m", start, waypoints_m=[[30, 0, 0], [50, 0, 0]], reach_radius_m=number(2)),
        lidars=(cw.Lidar("one", beams, sigma_m=number(1), airframe_radius_m=number(0)),),
        obstacle_map=world,
        limits=DataLimits(state_s=number(2), scan_s=number(3)),
        ground_m=number(-9),
    )
    system.warm_up()
    system.update(start)
    system.update(cw.Scan(np.array([[8.0, 1.0, 0.0]]), number(0), sensor="one"))
    system.update(cw.Intruder([8.0, 2.0, 0.0], [-1.0, 0.0, 0.0], radius_m=number(1), name="a"))
    system.decide(number(0))


def told_in(number: Callable[[float], float]) -> list[str]:
    asked: list[str] = []
    for escape in ("off", "strict"):
        decides(float, escape)
        with told_to(asked):
            decides(number, escape)
    return asked


CASES: dict[str, Callable[[], list[str]]] = {
    "settings of 4 bytes": lambda: told_in(np.float32),
    "settings of whole numbers": lambda: told_in(int),
    "deviations of 4 bytes": lambda: asked_in_flight(
        mission(),
        told=lambda state: replace(
            state, position_std_m=np.float32(0.1), attitude_std_rad=np.float32(0.01)
        ),
    ),
    "an attitude that nobody is sure about": lambda: asked_in_flight(
        mission(), told=lambda state: replace(state, attitude_std_rad=0.01 * (state.time_s > 1.0))
    ),
    "no deviation where one was told": lambda: asked_in_flight(
        mission(simulation={"attitude_sigma_deg": 0.5})
    ),
    "a scanner that falls silent": lambda: asked_in_flight(mission(), 8, seen=falls_silent),
    "two scanners": lambda: asked_in_flight(mission(lidar=TWO), 6),
    "two scanners, no ways out": lambda: asked_in_flight(
        mission(lidar=TWO, safety={"escape": "off"}), 6
    ),
    "another rule of detection": lambda: asked_in_flight(mission(rating={"detection": "surface"})),
    "a floor, set in flight": lambda: asked_in_flight(
        mission("intruders", traffic={"volumes": "f3442", "keep_volumes": True}),
        before=sets_a_floor,
    ),
}


def tell(name: str) -> None:
    print("asked", *CASES[name](), sep="\n")


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_asked_for_in_flight(name: str) -> None:
    assert asked_apart(CASES, name) == []
