"""Obstacles that move on trefoil knots among pillars and bars, as in SANDO's dynamic worlds.

None of them reports itself: sensors see all there is to see.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.peer_worlds.cells import ground_under
from clearway.sim.scripted import ScriptedIntruder
from clearway.sim.world_parts import MadeWorld, leg, roomy

LOW_M = (5.0, -6.0, 0.5)
HIGH_M = (105.0, 6.0, 4.5)
"""Corners of the box in which the middles of obstacles are drawn."""
OBSTACLES = 100
MOVING = 0.65
"""Share of obstacles that move."""
UPRIGHT = 0.35
"""Share of those that stand still and are upright; the others lie across the way."""
LONG_M = 4.0
THICK_M = 0.4
"""Of pillars and bars."""
BALL_M = 0.5
"""Radius of what moves: balls of the volume of SANDO's cubes of 0.8 m."""
ENDS_M = 3.0
"""No middle is so near to start and goal."""
FLOWN_M = (0.7, 4.3)
STREAM = 70
"""Of random numbers."""


@dataclass(frozen=True, eq=False)
class Trefoil:
    """The way of one obstacle over time."""

    middle_m: FloatArray
    size_m: FloatArray
    """[3]"""
    slowness_s: float
    """Time in which its angle grows by one."""
    phase_rad: float

    def __call__(self, time_s: float) -> FloatArray:
        """Return where [3] it is at a time."""
        u = time_s / self.slowness_s + self.phase_rad
        x, y, z = self.size_m
        knot = (
            x / 6.0 * (np.sin(u) + 2.0 * np.sin(2.0 * u)),
            y / 5.0 * (np.cos(u) - 2.0 * np.cos(2.0 * u)),
            -0.5 * z * np.sin(3.0 * u),
        )
        return np.asarray(self.middle_m + np.array(knot))


def moving_field(seed: int, obstacles: int = OBSTACLES) -> MadeWorld:
    """Return what stands still among moving obstacles, and the flight through all of it."""
    rng = np.random.default_rng([seed, STREAM])
    mission = leg(f"moving-{seed}", (0.0, 0.0, 2.0), (105.0, 0.0, 2.0))
    parts = [ground_under(LOW_M[:2], HIGH_M[:2])]
    while len(parts) <= obstacles - _moving(obstacles):
        x, y, z = rng.uniform(LOW_M, HIGH_M)
        upright = rng.random() < UPRIGHT
        size = (THICK_M, THICK_M, LONG_M) if upright else (THICK_M, LONG_M, THICK_M)
        if roomy(mission, np.array([x, y]), 0.5 * LONG_M, ENDS_M):
            center = (x, y, 0.5 * LONG_M if upright else z)
            parts.append(Obstacle.cuboid(center, size, name=f"bar {len(parts)}"))
    return MadeWorld(ObstacleMap(parts), mission, FLOWN_M, HIGH_M[1], smallest_object_m=THICK_M)


def moving_script(seed: int, obstacles: int = OBSTACLES) -> tuple[ScriptedIntruder, ...]:
    """Return what moves in the field of a seed."""
    rng = np.random.default_rng([seed, STREAM, 1])
    return tuple(_ball(rng, number) for number in range(_moving(obstacles)))


def _ball(rng: np.random.Generator, number: int) -> ScriptedIntruder:
    way = Trefoil(
        rng.uniform(LOW_M, HIGH_M),
        rng.uniform(2.0, 4.0, 3),
        float(rng.uniform(10.0, 12.0)),
        float(rng.uniform(0.0, 3.0)),
    )
    return ScriptedIntruder(
        f"ball-{number}",
        0.0,
        way(0.0),
        np.zeros(3),
        radius_m=BALL_M,
        spawn="world",
        transponder=False,
        visible=True,
        course=way,
    )


def _moving(obstacles: int) -> int:
    return round(MOVING * obstacles)
