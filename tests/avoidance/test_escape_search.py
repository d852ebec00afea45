"""The search for a way out finds the first that keeps what is asked, as trying them all does."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.avoidance.escape_chains import chain_keeps
from clearway.avoidance.escape_legs import was_seen
from clearway.avoidance.escape_search import first_escape, loop_places, movements_of
from clearway.avoidance.evidence import in_reach
from clearway.avoidance.ways_out import WaysOut
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import simulate_scan
from worlds_for_tests import LIDAR, mission, planner

PLANNER = planner()
BALLS = ObstacleMap([Obstacle.ball([9.0, 1.5, 0.0], 1.0), Obstacle.ball([6.0, -4.0, 0.5], 1.0)])


@pytest.fixture(scope="module")
def ways() -> WaysOut:
    """What is known after a few movements straight on."""
    system = AvoidanceSystem(PLANNER, mission((40.0, 0.0, 0.0)), (LIDAR,))
    for at in range(4):
        here = State(np.array([float(at), 0.0, 0.0]), time_s=float(at))
        system.update(here)
        system.update(simulate_scan(LIDAR, BALLS, here))
        situation = system.situation(float(at))[0]
    assert PLANNER.escapes is not None
    return WaysOut(PLANNER, PLANNER.escapes, situation, in_reach(PLANNER, situation))


@pytest.mark.parametrize("aloof_m", [(0.2,), (0.6, 0.2), (1.5, 0.6), (3.0, 2.0)])
@pytest.mark.parametrize("ahead_m", [0.0, 2.0])
def test_the_first_that_keeps_it(ways, aloof_m, ahead_m) -> None:
    library, terms = ways.library, ways._terms
    escapes, legs, pose = library.ways[0], library.legs, np.array([ahead_m, 0.0, 0.0, 0.0])
    found, _ = first_escape(
        escapes, legs, loop_places(escapes, legs), 0, pose, 0.0, terms, np.array(aloof_m)
    )
    for unseen_m in aloof_m:
        asked = terms._replace(unseen_m=unseen_m)
        upto = found if found >= 0 else len(escapes.begins) - 1
        for escape in range(upto + 1):
            if chain_keeps(movements_of(escapes, escape), 0, pose, 0.0, legs, asked):
                assert escape == found
                return
    assert found < 0


def test_some_are_found_and_some_not(ways) -> None:
    library = ways.library
    escapes, legs = library.ways[0], library.legs
    loops, pose = loop_places(escapes, legs), np.zeros(4)
    near, far = (
        first_escape(escapes, legs, loops, 0, pose, 0.0, ways._terms, np.array([unseen_m]))[0]
        for unseen_m in (0.2, 30.0)
    )
    assert near > 0 > far


@pytest.mark.parametrize("seed", range(12))
def test_a_way_counts_as_seen_only_where_all_that_the_body_passes_was(ways, seed: int) -> None:
    """Held against places all over the body all along the way."""
    rng = np.random.default_rng(seed)
    shape = ways._terms.free.shape
    free = (rng.random(shape) < 0.999).astype(np.uint8)
    terms = ways._terms._replace(free=free, unseen_m=float(rng.uniform(0.05, 0.5)))
    assert terms.yaw_rad == 0.0, "level frame and world differ by a place alone"
    ball = rng.normal(size=(300, 3))
    ball *= (rng.random(300) ** (1.0 / 3.0) / np.linalg.norm(ball, axis=1))[:, None]
    seen = 0
    for _ in range(20):
        corners = rng.uniform(2.0, 6.0, 3) + np.cumsum(rng.uniform(-0.4, 0.4, (6, 3)), axis=0)
        if not was_seen(corners, 0.0, terms):
            continue
        seen += 1
        shares = np.linspace(0.0, 5.0, 51)
        along = np.stack([np.interp(shares, range(6), corners[:, axis]) for axis in range(3)], 1)
        places = terms.origin_m + (along[:, None] + terms.unseen_m * ball).reshape(-1, 3)
        a, b, c = np.floor(places * terms.window[3]).astype(np.int64).T
        assert free[a % shape[0], b % shape[1], c % shape[2]].all()
    assert seen
