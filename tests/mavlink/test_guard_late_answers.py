"""The guardian of a copter that answers as ArduCopter does: late, and eagerly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from clearway.mavlink.simulated_habits import Habits
from clearway.mavlink.simulated_targets import VelocityTarget
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from companion_missions import mission
from guarded_inertia import GuardedCopter

SPEED_MPS, BRAKES_MPS2, MARGIN_M = 3.0, 2.0, 1.5
EAGER = Habits(tilt_s=0.2, acceleration_mps2=5.0, jerk_mps3=20.0, dead_s=0.2)
"""Commanded a velocity it gains speed by 5 m/s2, where it is planned to brake by 2."""


ARDUCOPTER = Habits(
    tilt_s=0.15, acceleration_mps2=5.0, jerk_mps3=20.0, dead_s=0.25, trims_for_s=2.0
)


def wall(face_m: float) -> ObstacleMap:
    return ObstacleMap([Obstacle.cuboid([face_m + 0.5, 0.0, 5.0], (1.0, 60.0, 20.0))])


def straight_on(
    start_m: float, world: ObstacleMap, speed_mps: float = SPEED_MPS, habits: Habits = EAGER
) -> GuardedCopter:
    file, setup = mission(
        mission={"name": "g", "waypoints_m": [[200, 0, 7]], "reach_radius_m": 2},
        vehicle={
            "kind": "multirotor",
            "position_m": [start_m, 0, 7],
            "speed_mps": speed_mps,
            "acceleration_mps2": BRAKES_MPS2,
            "lag_s": 0.3,
        },
        grid={"range_m": 30, "layers": 10},
        safety={"margin_m": MARGIN_M, "smallest_object_m": 3.0},
        lidar=[{"max_range_m": 30.0}],
    )
    wish = np.array([speed_mps, 0.0, 0.0])
    return GuardedCopter(file, replace(setup, world=world), lambda *_: wish, habits, 10.0)


def test_an_escape_that_is_flown_is_not_begun_anew_at_every_tick() -> None:
    """A wall appears too near to keep the margin: braking goes on to rest, however often it is
    decided that there is nothing better."""
    flight = straight_on(0.0, ObstacleMap([]))
    flight.run(3.0)
    face_m = float(flight.autopilot.truth.position_m[0]) + 3.6
    flight.autopilot._setup = replace(flight.autopilot._setup, world=wall(face_m))
    told = []
    while flight.autopilot.time_s < 3.0 + SPEED_MPS / BRAKES_MPS2 + 0.5:
        guarded = flight.step().guarded
        assert guarded is not None
        told.append(float(guarded.velocity_mps[0]))
    slower = -np.diff(told)
    assert np.all(slower >= -1e-6)
    assert told[-1] == 0.0
    assert flight.autopilot.nearest_obstacle_m < MARGIN_M  # So the escape was all there was.


def test_a_wish_near_a_wall_is_held_against_how_an_autopilot_gains_speed() -> None:
    """From rest, where a copter that gains speed no harder than it brakes could still stop."""
    flight = straight_on(0.0, wall(3.4))
    first = next(g for g in (flight.step().guarded for _ in range(20)) if g is not None)
    assert not first.passed
    assert np.linalg.norm(first.velocity_mps) < 0.8 * SPEED_MPS
    flight.run(12.0)
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M


def test_it_keeps_to_one_kind_of_set_point_where_another_begins_a_controller_anew() -> None:
    """As ArduCopter does, which takes what it accelerates by then for wind."""
    flight = straight_on(0.0, wall(17.5), 5.0, ARDUCOPTER)
    kinds = set()
    while flight.autopilot.time_s < 10.0:
        flight.step()
        if flight.autopilot.target is not None:
            kinds.add(type(flight.autopilot.target))
    assert flight.session.core.tally["replaced"] > 0
    assert kinds == {VelocityTarget}
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M
    steps = np.diff(np.array(flight.track)[-30:], axis=0)
    assert np.linalg.norm(steps, axis=1).sum() < 0.3  # It does not hunt in the last 3 s.
