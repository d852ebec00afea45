"""Metrics of a track against answers known by geometry."""

import numpy as np
import pytest

from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.metrics import distance_to_polyline, episodes, measure_flight, straight_distances


def circle(radius, step_s=0.05):
    """A horizontal circle flown at 1 m/s."""
    time_s = np.arange(0.0, 2 * np.pi * radius, step_s)
    states = np.zeros((len(time_s), 6))
    states[:, 0] = radius * np.cos(time_s / radius)
    states[:, 1] = radius * np.sin(time_s / radius)
    return time_s, states


def test_a_circle_has_its_length_distance_and_effort():
    time_s, states = circle(4.0)
    world = ObstacleMap([Obstacle.ball([0, 0, 0], 1.0)])
    metrics = measure_flight(time_s, states, world, np.array([[4.0, 0, 0], [4.0, 1.0, 0]]), 0.6)
    assert metrics.path_length_m == pytest.approx(2 * np.pi * 4.0, rel=5e-3)
    # Between samples the track is taken for straight: chords of 0.05 m cut 8e-5 m off the circle.
    np.testing.assert_allclose(metrics.obstacle_distance_m, 3.0, atol=1e-4)
    assert metrics.margin_violations == 0
    # Centripetal acceleration 1/r for the time of one turn.
    assert metrics.effort_m2ps3 == pytest.approx(2 * np.pi / 4.0, rel=0.01)
    assert metrics.climb_m == 0.0


def test_violations_are_counted_in_episodes():
    assert episodes(np.array([True, True, False, True, False])) == 2
    assert episodes(np.array([], dtype=bool)) == 0
    time_s = np.arange(0.0, 20.0, 0.05)
    states = np.zeros((len(time_s), 6))
    states[:, 0] = time_s
    world = ObstacleMap([Obstacle.ball([x, 1.5, 0], 1.0) for x in (5.0, 15.0)])
    metrics = measure_flight(time_s, states, world, np.array([[0.0, 0, 0], [20.0, 0, 0]]), 0.6)
    assert metrics.margin_violations == 2
    assert metrics.min_obstacle_distance_m == pytest.approx(0.5, abs=1e-3)


def test_distance_to_a_polyline():
    corners = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 10.0, 0]])
    points = np.array([[5.0, 2.0, 0], [12.0, 5.0, 0], [-3.0, 4.0, 0]])
    np.testing.assert_allclose(distance_to_polyline(points, corners), [2.0, 2.0, 5.0])


def test_straight_flight_among_the_same_tracks_ends_with_the_way():
    """Round a corner at 2 m/s: one stands 1 m beside the first leg, one beyond the end."""
    time_s = np.arange(0.0, 20.0, 0.05)
    corners = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 10.0, 0]])
    standing = {"beside": [5.0, 1.0, 0.0], "beyond": [10.0, 14.0, 0.0]}
    tracks = {
        name: [(time, np.array(place)) for time in time_s] for name, place in standing.items()
    }
    margins = dict.fromkeys(tracks, 1.5)
    found = straight_distances(time_s, corners, 2.0, tracks, margins)
    assert found.names == ("beside", "beyond")
    assert found.distance_m.min(axis=1) == pytest.approx([1.0, 4.0], abs=1e-9)
    assert np.argmin(found.distance_m, axis=1) * 0.05 == pytest.approx([2.5, 10.0])
    assert np.isinf(found.distance_m[:, time_s > 10.0 + 1e-6]).all()
    assert found.violations == 1
    assert straight_distances(time_s, corners, 2.0, {}, {}) is None
