"""Who can stop looks before it comes nearer to what nobody has seen than the margin."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors.observed.free_space import SHAPE, FreeSpace
from clearway.sensors.observed.free_voxels import pack_voxels
from clearway.sensors.observed.seen_space import SeenSpace
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import GRID, LIBRARY

VOXEL_M, MARGIN_M, BODY_M = 0.25, 0.6, 0.1
SETTINGS = AvoidanceSettings(safety_margin_m=MARGIN_M, body_radius_m=BODY_M)
PLANE = Planner.of(LIBRARY, SETTINGS)
MULTIROTOR = Planner.of(ReachLibrary.build(MovementAutomaton.inertialess(), GRID), SETTINGS)
ABOVE = np.array([3.0, 0.0, 12.0])


def seen_below(top_m: float, start_free_m: float = 0.0) -> SeenSpace:
    """All that lies below a height, and a ball about the start that was declared free."""
    seen = FreeSpace(VOXEL_M, np.zeros(3), start_free_m).seen
    free = np.zeros(SHAPE, dtype=np.bool_)
    layers = np.arange(-free.shape[2] // 2, round(top_m / VOXEL_M))
    free[:, :, layers % free.shape[2]] = True
    voxels = pack_voxels(free)
    return seen._replace(free=voxels, whole=voxels)


def above_m(planner: Planner, seen: SeenSpace, *known: Obstacle) -> float:
    """How high the first movement leads of who wants to go up."""
    situation = Situation(State(np.zeros(3)), ABOVE, obstacle_map=ObstacleMap(known), seen=seen)
    decision = decide(planner, situation)
    assert decision.way_out is not None
    assert decision.way_out.certain
    return highest_m(decision)


def highest_m(decision: Decision) -> float:
    reach_set = decision.prepared.reach_set
    first = reach_set.path(decision.choice.node)[0]
    return float(decision.frame.world_points(reach_set.samples_m[first])[:, 2].max())


@pytest.mark.parametrize("top_m", [0.75, 1.0, 1.25])
def test_the_margin_is_kept_from_what_nobody_has_seen(top_m: float) -> None:
    assert above_m(MULTIROTOR, seen_below(top_m)) <= top_m - MARGIN_M + 1e-6


def test_with_room_it_goes_where_it_wants() -> None:
    assert above_m(MULTIROTOR, seen_below(3.0)) > 0.4


def test_the_margin_kept_from_something_known_is_enough() -> None:
    """Beams clear nothing up to what they hit: a voxel before a roof is part of it."""
    roof = Obstacle.cuboid((0.0, 0.0, 1.7), (60.0, 60.0, 1.0))
    assert 0.4 < above_m(MULTIROTOR, seen_below(0.75), roof) <= 1.2 - MARGIN_M


def test_who_is_nearer_already_goes_on_but_no_nearer() -> None:
    """With 0.5 m seen above it, three quarters of the margin are kept."""
    assert above_m(MULTIROTOR, seen_below(0.5)) <= 0.5 - 0.75 * MARGIN_M + 1e-6


def test_about_the_start_nobody_could_look() -> None:
    assert above_m(MULTIROTOR, seen_below(0.75, start_free_m=1.0)) > 0.4
