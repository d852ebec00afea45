"""What is near and stands still in every scan is the own airframe; what moves or comes is not."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.frames import FloatArray
from clearway.sensors import Mounting, estimate_pattern
from clearway.sensors.beams.named_patterns import vlp16
from clearway.sensors.beams.own_airframe import own_airframe

LEG = np.array([[0.3, 0.2, -0.25], [0.3, -0.2, -0.25]])


def scans(
    count: int, near: FloatArray, walk_m: float = 0.1, noise_m: float = 0.01
) -> list[FloatArray]:
    """Scans of a room, its walls coming nearer, and what is near."""
    rng = np.random.default_rng(4)
    room = rng.uniform(-8.0, 8.0, (500, 3))
    room = room[np.linalg.norm(room, axis=1) > 2.0]
    return [
        np.concatenate([near + rng.normal(0.0, noise_m, near.shape), room - [n * walk_m, 0.0, 0.0]])
        for n in range(count)
    ]


def test_what_stands_still_is_told_with_what_leaves_it_out() -> None:
    found = own_airframe(scans(4, LEG), Mounting(np.array([0.0, 0.0, 0.4])))
    assert found is not None
    assert (found.returns, found.scans) == (2, 4)
    assert found.nearest_m == pytest.approx(np.linalg.norm(LEG[0]), abs=0.05)
    body = np.linalg.norm(LEG + np.array([0.0, 0.0, 0.4]), axis=1).max()
    assert body < found.radius_m < body + 0.15
    assert f"--airframe-radius {found.radius_m:g}" in found.in_words()
    assert own_airframe(scans(4, LEG), Mounting(np.array([0.0, 0.0, 0.4])), found.radius_m) is None


def test_what_passes_near_is_no_airframe() -> None:
    passing = [LEG + np.array([0.3 * n, 0.0, 0.0]) for n in range(4)]
    room = scans(4, np.zeros((0, 3)))
    both = [np.concatenate(pair) for pair in zip(passing, room, strict=True)]
    assert own_airframe(both, Mounting()) is None


def test_what_is_missing_in_one_scan_is_not_told() -> None:
    assert own_airframe([*scans(3, LEG), *scans(1, np.zeros((0, 3)))], Mounting()) is None


def test_fewer_than_three_scans_tell_nothing() -> None:
    assert own_airframe(scans(2, LEG), Mounting()) is None


def test_returns_that_are_none_do_no_harm() -> None:
    strange = np.array([[np.nan, 0.0, 0.0], [0.0, 0.0, 0.0], [np.inf, 0.0, 0.0]])
    found = own_airframe([np.concatenate([strange, scan]) for scan in scans(3, LEG)], Mounting())
    assert found is not None
    assert found.returns == 2


def test_a_guessed_sensor_drops_no_return() -> None:
    known = vlp16()
    turn = known.azimuth_rad[:: 16 * 8][:200]
    directions = np.array(
        [
            (np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e))
            for e in np.unique(known.elevation_rad)
            for a in turn
        ]
    )
    far = estimate_pattern(directions * 5.0)
    assert far.name.startswith("estimated: vlp16")
    assert far.min_range_m == known.min_range_m
    ranges = np.where(np.arange(len(directions)) < 30, 0.3, 5.0)
    near = estimate_pattern(directions * ranges[:, None])
    assert near.min_range_m == 0.0
    assert "30 returns are nearer than its blind range of 0.5 m: none assumed" in near.name


def test_a_bench_about_the_sensor_is_told_as_such_and_with_its_end() -> None:
    rng = np.random.default_rng(2)
    turn = rng.uniform(-np.pi, np.pi, 4000)
    bench = rng.uniform(0.5, 1.1, (4000, 1)) * np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    found = own_airframe(scans(3, bench, noise_m=0.001), Mounting())
    assert found is not None
    assert 1.1 < found.radius_m <= 1.25
    assert "a rig or a bench about the sensor (89 %" in found.in_words()


def test_a_wall_that_begins_farther_away_is_no_airframe() -> None:
    wall = np.stack(np.meshgrid([1.2], np.linspace(-1, 1, 40), np.linspace(-1, 1, 40)), -1)
    assert own_airframe(scans(3, wall.reshape(-1, 3), noise_m=0.001), Mounting()) is None
