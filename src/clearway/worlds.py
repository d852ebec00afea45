"""Made-up worlds to fly through, each from a seed."""

from __future__ import annotations

import numpy as np

from clearway.mission import Mission
from clearway.obstacle_map import ObstacleMap
from clearway.obstacles import Obstacle
from clearway.state import State

BALL_BOX_M = (50.0, 30.0, 20.0)
"""Extent of the ball worlds: ahead of the start, and centred on the way across and in height."""
BALL_COUNTS = (30, 240)
BALL_RADII_M = (0.8, 2.5)
BALL_LEG_M = 60.0


def ball_world(seed: int, balls: int | None = None) -> tuple[ObstacleMap, Mission]:
    """Balls at random in a box, and a leg right through it.

    balls: their number; drawn from `BALL_COUNTS` if not given. The leg starts and ends five metres
    outside the box.
    """
    rng = np.random.default_rng([seed, 20])
    count = int(rng.integers(BALL_COUNTS[0], BALL_COUNTS[1] + 1)) if balls is None else balls
    length, width, height = BALL_BOX_M
    centers = rng.uniform(
        [0.0, -0.5 * width, -0.5 * height], [length, 0.5 * width, 0.5 * height], (count, 3)
    )
    radii = rng.uniform(*BALL_RADII_M, count)
    obstacles = [
        Obstacle.ball(center, float(radius), f"ball {number}")
        for number, (center, radius) in enumerate(zip(centers, radii, strict=True))
    ]
    spare = 0.5 * (BALL_LEG_M - length)
    mission = Mission(
        f"ball-world-{seed}",
        State(np.array([-spare, 0.0, 0.0])),
        np.array([[length + spare, 0.0, 0.0]]),
    )
    return ObstacleMap(obstacles), mission
