"""Clusters of returns: bodies come out whole and apart, and beams prove what has moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ball_world import BallWorld
from clearway.base.state import State
from clearway.sensors import Lidar, Scan, simulate_scan
from clearway.sensors.passing.clusters import cluster_returns
from clearway.sensors.passing.sightings import (
    Sighting,
    is_passed,
    place_beams,
    share_passed,
    sight_bodies,
)
from worlds_for_tests import LIDAR

GAP = 0.3
HERE = State(np.zeros(3))


def sighted(scan: Scan, state: State = HERE, lidar: Lidar = LIDAR, **more: float) -> list[Sighting]:
    frame = place_beams(lidar, scan, state, 3.0)
    limits = {"gap_m": GAP, "largest_m": 2.4, "returns": 5} | more
    return sight_bodies(frame, lidar, scan, state, **limits)  # type: ignore[arg-type]


def look(world: BallWorld, state: State = HERE, seed: int = 0) -> Scan:
    return simulate_scan(LIDAR, world, state, seed)


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
@settings(max_examples=40, deadline=None)
def test_groups_that_lie_apart_come_out_whole_in_any_order(seed: int, groups: int) -> None:
    rng = np.random.default_rng(seed)
    points, owner = [], []
    for group in range(groups):
        # Chains of steps below half the gap, along any direction, each far from all others.
        steps = rng.uniform(-1.0, 1.0, (int(rng.integers(1, 40)), 3))
        steps *= 0.4 * GAP / np.linalg.norm(steps, axis=1, keepdims=True)
        points.append(np.cumsum(steps, axis=0) + np.array([0.0, 100.0 * group, 0.0]))
        owner += [group] * len(steps)
    order = rng.permutation(len(owner))
    placed, owners = np.concatenate(points)[order], np.array(owner)[order]
    clusters = cluster_returns(placed, np.zeros(len(placed)), np.array([-50.0, 0.0, 0.0]), GAP)
    assert len(clusters.half_width_m) == groups
    for number in range(groups):
        members = clusters.points_m[clusters.start[number] : clusters.start[number + 1]]
        group = round(float(members[0, 1]) / 100.0)
        expected = placed[owners == group]
        np.testing.assert_array_equal(
            members[np.lexsort(members.T)], expected[np.lexsort(expected.T)]
        )
        np.testing.assert_allclose(clusters.mean_m[number], expected.mean(axis=0), atol=1e-9)


def test_no_returns_make_no_cluster() -> None:
    clusters = cluster_returns(np.zeros((0, 3)), np.zeros(0), np.zeros(3), GAP)
    assert len(clusters.half_width_m) == 0
    assert clusters.start.tolist() == [0]


def test_far_returns_belong_together_as_far_apart_as_the_beams_are() -> None:
    pair = np.array([[20.0, 0.0, 0.0], [20.0, 0.8, 0.0]])
    near = cluster_returns(pair, np.full(2, 0.1), np.zeros(3), GAP)
    far = cluster_returns(pair, np.full(2, 0.3), np.zeros(3), GAP)
    assert (len(near.half_width_m), len(far.half_width_m)) == (2, 1)


@pytest.mark.parametrize("distance", [3.0, 6.0, 9.0])
@pytest.mark.parametrize("bearing_deg", [-30.0, 0.0, 20.0])
def test_a_ball_is_placed_and_measured(distance: float, bearing_deg: float) -> None:
    angle = np.radians(bearing_deg)
    center = distance * np.array([np.cos(angle), np.sin(angle), 0.1])
    (body,) = sighted(look(BallWorld.of((tuple(center), 0.6))))
    spacing = 2.0 * body.half_spacing_m
    assert body.half_width_m == pytest.approx(0.6, abs=spacing)
    assert np.linalg.norm(body.center_m(0.6) - center) < 0.1


def test_two_bodies_apart_are_two_and_large_or_few_returns_are_none() -> None:
    world = BallWorld.of(((7.0, 1.2, 0.0), 0.6), ((7.0, -1.2, 0.0), 0.6), ((8.0, 5.0, 0.0), 0.1))
    assert len(sighted(look(world))) == 2
    assert sighted(look(BallWorld.of(((8.0, 0.0, 0.0), 4.0)))) == []
    assert len(sighted(look(BallWorld.of(((8.0, 0.0, 0.0), 4.0))), largest_m=5.0)) == 1


@pytest.mark.parametrize("tilt_deg", [0.0, 10.0, 45.0, 90.0])
def test_wires_are_no_bodies(tilt_deg: float) -> None:
    tilt = np.radians(tilt_deg)
    along = np.linspace(-2.0, 2.0, 200)[:, None] * [0.0, np.cos(tilt), np.sin(tilt)]
    wire = np.array([7.0, 0.0, 0.0]) + along
    assert sighted(Scan(wire, 0.0, sensor="lidar")) == []


def test_nan_and_infinite_returns_are_left_out() -> None:
    scan = look(BallWorld.of(((7.0, 0.0, 0.0), 0.6)))
    bad = np.array([[np.nan, 1.0, 1.0], [np.inf, 0.0, 0.0], [7.0, np.nan, 0.0]])
    (body,) = sighted(replace(scan, points_m=np.concatenate([bad, scan.points_m])))
    assert np.isfinite(body.mean_m).all()
    assert len(body.points_m) == len(scan.points_m)


@pytest.mark.parametrize("move", [(0.0, 1.5, 0.0), (-1.5, 0.0, 0.0), (0.0, 0.0, 1.5)])
def test_beams_prove_that_a_body_has_moved(move: tuple[float, float, float]) -> None:
    start = np.array([7.0, 0.0, 0.0])
    before, after = (
        look(BallWorld.of((tuple(place), 0.6)), seed=n)
        for n, place in enumerate((start, start + move))
    )
    (then,), (now,) = sighted(before), sighted(after)
    assert max(share_passed(then.frame, now), share_passed(now.frame, then)) > 0.9


@pytest.mark.parametrize("own", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.5), (2.0, -1.0, 0.0)])
@pytest.mark.parametrize("bearing_deg", [-40.0, 0.0, 25.0, 44.0])
def test_beams_prove_nothing_about_what_stands_still(
    own: tuple[float, float, float], bearing_deg: float
) -> None:
    angle = np.radians(bearing_deg)
    world = BallWorld.of(((9.0 * np.cos(angle), 9.0 * np.sin(angle), 0.0), 0.6))
    there = State(np.array(own), np.array([0.0, 0.05, 0.1]))
    (then,) = sighted(look(world))
    for now in sighted(look(world, there, 1), there):
        assert share_passed(then.frame, now) <= 0.1
        assert share_passed(now.frame, then) <= 0.1


def test_a_ball_that_is_gone_is_passed_and_one_that_is_hidden_is_not() -> None:
    place = np.array([7.0, 0.0, 0.0])
    shown = {
        "gone": BallWorld.of(),
        "there": BallWorld.of(((7.0, 0.0, 0.0), 0.6)),
        "hidden": BallWorld.of(((4.0, 0.0, 0.0), 0.6)),
    }
    passed = {
        name: is_passed(place_beams(LIDAR, look(world), HERE, 3.0), place, 0.6)
        for name, world in shown.items()
    }
    assert passed == {"gone": True, "there": False, "hidden": False}
