"""Rivals for traffic: velocity obstacles and modified voltage potential, by their geometry."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.sim.baselines import PLANNERS
from clearway.sim.baselines.known import MovingBalls
from clearway.sim.baselines.mvp import resolutions
from clearway.sim.baselines.velocity_obstacle import free_times

AHEAD = np.array([1.0, 0.0, 0.0])


def ball(position, velocity=(0.0, 0.0, 0.0), radius=0.0, growth=0.0):
    return MovingBalls(
        np.array([position], dtype=np.float64),
        np.array([velocity], dtype=np.float64),
        np.array([radius], dtype=np.float64),
        np.array([growth], dtype=np.float64),
    )


def towards(azimuth, elevation=0.0):
    return np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
         np.sin(elevation)]
    )  # fmt: skip


def at_once(directions, balls, spare=1.2, horizon=50.0):
    """Free times of a vehicle at 1 m/s that turns at once."""
    return free_times(np.array(directions), AHEAD, 1.0, np.inf, balls, spare, horizon)


@pytest.mark.parametrize("elevated", [False, True])
def test_what_stands_still_forbids_the_cone_that_touches_it(elevated):
    edge = np.arcsin(1.2 / 8.0)
    angles = [0.0, edge - 1e-6, edge + 1e-6]
    directions = [towards(0.0, a) if elevated else towards(a) for a in angles]
    free = at_once(directions, ball([8.0, 0.0, 0.0]))
    assert free[0] == pytest.approx(8.0 - 1.2)
    assert free[1] == pytest.approx(8.0 * np.cos(edge), abs=0.02)
    assert free[2] == 50.0


def test_the_cone_moves_with_the_ball():
    """Its apex is the other's velocity: relative to that the cone is tested."""
    other = np.array([0.3, -0.4, 0.1])
    position = np.array([7.0, 5.0, -1.0])
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    free = at_once(directions, ball(position, other), horizon=1e4)
    relative = directions - other
    angle = np.arccos(relative @ position / np.linalg.norm(relative, axis=1)
                      / np.linalg.norm(position))  # fmt: skip
    np.testing.assert_array_equal(free < 1e4, angle < np.arcsin(1.2 / np.linalg.norm(position)))
    assert 0 < (free < 1e4).sum() < 400


def test_beyond_the_horizon_everything_is_admissible_and_inside_a_ball_the_way_out_is():
    assert at_once([AHEAD], ball([8.0, 0.0, 0.0]), horizon=6.0)[0] == 6.0
    inside = ball([0.5, 0.0, 0.0])
    np.testing.assert_array_equal(at_once([AHEAD, -AHEAD], inside), [0.0, 50.0])


def test_turning_first_takes_its_time_and_its_arc():
    rate = np.radians(15.0)
    left = towards(np.pi / 2)
    radius = 1.0 / rate
    # The arc ends at (radius, radius), and 6 s have passed; the ball comes there a little later.
    meets = ball([radius, radius + 5.0, 0.0], radius=0.5)
    free = free_times(np.array([left]), AHEAD, 1.0, rate, meets, 0.5, 60.0)
    assert free[0] == pytest.approx(6.0 + 4.0)
    at_once_free = at_once([left], meets, spare=0.5)
    assert at_once_free[0] == 50.0


def test_a_growing_ball_forbids_more():
    edge = np.arcsin(1.2 / 8.0) + 0.02
    direction = [towards(edge)]
    assert at_once(direction, ball([8.0, 0.0, 0.0]))[0] == 50.0
    assert at_once(direction, ball([8.0, 0.0, 0.0], growth=0.1))[0] < 50.0


def test_mvp_moves_the_closest_approach_out_by_the_intrusion():
    """Displacement at the closest approach = zone / cos(tangent - past) - miss, away from it."""
    velocity = AHEAD
    other, position, zone = np.array([-0.6, 0.1, 0.05]), np.array([10.0, -0.6, -0.4]), 1.2
    (change,) = resolutions(velocity, ball(position, other), zone, 60.0)
    rush = velocity - other
    nearest = float(position @ rush / (rush @ rush))
    miss = nearest * rush - position
    missed, distance = np.linalg.norm(miss), np.linalg.norm(position)
    assert missed < zone
    moved = change * nearest
    graze = np.cos(np.arcsin(zone / distance) - np.arcsin(missed / distance))
    np.testing.assert_allclose(moved, (zone / graze - missed) * miss / missed, rtol=1e-9)
    # The displacement is the intrusion itself but for the graze, which is small this far away.
    assert np.linalg.norm(moved) == pytest.approx(zone - missed, rel=0.05)


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.9])
def test_the_velocity_that_mvp_asks_for_just_keeps_the_zone(offset):
    other, position, zone = np.array([-0.8, 0.0, 0.0]), np.array([12.0, offset, 0.0]), 1.2
    balls = ball(position, other)
    (change,) = resolutions(AHEAD, balls, zone, 60.0)
    rush = AHEAD + change - other
    nearest = float(position @ rush / (rush @ rush))
    assert np.linalg.norm(nearest * rush - position) == pytest.approx(zone, rel=2e-3)
    assert change[1] > 0.0 if offset == 0.0 else change[1] < 0.0


@pytest.mark.parametrize(
    "balls",
    [
        ball([10.0, 3.0, 0.0], (-0.5, 0.0, 0.0)),
        ball([10.0, 0.0, 0.0], (1.5, 0.0, 0.0)),
        ball([-5.0, 0.0, 0.0]),
        ball([80.0, 0.0, 0.0]),
    ],
    ids=["passes aside", "flies away", "behind", "beyond the horizon"],
)
def test_without_a_conflict_nothing_changes(balls):
    np.testing.assert_array_equal(resolutions(AHEAD, balls, 1.2, 30.0), np.zeros((1, 3)))


def test_inside_the_zone_the_whole_intrusion_is_asked_for():
    (change,) = resolutions(AHEAD, ball([0.6, 0.5, 0.0]), 1.2, 30.0)
    assert change[1] == pytest.approx(-(1.2 - 0.5) / 0.6)


@cache
def setup():
    return prepare(read_mission("intruders-collision"))


@pytest.mark.parametrize("planner", ["velocity-obstacle", "mvp"])
def test_they_fly_through_colliding_traffic(planner):
    assert planner in PLANNERS
    run = setup().fly_with(planner)
    assert run.reached
    assert run.crashed_s is None
    assert run.metrics.intruders.min_distance_m > 1.0
    assert any("velocit" in entry.flight.explanation for entry in run.decisions)
