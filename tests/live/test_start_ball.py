"""A vehicle that can stop leaves its start: the ball about it reaches to what is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.live.preflight.escape_plan import escape_plan
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, Mounting, Scan
from clearway.vehicle.automaton import MovementAutomaton

GRID = AvoidanceGrid.uniform()
BODY = AvoidanceSettings(safety_margin_m=0.6, body_radius_m=0.3)
PATTERN = BeamPattern.per_cell(GRID, 8, elevations_per_cell=4, max_range_m=10.0)


@pytest.fixture(scope="module")
def stops() -> Planner:
    return Planner.of(ReachLibrary.build(MovementAutomaton.inertialess(1.0), GRID), BODY)


def lidar(place_m: tuple[float, float, float], down_rad: float = 0.0) -> Lidar:
    return Lidar(
        "front", PATTERN, mounting=Mounting(np.array(place_m), np.array([0.0, down_rad, 0.0]))
    )


def test_of_a_small_body_a_movement_is_enough(stops: Planner) -> None:
    small = stops.with_values(body_radius_m=0.1)
    plan = escape_plan(small, [lidar((0.0, 0.0, 0.0))])
    assert (plan.within, plan.start_free_m) == (0, None)
    assert plan.adapt_planner(small) is small


@pytest.mark.parametrize(
    ("place_m", "down_rad"),
    [((0.2, 0.0, 0.1), 0.0), ((0.2, 0.0, 0.1), 0.35), *(
        pytest.param(place_m, 0.0, marks=pytest.mark.nightly)
        for place_m in ((0.4, 0.0, 0.0), (0.0, 0.0, 0.25), (0.15, 0.2, -0.2))
    )],
)  # fmt: skip
def test_from_elsewhere_more_counts_as_free_and_that_is_said(
    stops: Planner, place_m: tuple[float, float, float], down_rad: float
) -> None:
    """With the length of a movement it holds its place for ever, a way out in hand."""
    sensor, start = lidar(place_m, down_rad), State(np.zeros(3))
    plan = escape_plan(stops, [sensor])
    assert plan.flown == "strict"
    assert plan.start_free_m is not None
    assert 1.0 < plan.start_free_m <= 3.0
    assert f"{plan.start_free_m:.3g} m around the start count as free" in plan.why
    for asked_m, leaves in ((None, True), (1.0, False)):
        settings = replace(stops.settings, start_free_m=asked_m)
        mission = Mission("on", start, waypoints_m=np.array([[30.0, 0.0, 0.0]]))
        system = AvoidanceSystem(replace(stops, settings=settings), mission, lidars=(sensor,))
        system.update(start)
        system.update(Scan(np.zeros((0, 3)), 0.0, sensor="front"))
        flown = system.decide(0.0)
        assert flown.decision.way_out is not None
        assert (flown.movements[0] == "Straight") is leaves


def test_who_asks_for_less_is_told_what_would_do(stops: Planner) -> None:
    less = stops.with_values(start_free_m=1.0)
    plan = escape_plan(less, [lidar((0.2, 0.0, 0.1))])
    assert plan.start_free_m is None
    assert "it may stay where it starts, start_free_m = 1." in plan.why


def test_who_cannot_stop_flies_on_as_before() -> None:
    flies = Planner.of(ReachLibrary.build(MovementAutomaton.plane(1.0), GRID), BODY)
    plan = escape_plan(flies, [lidar((0.2, 0.0, 0.1))])
    assert plan.start_free_m is None
    assert "farther on" not in plan.why
