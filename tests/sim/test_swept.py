"""Distances along the segments of a track: thin things between two samples are found."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.metrics import intruder_distances
from clearway.sim.swept import measure_swept_distance_m, touches
from in_process import clearway

TUNNEL = """
[mission]
name = "thin-wall"
waypoints_m = [[60, 0, 0]]
[vehicle]
speed_mps = 15
[grid]
range_m = 100
[safety]
margin_m = 0.25
[[lidar]]
[[obstacle]]
shape = "cuboid"
position_m = [30.125, 0, 0]
size_m = [0.1, 40, 40]
"""


def test_a_wall_between_two_samples_is_touched():
    wall = ObstacleMap([Obstacle.cuboid([0.4, 0, 0], (0.001, 10, 10))])
    track = np.array([[0.0, 0, 0], [0.75, 0, 0], [1.5, 0, 0]])
    distance = measure_swept_distance_m(wall, track, 0.25)
    assert distance[1] <= 0.0
    assert distance[2] == pytest.approx(0.3495, abs=1e-6)


@given(
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.floats(0.001, 1.5),
    st.sampled_from([0.0, 0.002, 0.3]),
)
def test_a_step_touches_where_its_least_distance_says_so(start, end, radius, thin):
    world = ObstacleMap(
        [Obstacle.ball([0.2, 0, 0], radius), Obstacle.cuboid([1, 0, 0], (thin + 0.001, 4, 4))]
    )
    step = np.array([start, end])
    hit, at_end = touches(world, step, 0.5)
    assert hit == (measure_swept_distance_m(world, step, 0.5)[1] <= 0.0)
    assert at_end == world.distance_m(step[1:])[0]


@given(
    st.lists(st.tuples(*[st.floats(-3, 3)] * 3), min_size=2, max_size=6),
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.floats(0.01, 0.8),
)
def test_never_farther_than_dense_samples_say(corners, center, radius):
    world = ObstacleMap([Obstacle.ball(center, radius)])
    track = np.array(corners, dtype=float)
    distance = measure_swept_distance_m(world, track, 0.5)
    for n in range(1, len(track)):
        along = np.linspace(0, 1, 400)[:, None]
        truth = world.distance_m(track[n - 1] + along * (track[n] - track[n - 1])).min()
        if truth < 0.5 - 1e-3 or distance.min() == distance[n]:
            assert (distance[n] < 0.5) == (truth < 0.5) or abs(truth - 0.5) < 1e-3
        if truth < -1e-3:
            assert distance[n] <= 0.0
    dense = np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(track)])
    assert distance.min() <= world.distance_m(dense).min() + 1e-3


def test_intruders_that_swap_places_between_two_samples_meet():
    times = np.array([0.0, 1.0])
    own = np.array([[0.0, 0, 0], [10.0, 0, 0]])
    tracks = {"other": [(0.0, np.array([10.0, 1.0, 0])), (1.0, np.array([0.0, 1.0, 0]))]}
    found = intruder_distances(times, own, tracks, {"other": 2.0})
    assert found is not None
    assert found.min_distance_m == pytest.approx(1.0)
    assert found.violations == 1


def test_a_flight_through_a_thin_wall_ends_in_it(tmp_path):
    (tmp_path / "mission.toml").write_text(TUNNEL)
    done = clearway(
        *("fly", "mission.toml", "--planner", "straight", "--no-plots", "--json"), cwd=tmp_path
    )
    assert done.returncode == 1, done.stderr
    assert '"crashed_s": 2.0' in done.stdout
