"""LiDARs for tests, and a world that they see."""

from __future__ import annotations

import numpy as np

import clearway as cw

GRID = cw.AvoidanceGrid.uniform(range_m=10.0)
WORLD = cw.ObstacleMap(
    [
        cw.Obstacle.ball([12.0, 0.3, 0.0], 1.5),
        cw.Obstacle.ball([9.0, -4.0, 0.5], 1.5),
        cw.Obstacle.ball([20.0, 2.0, 0.0], 2.0),
    ]
)


def lidar(name: str, **changes: object) -> cw.Lidar:
    pattern = cw.BeamPattern.per_cell(GRID, 20, elevations_per_cell=10, max_range_m=10.0)
    settings: dict[str, object] = {"sigma_m": 0.02} | changes
    return cw.Lidar(name, pattern, **settings)  # type: ignore[arg-type]


def at(time_s: float, speed_mps: float = 1.0) -> cw.State:
    return cw.State(np.array([speed_mps * time_s, 0.0, 0.0]), time_s=time_s)
