"""What is looked at in benchmarks: worlds that a scanner stands in, returns and shapes of none."""

from __future__ import annotations

import numpy as np

from benchmarks import turn_rows
from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

SHAPES = 1_000


def street() -> ObstacleMap:
    """Closed all round but for the sky: nearly every beam of a scanner returns."""
    return ObstacleMap(
        [
            Obstacle.plane([0.0, 0.0, -4.0], (200.0, 200.0), 0.1),
            Obstacle.cuboid([0.0, 14.0, 0.0], (200.0, 4.0, 80.0)),
            Obstacle.cuboid([0.0, -14.0, 0.0], (200.0, 4.0, 80.0)),
            Obstacle.cuboid([40.0, 0.0, 0.0], (4.0, 40.0, 80.0)),
            Obstacle.ball([7.0, 0.5, 0.0], 1.5),
        ]
    )


def chamber() -> ObstacleMap:
    """Walls on all sides but behind, none farther than 10 m: every return is in reach."""
    return ObstacleMap(
        [
            Obstacle.cuboid([8.0, 0.0, 0.0], (0.5, 12.0, 12.0)),
            Obstacle.cuboid([2.0, 5.5, 0.0], (12.0, 0.5, 12.0)),
            Obstacle.cuboid([2.0, -5.5, 0.0], (12.0, 0.5, 12.0)),
            Obstacle.cuboid([2.0, 0.0, 4.0], (12.0, 12.0, 0.5)),
            Obstacle.cuboid([2.0, 0.0, -4.0], (12.0, 12.0, 0.5)),
        ]
    )


def scattered(number: int) -> FloatArray:
    """Returns spread evenly over the field of view and the range: the worst case for branches."""
    rng = np.random.default_rng(0)
    low, high = [0.5, -0.8, -0.53], [10.0, 0.8, 0.53]
    return cartesian_from_spherical(rng.uniform(low, high, (number, 3)))


def mixed_shapes(count: int) -> list[Obstacle]:
    """Balls, rods and boxes in any pose beside the way, all in view."""
    return turn_rows.mixed_shapes(count, Obstacle)
