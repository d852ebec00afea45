"""What is looked at in benchmarks: worlds that a scanner stands in, returns and shapes of none."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

SHAPES = 1_000
AS_FLOWN = (
    (0.0, 0.0, 0.0, 0.0, 0.0), (5.5, 2.3, 0.3, 0.0, 30.0), (11.3, 2.9, 0.5, 0.0, -15.0),
    (16.8, 0.6, 0.5, 0.0, -15.0), (21.5, 3.3, 0.7, -15.0, 75.0), (22.7, 9.1, 1.2, -15.0, 75.0),
    (21.6, 14.7, 0.3, 0.0, 120.0), (18.7, 19.8, 0.0, 0.0, 150.0), (13.4, 22.4, 0.0, 0.0, 165.0),
    (7.5, 22.4, -0.2, 0.0, 195.0), (1.9, 20.7, -0.4, -15.0, 195.0), (-0.7, 16.5, 2.0, -30.0, 270.0),
)  # fmt: skip
"""Places [m], pitch and heading [deg] at every sixth decision of the static mission."""


def street() -> ObstacleMap:
    """Closed all round but for the sky: nearly every beam of a scanner returns."""
    return ObstacleMap(
        [
            Obstacle.plane([0.0, 0.0, -4.0], (200.0, 200.0), radius_m=0.1),
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
    rng = np.random.default_rng(0)
    shapes: list[Obstacle] = []
    while len(shapes) < count:
        place = rng.uniform([2.0, -7.0, -4.0], [11.0, 7.0, 4.0])
        if abs(place[1]) > 1.5:
            turn, size = rng.uniform(-np.pi, np.pi, 3), rng.uniform(0.1, 0.5, 3)
            kinds = (
                Obstacle.ball(place, 0.2),
                Obstacle.line(place, size[0], radius_m=0.1, orientation_rad=turn),
                Obstacle.cuboid(place, (size[0], size[1], size[2]), orientation_rad=turn),
            )
            shapes.append(kinds[len(shapes) % 3])
    return shapes
