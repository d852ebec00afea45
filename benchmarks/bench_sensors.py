"""Speed of the sensor room; run with `pytest benchmarks/bench_sensors.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clearway.frames import FloatArray, cartesian_from_spherical
from clearway.grid import AvoidanceGrid
from clearway.point_world import PointWorld
from clearway.sensors import (
    BeamPattern,
    Lidar,
    PointMemory,
    Scan,
    coated_cells,
    detect,
    simulate_scan,
    thin_points,
    update_memory,
)
from clearway.state import State

GRID = AvoidanceGrid.uniform()
LIDAR = Lidar("front", BeamPattern.per_cell(GRID, max_range_m=10.0))
HERE = State(np.zeros(3))


def scattered(count: int) -> FloatArray:
    """Returns spread evenly over the field of view and the range: the worst case for branches."""
    rng = np.random.default_rng(0)
    low, high = [0.5, -0.8, -0.53], [10.0, 0.8, 0.53]
    return cartesian_from_spherical(rng.uniform(low, high, (count, 3)))


@pytest.mark.parametrize("rule", ["ratio", "surface"])
@pytest.mark.parametrize("count", [7_000, 100_000])
def test_hits_and_visibility(benchmark: Any, count: int, rule: Any) -> None:
    scan = Scan(scattered(count))
    found = benchmark(detect, GRID, LIDAR, scan, rule=rule)
    assert found.counts["kept"] == count


def test_scan_from_another_attitude(benchmark: Any) -> None:
    scan, turns = Scan(scattered(7_000)), iter(np.linspace(0.0, 0.5, 10_000_000))

    def run() -> None:
        turn = next(turns)  # a new attitude each time: beams have to be counted anew
        rotation = np.array(
            [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0, 0, 1.0]]
        )
        detect(GRID, LIDAR, scan, grid_from_body=(rotation, np.zeros(3)))

    benchmark(run)


def test_coating_of_2000_points(benchmark: Any) -> None:
    points = scattered(2_000)
    assert benchmark(coated_cells, GRID, points, 0.65).any()


def test_thinning_of_7000_points(benchmark: Any) -> None:
    points, radii = scattered(7_000), np.full(7_000, 0.05)
    assert len(benchmark(thin_points, points, radii, 0.3)[0]) < 7_000


def test_memory_of_5000_points(benchmark: Any) -> None:
    memory = PointMemory.empty(0.15)
    memory = update_memory(memory, LIDAR, Scan(scattered(5_000)), HERE)
    wall = Scan(LIDAR.pattern.directions * (8.0 / LIDAR.pattern.directions[:, :1]))
    assert len(memory.position_m) > 4_500
    benchmark(update_memory, memory, LIDAR, wall, HERE)


def test_scan_of_a_cloud_of_600000_points(benchmark: Any) -> None:
    rng = np.random.default_rng(1)
    ground = np.stack([*rng.uniform(-200.0, 200.0, (2, 550_000)), np.full(550_000, -20.0)], axis=1)
    trees = rng.uniform([-200, -200, -20], [200, 200, 0], (50_000, 3))
    world = PointWorld(np.concatenate([ground, trees]), 0.3)
    lidar = Lidar("far", BeamPattern.per_cell(GRID, max_range_m=50.0))
    assert len(benchmark(simulate_scan, lidar, world, HERE).points_m)
