"""A forest of cylinders and rings, as EGO-Planner's random forest is."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.peer_worlds.cells import ground_under
from clearway.sim.world_parts import MadeWorld, leg, roomy

AREA_M = (40.0, 20.0)
TOP_M = 3.0
CYLINDERS = RINGS = 200
APART_M = 1.2
"""Between the axes of two cylinders, at least."""
ENDS_M = 2.0
"""Nothing has its middle so near to start or goal."""
SIDES = 8
"""A ring is so many bars."""
THICK_M = 0.1
"""Thickness of the rings' bars."""
FLOWN_M = (0.4, 2.6)
MOST_TRIES = 20_000


def ring_forest(seed: int, cylinders: int = CYLINDERS, rings: int = RINGS) -> MadeWorld:
    """Cylinders 0.25 to 1.05 m thick, 1.2 m apart or more, and rings of thin bars between them."""
    rng = np.random.default_rng([seed, 69])
    mission = leg(f"ring-forest-{seed}", (-19.0, 0.0, 1.0), (19.0, 0.0, 1.0))
    half = 0.5 * np.array(AREA_M)
    axes = np.empty((cylinders, 2))
    count = 0
    for _ in range(MOST_TRIES):
        if count == cylinders:
            break
        place = rng.uniform(-half, half)
        apart = np.linalg.norm(axes[:count] - place, axis=1)
        if roomy(mission, place, 0.0, ENDS_M) and np.all(apart >= APART_M):
            axes[count] = place
            count += 1
    parts = [ground_under((-half).tolist(), half.tolist())]
    for number, (x, y) in enumerate(axes[:count].tolist()):
        radius = 0.5 * float(rng.uniform(0.5, 0.7) * rng.uniform(0.5, 1.5))
        low, high = (x, y, -0.5), (x, y, TOP_M)
        trunk = Obstacle.line_between(low, high, radius_m=radius, name=f"cylinder {number}")
        parts.append(trunk)
    number = 0
    while number < rings:
        place = rng.uniform(-half, half)
        if roomy(mission, place, 0.0, ENDS_M):
            parts += _ring(rng, place, f"ring {number}")
            number += 1
    corridor = float(half[1])
    return MadeWorld(ObstacleMap(parts), mission, FLOWN_M, corridor, smallest_object_m=THICK_M)


def _ring(rng: np.random.Generator, place_m: FloatArray, name: str) -> list[Obstacle]:
    """Return the bars of an upright ring, which looks along x but for half a radian."""
    yaw = float(rng.uniform(-0.5, 0.5))
    wide, high, middle = rng.uniform(0.5, 0.7), rng.uniform(0.7, 1.2), rng.uniform(0.7, 0.8)
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES + 1)
    across = wide * np.cos(angle)
    corners = np.column_stack(
        [
            place_m[0] - np.sin(yaw) * across,
            place_m[1] + np.cos(yaw) * across,
            middle + high * np.sin(angle),
        ]
    )
    return [
        Obstacle.line_between(a, b, radius_m=0.5 * THICK_M, name=name) for a, b in pairwise(corners)
    ]
