"""What is flown where no trajectory leaves a way out with the whole margin."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.store import ReachLibrary
from clearway.sensors.observed.free_space import SHAPE, FreeSpace
from clearway.sensors.observed.free_voxels import pack_voxels
from clearway.sensors.observed.seen_space import SeenSpace
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import planner

VOXEL_M = 0.25


def seen_left_of(right_m: float) -> SeenSpace:
    """All that lies to the left of a plane."""
    seen = FreeSpace(VOXEL_M, np.zeros(3)).seen
    free = np.zeros(SHAPE, dtype=np.bool_)
    rows = np.arange(int(np.floor(right_m / VOXEL_M)), free.shape[1] // 2)
    free[:, rows % free.shape[1]] = True
    voxels = pack_voxels(free)
    return seen._replace(free=voxels, whole=voxels)


@pytest.mark.parametrize("had_certain", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_only_the_first_certain_way_out_is_waited_for(had_certain: bool) -> None:
    """Between a wall and what nobody has seen a loop keeps half of the margin, where thin things
    are declared: one that leads into the unseen is better only before any certain one was in
    hand."""
    wall = ObstacleMap([Obstacle.cuboid((0.0, 7.0, 0.0), (100.0, 1.0, 100.0))])
    decision = decide(
        planner(smallest_object_m=0.01, body_radius_m=0.3),
        Situation(
            State(np.zeros(3)),
            np.array([40.0, 0.0, 0.0]),
            obstacle_map=wall,
            seen=seen_left_of(-1.0),
        ),
        commitment=Commitment(had_certain=had_certain, certain_within=2),
    )
    way = decision.way_out
    assert way is not None
    assert way.certain == had_certain
    assert (way.margin_m < decision.margin_m) == had_certain


COPTER = MovementAutomaton.multirotor(speed_mps=8.0, acceleration_mps2=4.0)


@pytest.fixture(scope="module")
def careful() -> Planner:
    library = ReachLibrary.load_or_build(COPTER, AvoidanceGrid.uniform(range_m=20.0))
    return Planner.of(library, AvoidanceSettings(escape="mapped", safety_margin_m=0.4))


@pytest.mark.parametrize("bearing_deg", [180.0, 100.0, 40.0, 0.0])
@pytest.mark.parametrize("gap_m", [0.39, 0.36, 0.3, 0.25])
def test_a_copter_that_stands_too_near_moves_off_and_comes_no_nearer(
    careful: Planner, gap_m: float, bearing_deg: float
) -> None:
    """Nothing keeps the margin where noise or wind have brought it: who waits there, waits on."""
    assert COPTER.classes is not None
    tube_m = float(careful.prepared_sets[COPTER.classes.first][1].paths.sagitta_m.min())
    bearing, radius_m = np.radians(bearing_deg), 1.0
    center = (gap_m + tube_m + radius_m) * np.array([np.cos(bearing), np.sin(bearing), 0.0])
    beside = ObstacleMap([Obstacle.ball(center, radius_m)])
    state, bases, track = COPTER.in_class(State(np.zeros(3)), None), [], [np.zeros(3)]
    for _ in range(12):
        there = Situation(state, np.array([30.0, 0.0, 0.0]), obstacle_map=beside)
        decision = decide(careful, there)
        bases.append(decision.choice.basis)
        states = COPTER.rollout(state.vector, decision.movements[:1]).states
        track += list(states[1:, :3])
        state = State(states[-1, :3], states[-1, 3:])
    off_m = np.linalg.norm(np.array(track) - center, axis=1) - radius_m
    assert bases[0] is Basis.NO_NEARER
    assert off_m.min() >= off_m[0] - 1e-9
    assert off_m[-1] > 0.4 + tube_m
    assert bases[-1] is Basis.RATED
