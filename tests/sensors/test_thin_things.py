"""Thin things stay until they were looked at finely enough; rain and ghosts do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, PointMemory, Scan, simulate_scan, update_memory

GRID = AvoidanceGrid.uniform()
LIDAR = Lidar("lidar", BeamPattern.per_cell(GRID, max_range_m=10.0), sigma_m=0.03)
"""Rows 1.2 deg apart: 10 cm at 5 m."""
NOTHING = ObstacleMap()


def wire(x_m: float, z_m: float, radius_m: float = 0.004) -> ObstacleMap:
    """A level wire square across the way."""
    return ObstacleMap(
        [Obstacle.line([x_m, 0, z_m], 40.0, radius_m=radius_m, orientation_rad=[0, 0, 0.5 * np.pi])]
    )


def at(x_m: float, time_s: float) -> State:
    return State(np.array([x_m, 0.0, 0.0]), time_s=time_s)


def flown_past(
    memory: PointMemory, world: ObstacleMap, places: np.ndarray, start_s: float = 1.0
) -> PointMemory:
    """Sweeps one second apart; returns of them only where the world has something."""
    for step, x in enumerate(places):
        state = at(float(x), start_s + step)
        memory = update_memory(memory, LIDAR, simulate_scan(LIDAR, world, state, step), state)
    return memory


def hit_by_a_row(distance_m: float, row: int = 27) -> ObstacleMap:
    """A wire at the height of one row of beams there."""
    elevation = np.unique(LIDAR.pattern.elevation_rad)[row]
    return wire(distance_m, distance_m * float(np.tan(elevation)))


def nearest_to_wire_m(memory: PointMemory, x_m: float, z_m: float, half_m: float) -> float:
    """How far at most any place of a stretch of wire lies outside all balls."""
    places = np.column_stack(
        [np.full(200, x_m), np.linspace(-half_m, half_m, 200), np.full(200, z_m)]
    )
    gaps = np.linalg.norm(places[:, None] - memory.position_m, axis=2) - memory.radius_m
    return float(gaps.min(axis=1, initial=np.inf).max())


def test_a_wire_that_later_sweeps_miss_is_still_known() -> None:
    world = hit_by_a_row(4.8)
    memory = flown_past(PointMemory.empty(0.12), world, np.array([0.0]), 0.0)
    assert len(memory.radius_m) > 10
    # Later sweeps go above and below it: as if it were not there, though it is.
    later = flown_past(memory, NOTHING, np.array([0.7, 1.4, 2.1, 2.8, 3.5]))
    assert len(later.radius_m) == len(memory.radius_m)


def test_beams_finer_than_what_was_declared_clear_it() -> None:
    fine = Lidar(
        "lidar",
        BeamPattern.rotating(
            np.arange(-10, 10.05, 0.1), 0.1, azimuth_span_deg=60.0, max_range_m=10.0
        ),
    )
    world = wire(4.0, 0.0, 0.01)
    memory = PointMemory.empty(0.12, smallest_m=0.02)
    memory = update_memory(memory, fine, simulate_scan(fine, world, at(0.0, 0.0)), at(0.0, 0.0))
    known = len(memory.radius_m)
    assert known > 20
    empty = Scan(np.zeros((0, 3)), 1.0, sensor="lidar")
    once = update_memory(memory, fine, empty, at(0.0, 1.0))
    assert len(once.radius_m) == known
    twice = update_memory(once, fine, replace(empty, time_s=2.0), at(0.0, 2.0))
    assert len(twice.radius_m) < 0.1 * known


def test_many_looks_from_near_clear_a_line_that_never_was() -> None:
    memory = flown_past(PointMemory.empty(0.12), hit_by_a_row(4.8), np.array([0.0]), 0.0)
    known = len(memory.radius_m)
    places = 4.0 + 0.4 * np.sin(np.arange(300.0)) - 1.0
    assert len(flown_past(memory, NOTHING, places).radius_m) < 0.5 * known


def test_standing_still_the_same_beams_prove_nothing_again() -> None:
    memory = flown_past(PointMemory.empty(0.12), hit_by_a_row(4.8), np.array([0.0]), 0.0)
    assert len(flown_past(memory, NOTHING, np.zeros(200)).radius_m) == len(memory.radius_m)


@pytest.mark.parametrize("gap_m", [0.3, 0.5, 0.9, 1.1])
def test_returns_in_a_line_are_joined(gap_m: float) -> None:
    rng = np.random.default_rng(3)
    across = np.arange(-3.0, 3.01, gap_m)
    points = np.column_stack([np.full(len(across), 5.0), across, 0.1 * across])
    points += rng.normal(0.0, 0.01, points.shape)
    scan = Scan(points, 0.0, sensor="lidar")
    memory = update_memory(PointMemory.empty(0.12), LIDAR, scan, at(0.0, 0.0))
    places = np.column_stack(
        [np.full(300, 5.0), np.linspace(-2.5, 2.5, 300), np.linspace(-0.25, 0.25, 300)]
    )
    gaps = np.linalg.norm(places[:, None] - memory.position_m, axis=2) - memory.radius_m
    assert gaps.min(axis=1).max() < 0.08


def test_few_returns_all_about_are_not_joined() -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform([3.0, -3.0, -2.0], [9.0, 3.0, 2.0], (60, 3))
    scan = Scan(points, 0.0, sensor="lidar")
    memory = update_memory(PointMemory.empty(0.12), LIDAR, scan, at(0.0, 0.0))
    assert len(memory.radius_m) <= 62


def rained_on(scan: Scan, share: float, rng: np.random.Generator) -> Scan:
    """The scan with false returns at any range along a share of the beams."""
    hit = LIDAR.pattern.directions[rng.random(LIDAR.pattern.beams) < share]
    return replace(
        scan, points_m=np.concatenate([scan.points_m, hit * rng.uniform(0.5, 10.0, (len(hit), 1))])
    )


@pytest.mark.parametrize("share", [0.001, 0.003, 0.01])
def test_rain_is_told_from_a_wire(share: float) -> None:
    """Both measured: how many false returns stay, and how much of a wire in the same rain."""
    rng = np.random.default_rng(5)
    world = hit_by_a_row(4.8)
    memory = PointMemory.empty(0.12)
    for step in range(40):
        state = at(0.0 if step < 3 else 0.05 * (step - 3), float(step))
        scan = simulate_scan(LIDAR, world if step < 3 else NOTHING, state, step)
        memory = update_memory(memory, LIDAR, rained_on(scan, share, rng), state)
    z_m = 4.8 * float(np.tan(np.unique(LIDAR.pattern.elevation_rad)[27]))
    assert nearest_to_wire_m(memory, 4.8, z_m, 0.6) < 0.2, "the wire is there"
    off = np.hypot(memory.position_m[:, 0] - 4.8, memory.position_m[:, 2] - z_m) > 0.3
    ahead = memory.position_m - np.array([1.8, 0.0, 0.0])
    near = (ahead[:, 0] > 0.5) & (ahead[:, 0] < 3.5)
    looked_at = np.all(np.abs(ahead[:, 1:]) < [[0.8, 0.4]] * ahead[:, :1], axis=1)
    assert np.count_nonzero(off & near & looked_at) < 5 * share * LIDAR.pattern.beams, (
        "most rain is gone"
    )


def test_where_it_pours_a_second_sweep_has_to_see_a_lone_return() -> None:
    """Told are the wire, and what was seen twice; drops wait, and none is forgotten for it."""
    rng = np.random.default_rng(6)
    memory = PointMemory.empty(0.12)
    for step in range(12):
        scan = simulate_scan(LIDAR, hit_by_a_row(4.8), at(0.0, float(step)), step)
        memory = update_memory(memory, LIDAR, rained_on(scan, 0.01, rng), at(0.0, float(step)))
    assert memory.pours
    told, known = memory.told, memory.position_m
    assert len(told.radius_m) < len(known) - 10, "drops of this sweep wait"
    z_m = 4.8 * float(np.tan(np.unique(LIDAR.pattern.elevation_rad)[27]))
    on_wire = np.hypot(known[:, 0] - 4.8, known[:, 2] - z_m) < 0.15
    kept = np.hypot(told.position_m[:, 0] - 4.8, told.position_m[:, 2] - z_m) < 0.15
    assert kept.sum() >= 0.9 * on_wire.sum() > 10
    assert not PointMemory.empty(0.12).pours


def test_lone_returns_are_left_out_where_other_beams_show_what_they_are_not() -> None:
    """The smallest thing sought spans many beams there."""
    memory = PointMemory.empty(0.12, smallest_m=0.4)
    lone = LIDAR.pattern.directions[3_500] * 3.0
    scan = Scan(np.array([lone]), 0.0, sensor="lidar")
    memory = update_memory(memory, LIDAR, scan, at(0.0, 0.0))
    assert memory.too_small == 1
    assert len(memory.radius_m) == 0
