"""What is flown where no trajectory leaves a way out with the whole margin."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors.observed.free_space import SHAPE, FreeSpace
from clearway.sensors.observed.free_voxels import pack_voxels
from clearway.sensors.observed.seen_space import SeenSpace
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


@pytest.mark.parametrize("had_certain", [False, True])
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
