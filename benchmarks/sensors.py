"""Speed of the sensor room."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.decisions import MANY_BEAMS
from benchmarks.references import bincount_detection, unique_voxels
from benchmarks.scenes import scattered, street
from benchmarks.table import Benchmark, Row
from benchmarks.timing import timed
from clearway.base.frames import world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.point_world import PointWorld
from clearway.sensors import (
    BeamPattern,
    Lidar,
    PointMemory,
    Scan,
    detect,
    inflate_points,
    simulate_scan,
    thin_points,
    update_memory,
)
from clearway.sensors.cells.detection import DetectionRule

GRID = AvoidanceGrid.uniform()
LIDAR = Lidar("front", BeamPattern.per_cell(GRID, max_range_m=10.0))
HERE = State(np.zeros(3))
SCANNER = "10 x 7 x 5 cells"


def hits_and_visibility(
    number: int, rule: DetectionRule = "ratio", target_s: float | None = None
) -> Callable[[bool], Row]:
    """Raw returns into hits and visibility, against arctan2 and bincount of NumPy."""

    def measure(quick: bool) -> Row:
        scan = Scan(scattered(number))
        found = detect(GRID, LIDAR, scan, rule=rule)
        hits, _ = bincount_detection(GRID, found.beams, scan.points_m)
        # Borders have a tolerance here and none there: a few points may change cells.
        assert np.abs(hits - found.hits).sum() <= 10 + number // 1000
        other = timed(lambda: bincount_detection(GRID, found.beams, scan.points_m), quick)
        return timed(lambda: detect(GRID, LIDAR, scan, rule=rule).visibility, quick).row(
            f"{number:,} raw points into hits and visibility of {SCANNER}, rule {rule}",
            target_s=target_s,
            reference=(other, "NumPy"),
        )

    return measure


def street_into_cells(quick: bool) -> Row:
    """Most returns of a scanner that sees far lie beyond the grid."""
    pattern = BeamPattern.per_cell(
        GRID, MANY_BEAMS[0], elevations_per_cell=MANY_BEAMS[1], max_range_m=100.0
    )
    far = Lidar("far", pattern)
    scan = simulate_scan(far, street(), HERE, np.random.default_rng(0))
    return timed(lambda: detect(GRID, far, scan).visibility, quick).row(
        f"{len(scan.points_m):,} returns of a street into hits and visibility of {SCANNER}",
        target_s=0.4e-3,
    )


def beams_counted_anew(quick: bool) -> Row:
    scan, turns = Scan(scattered(7_000)), count()

    def run() -> None:
        turned = world_from_body([0.0, 0.0, 1e-4 * next(turns)])
        _ = detect(GRID, LIDAR, scan, grid_from_body=(turned, np.zeros(3))).visibility

    return timed(run, quick).row("7,000 points, beams of a new attitude counted each time")


def coating(quick: bool) -> Row:
    points = scattered(2_000)
    return timed(lambda: inflate_points(GRID, points, 0.65), quick).row(
        "cells within 0.65 m of 2,000 points"
    )


def thinning(quick: bool) -> Row:
    points, radii = scattered(7_000), np.full(7_000, 0.05)
    other = timed(lambda: unique_voxels(points, 0.3), quick)
    return timed(lambda: thin_points(points, radii, 0.3), quick).row(
        "7,000 points merged in voxels of 0.3 m", reference=(other, "np.unique")
    )


def remembered() -> PointMemory:
    return update_memory(PointMemory.empty(0.15), LIDAR, Scan(scattered(5_000)), HERE)


def memory_update(quick: bool) -> Row:
    memory = remembered()
    wall = Scan(LIDAR.pattern.directions * (8.0 / LIDAR.pattern.directions[:, :1]))
    return timed(lambda: update_memory(memory, LIDAR, wall, HERE), quick).row(
        f"a scan of {len(wall.points_m):,} returns into a memory of {len(memory.radius_m):,} points"
    )


def memory_near(quick: bool) -> Row:
    memory, here, reach = remembered(), np.array([4.0, 0.0, 0.0]), 3.0

    def tree_query() -> list[int]:
        # Balls of unequal radius: the tree gives candidates, which memory.near need not look at.
        widest = float(memory.radius_m.max())
        return list(cKDTree(memory.position_m).query_ball_point(here, reach + widest))

    assert len(memory.near(here, reach)[1]) <= len(tree_query())
    return timed(lambda: memory.near(here, reach), quick).row(
        f"those of {len(memory.radius_m):,} remembered points within 3 m",
        reference=(timed(tree_query, quick), "a cKDTree, built and asked"),
    )


def cloud_scan(quick: bool) -> Row:
    rng = np.random.default_rng(1)
    ground = np.stack([*rng.uniform(-200.0, 200.0, (2, 550_000)), np.full(550_000, -20.0)], axis=1)
    trees = rng.uniform([-200, -200, -20], [200, 200, 0], (50_000, 3))
    world = PointWorld(np.concatenate([ground, trees]), 0.3)
    lidar = Lidar("far", BeamPattern.per_cell(GRID, max_range_m=50.0))
    return timed(lambda: simulate_scan(lidar, world, HERE), quick).row(
        "a scan of 7,000 beams simulated in a survey of 600,000 points"
    )


BENCHMARKS = (
    Benchmark("hits, 100,000 points", hits_and_visibility(100_000, target_s=0.7e-3), headline=True),
    Benchmark("hits, a street", street_into_cells, headline=True),
    Benchmark("hits, 100,000 points, surface", hits_and_visibility(100_000, "surface")),
    Benchmark("hits, 7,000 points", hits_and_visibility(7_000)),
    Benchmark("hits, new attitude", beams_counted_anew),
    Benchmark("coating by points", coating),
    Benchmark("thinning", thinning),
    Benchmark("memory, update", memory_update),
    Benchmark("memory, near", memory_near),
    Benchmark("simulated scan of a survey", cloud_scan),
)
