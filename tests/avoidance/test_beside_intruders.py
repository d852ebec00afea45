"""An intruder that leaves no margin at all is no reason to fly into what stands still."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.traffic import Intruder
from worlds_for_tests import planner

PLANNER = planner(escape="known")


@pytest.mark.parametrize("seed", range(6))
def test_what_is_flown_past_it_leaves_a_way_out(seed: int) -> None:
    """An aircraft on top of us, and a wall ahead that turning at once just clears."""
    rng = np.random.default_rng(seed)
    wall_m = rng.uniform(5.2, 7.0)
    wall = ObstacleMap([Obstacle.cuboid([wall_m + 0.5, 0.0, 0.0], (1.0, 200.0, 200.0))])
    place_m, velocity_mps = rng.normal(0.0, 0.3, 3), rng.normal(0.0, 0.5, 3)
    on_top = Intruder(place_m, velocity_mps, name="on top", radius_m=3.0)
    here, there = State(np.zeros(3)), np.array([30.0, 0.0, 0.0])
    decision = decide(PLANNER, Situation(here, there, obstacle_map=wall, intruders=[on_top]))
    assert decision.choice.basis is Basis.EMERGENCY
    assert decision.way_out is not None
    first = PLANNER.automaton.rollout(here.vector, decision.movements[:1]).states[:, :3]
    flown = np.concatenate([first, decision.way_out.path_m])
    assert flown[:, 0].max() <= wall_m - 0.6 + 1e-3
