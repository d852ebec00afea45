"""In a closed box no way leads to the goal: that is said, and the vehicle stays safe inside."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.grid import AvoidanceGrid
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode, Progress
from clearway.live.outputs.explain import NOT_REACHABLE
from clearway.live.routing.no_way import FLIES_ON_S, STAYS_S, note_whether_closed
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar
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


@pytest.mark.nightly
def test_a_multirotor_holds_inside_and_says_why() -> None:
    library = ReachLibrary.build(MovementAutomaton.inertialess(), GRID)
    holds_and_says_why(in_the_box(library, box(16.0, 14.0, 9.0, 9.0), 160.0))


def test_a_copter_stays_before_a_goal_that_is_closed_in_and_says_where_it_looked() -> None:
    automaton = MovementAutomaton.multirotor(speed_mps=3.0, climb_mps=1.0)
    library = ReachLibrary.load_or_build(automaton, AvoidanceGrid.uniform(range_m=20.0))
    rings = BeamPattern.rotating(np.arange(-25.0, 26.0, 2.0), 2.0, max_range_m=20.0)
    lidar = Lidar("rings", rings)
    settings = AvoidanceSettings(safety_margin_m=0.4, body_radius_m=0.2, smallest_object_m=0.3)
    goal = mission((9.0, 1.0, 0.0))
    world = ObstacleMap([Obstacle.cuboid(np.array([9.0, 1.0, 0.0]), np.array([4.0, 4.0, 7.0]))])
    system = AvoidanceSystem(Planner.of(library, settings), goal, lidars=(lidar,))
    run = simulate(system, world, lidars=(lidar,), settings=SimulationSettings(time_limit_s=60.0))
    stays_safe(run)
    reason = run.summary()["reason"]
    assert reason.startswith(f"{NOT_REACHABLE}: none keeps")
    assert "between heights of -3 and 3 m" in reason


def test_a_way_that_is_not_known_is_given_up_after_a_while_and_tried_again() -> None:
    def after(progress: Progress, *times_s: float) -> Progress:
        for time_s in times_s:
            progress = note_whether_closed(progress, time_s, is_known=False)
        return progress

    flies_on = after(Progress(), 5.0, 5.0 + FLIES_ON_S)
    assert not flies_on.closed
    stays = after(flies_on, 5.1 + FLIES_ON_S)
    assert stays.closed
    found = note_whether_closed(stays, 20.0, is_known=True)
    assert (found.closed, found.closed_s) == (False, Progress().closed_s)
    again_s = 5.2 + FLIES_ON_S + STAYS_S
    again = after(stays, again_s - 0.2, again_s)
    assert not again.closed
    closed_s = again_s + FLIES_ON_S + 0.1
    once_more = after(again, closed_s, closed_s + STAYS_S + 0.1)
    assert once_more.closed
    assert not after(once_more, closed_s + 2.0 * STAYS_S + 0.1).closed


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
