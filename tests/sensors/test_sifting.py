"""Lone returns in rain: what waits, what counts at once, and what the sweep shows meanwhile."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, LidarSensor, Scan, simulate_scan
from clearway.sensors.memory.remembered import Balls
from clearway.sensors.memory.sifting import NO_BALLS, RAINS, RainSieve, Sifted, sift
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.seen_space import is_free

LIDAR = Lidar(
    "lidar", BeamPattern.per_cell(AvoidanceGrid.uniform(), max_range_m=10.0), sigma_m=0.03
)
BEAM = LIDAR.pattern.directions[np.argmax(LIDAR.pattern.directions[:, 0])]
NOTHING = ObstacleMap()
NEAR_M = 3.0


def at(x_m: float, time_s: float) -> State:
    return State(np.array([x_m, 0.0, 0.0]), time_s=time_s)


def scan_of(*points: FloatArray, time_s: float = 0.0) -> Scan:
    return Scan(np.array(points).reshape(-1, 3), time_s, sensor="lidar")


def sifted(
    sieve: RainSieve, *scans: Scan, remembered: Balls = NO_BALLS, step_m: float = 0.0
) -> tuple[RainSieve, Sifted]:
    """The sieve after scans, and the last of them as memory takes it."""
    for n, scan in enumerate(scans):
        state = at(step_m * n, scan.time_s)
        sieve, last = sift(sieve, LIDAR, scan, state, remembered, NEAR_M)
    return sieve, last


RAINING = RainSieve(declared=True)


def test_a_lone_return_afar_waits_and_hides_what_is_behind_it() -> None:
    far = 6.0 * BEAM
    sieve, last = sifted(RAINING, scan_of(far))
    assert len(last.scan.points_m) == 0
    assert len(sieve.at_once.radius_m) == 0
    np.testing.assert_array_equal(last.hiding_m, far[None])


def test_it_counts_once_a_second_sweep_bears_it_out() -> None:
    far = 6.0 * BEAM
    _, last = sifted(RAINING, scan_of(far), scan_of(1.005 * far, time_s=1.0))
    assert len(last.scan.points_m) == 1
    _, elsewhere = sifted(RAINING, scan_of(far), scan_of(1.1 * far, time_s=1.0))
    assert len(elsewhere.scan.points_m) == 0


def test_what_shows_in_every_other_sweep_is_kept() -> None:
    far = 6.0 * BEAM
    scans = scan_of(far), scan_of(time_s=1.0), scan_of(far, time_s=2.0)
    _, last = sifted(RAINING, *scans)
    assert len(last.scan.points_m) == 1
    late = scan_of(far), scan_of(time_s=1.0), scan_of(time_s=2.0), scan_of(far, time_s=3.0)
    assert len(sifted(RAINING, *late)[1].scan.points_m) == 0


def test_a_cluster_and_what_is_remembered_count_at_once() -> None:
    nearest = np.argsort(-LIDAR.pattern.directions @ BEAM)[:3]
    _, last = sifted(RAINING, scan_of(*(6.0 * LIDAR.pattern.directions[nearest])))
    assert len(last.scan.points_m) == 3
    known = Balls(6.0 * BEAM[None], np.array([0.1]))
    assert len(sifted(RAINING, scan_of(6.0 * BEAM), remembered=known)[1].scan.points_m) == 1


def test_a_near_one_counts_at_once_unless_the_sweep_before_looked_through_its_place() -> None:
    near = scan_of(2.0 * BEAM, time_s=1.0)
    sieve, last = sifted(RAINING, near)
    np.testing.assert_allclose(sieve.at_once.position_m, 2.0 * BEAM[None])
    assert len(last.scan.points_m) == 0, "memory waits all the same"
    sieve, _ = sifted(RAINING, scan_of(), near)
    assert len(sieve.at_once.radius_m) == 0


def test_where_centimetres_would_be_clusters_no_lone_return_is_borne_out() -> None:
    touching = 0.3 * BEAM
    scans = (scan_of(touching, time_s=float(n)) for n in range(3))
    assert len(sifted(RAINING, *scans)[1].scan.points_m) == 0


def shown_behind(second: Scan) -> tuple[bool, bool, bool]:
    """Whether a place behind a lone return was seen to be free by a dry sweep, by one with it, and
    by that one as the second sweep leaves it."""
    first, aim = scan_of(3.0 * BEAM), 5.0 * BEAM
    dry, free = (FreeSpace(0.25, np.zeros(3), reach_m=10.0) for _ in range(2))
    dry.take(LidarSensor(LIDAR), scan_of(), at(0.0, 0.0))
    free.take(LidarSensor(LIDAR), first, at(0.0, 0.0))
    x, y, z = aim.tolist()
    before = is_free(free.seen, x, y, z, 0.2)
    _, last = sifted(RAINING, first, second)
    if last.before is not None:
        free.correct(LIDAR, last.before, at(0.0, 0.0))
    return is_free(dry.seen, x, y, z, 0.2), before, is_free(free.seen, x, y, z, 0.2)


@pytest.mark.parametrize(
    ("second", "then"),
    [
        pytest.param(scan_of(time_s=1.0), True, id="looked through its place"),
        pytest.param(scan_of(3.005 * BEAM, time_s=1.0), False, id="bears it out"),
        pytest.param(scan_of(2.0 * BEAM, time_s=1.0), False, id="is hidden by another"),
    ],
)
def test_a_held_return_frees_nothing_until_a_sweep_looks_through_its_place(
    second: Scan, then: bool
) -> None:
    assert shown_behind(second) == (True, False, then)


@pytest.mark.parametrize("share", [0.001, 0.004, 0.01])
def test_the_share_of_false_returns_is_estimated_within_its_interval(share: float) -> None:
    lidar, sieve, beams = replace(LIDAR, false_returns=share), RainSieve(), LIDAR.pattern.beams
    for step in range(40):
        state = at(0.1 * step, float(step))
        scan = simulate_scan(lidar, NOTHING, state, step)
        sieve, _ = sift(sieve, LIDAR, scan, state, NO_BALLS, NEAR_M)
    assert sieve.is_active, "nobody declared it"
    # The average weighs the latest sweeps: the variance of one, by (1 - k) / (1 + k) of 0.8.
    std = np.sqrt(share / beams * 0.2 / 1.8)
    assert sieve.share == pytest.approx(share, abs=4.0 * std + 0.05 * share)


def test_in_the_dry_nothing_waits_and_a_sweep_is_taken_as_it_is() -> None:
    world = ObstacleMap(
        [Obstacle.ball([3.0 + n, np.sin(5.0 * n), np.cos(7.0 * n)], 0.02 + 0.1 * (n % 3))
         for n in range(12)]
    )  # fmt: skip
    sieve = RainSieve()
    for step in range(30):
        state = at(0.1 * step, float(step))
        scan = simulate_scan(replace(LIDAR, dropout=0.05), world, state, step)
        sieve, last = sift(sieve, LIDAR, scan, state, NO_BALLS, NEAR_M)
        assert last.scan is scan
        assert sieve.contradicted < RAINS
    assert (sieve.is_active, sieve.share, sieve.held) == (False, 0.0, 0)
