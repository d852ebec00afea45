"""A guarded copter with inertia that is commanded straight at masts and walls, at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from clearway.mavlink.simulated_habits import Habits
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from companion_missions import mission
from guarded_inertia import GuardedCopter

MARGIN_M, HEIGHT_M, AWAY_M = 1.5, 7.0, 22.0
ROUNDED_M = 0.01
"""Distances are told in centimetres."""


def straight_at(seed: int) -> GuardedCopter:
    """A flight at 1 to 10 m/s, of a copter that states its inertia or of one that does not."""
    rng = np.random.default_rng(seed)
    speed = float(rng.uniform(1.0, 10.0))
    kind = ("multirotor", "inertialess")[seed % 2]
    file, setup = mission(
        mission={"name": "g", "waypoints_m": [[200, 0, HEIGHT_M]], "reach_radius_m": 2},
        vehicle={"kind": kind, "position_m": [0, 0, HEIGHT_M], "speed_mps": speed},
        grid={"range_m": 30, "layers": 10},
        safety={"margin_m": MARGIN_M, "smallest_object_m": 3.0},
        lidar=[{"max_range_m": 30.0}],
    )
    aside = float(rng.uniform(-2.0, 2.0))
    mast = Obstacle.line_between([AWAY_M, aside, 0.0], [AWAY_M, aside, 20.0], radius_m=1.5)
    wall = Obstacle.cuboid([AWAY_M, aside, 10.0], (2.0, 25.0, 20.0))
    habits = Habits(
        tilt_s=float(rng.uniform(0.1, 0.2)), acceleration_mps2=float(rng.uniform(3.5, 5.0))
    )
    course = float(rng.uniform(-0.05, 0.05))
    wish = speed * np.array([np.cos(course), np.sin(course), 0.0])
    world = ObstacleMap([mast if rng.random() < 0.5 else wall])
    flight = GuardedCopter(file, replace(setup, world=world), lambda _time, _place: wish, habits)
    flight.run(6.0 + AWAY_M / speed)
    return flight


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(n, marks=pytest.mark.nightly) for n in range(2, 250))]
)
def test_it_never_comes_nearer_than_the_margin(seed: int) -> None:
    flight = straight_at(seed)
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M - ROUNDED_M
    tally = flight.session.core.tally
    assert tally["passed"] + tally["slowed"] > 0
