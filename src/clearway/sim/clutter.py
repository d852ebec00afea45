"""Made-up worlds of many things: shapes of every kind in any pose, and nets across the way."""

from __future__ import annotations

import numpy as np

from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.world_parts import MadeWorld, Span, draw_between, leg, place_parts, roomy

MIXED_BOX_M = (50.0, 30.0, 20.0)
"""Extent of the mixed worlds: ahead of the start, and centred on the way across and in height."""
MIXED_COUNTS = (20, 90)
NET_SIDES_M: Span = (4.0, 10.0)
NET_GAPS_M: Span = (9.0, 14.0)
NET_THICKNESS_M = 0.22
"""Of ropes: what the beams of the made-up worlds do not miss within 10 m, 1.2 deg apart."""


def make_mixed(seed: int, shapes: tuple[int, int] = MIXED_COUNTS) -> MadeWorld:
    """Balls, bars, plates and boxes in any pose, in a box, and a leg right through it."""
    rng = np.random.default_rng([seed, 50])
    length, width, height = MIXED_BOX_M
    mission = leg(f"clutter-{seed}", (-5.0, 0.0, 0.0), (length + 5.0, 0.0, 0.0))
    low, high = np.array([0.0, -0.5 * width, -0.5 * height]), 0.5 * np.array(MIXED_BOX_M)
    high[0] = length
    things: list[Obstacle] = []
    for number in range(int(rng.integers(shapes[0], shapes[1] + 1))):
        thing = _any_shape(rng, rng.uniform(low, high), f"thing {number}")
        reach = float(np.linalg.norm(thing.half_m)) + thing.radius_m
        if roomy(mission, thing.position_m, reach):
            things.append(thing)
    return MadeWorld(ObstacleMap(things), mission)


def _any_shape(rng: np.random.Generator, at: np.ndarray, name: str) -> Obstacle:
    """A shape of any kind, about as large as the balls of the ball worlds, in any pose."""
    attitude = rng.uniform([-np.pi, -0.5 * np.pi, -np.pi], [np.pi, 0.5 * np.pi, np.pi])
    kind = int(rng.integers(4))
    if kind == 0:
        return Obstacle.ball(at, float(rng.uniform(0.5, 2.0)), name=name)
    if kind == 1:
        length, radius = float(rng.uniform(2.0, 10.0)), float(rng.uniform(0.15, 0.5))
        return Obstacle.line(at, length, radius_m=radius, orientation_rad=attitude, name=name)
    x, y, z = (float(size) for size in rng.uniform(1.0, 5.0, 3))
    if kind == 2:
        return Obstacle.plane(
            at, (x, y), radius_m=float(rng.uniform(0.1, 0.3)), orientation_rad=attitude, name=name
        )
    rounded = float(rng.choice([0.0, rng.uniform(0.1, 0.5)]))
    return Obstacle.cuboid(
        at, (0.6 * x, 0.6 * y, 0.6 * z), radius_m=rounded, orientation_rad=attitude, name=name
    )


def nets(seed: int, gap_m: Span = NET_GAPS_M, thickness_m: float = NET_THICKNESS_M) -> MadeWorld:
    """Nets of ropes across the way, 4 to 10 m wide and high, one behind the other.

    gap_m: from net to net; thickness_m: of the ropes. Meshes are of 0.5 to 1 m: none lets through.
    """
    rng = np.random.default_rng([seed, 51])
    ropes: list[Obstacle] = []
    x = float(rng.uniform(10.0, 13.0))
    while x < 55.0:
        center = (x, float(rng.uniform(-2.0, 2.0)), float(rng.uniform(-2.0, 2.0)))
        attitude = (0.0, float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.5, 0.5)))
        ropes += place_parts(_net(rng, 0.5 * thickness_m), center, attitude)
        x += draw_between(rng, gap_m)
    far = x + 5.0
    mission = leg(f"nets-{seed}", (0.0, 0.0, 0.0), (far, 0.0, 0.0))
    return MadeWorld(ObstacleMap(ropes), mission, smallest_object_m=thickness_m)


def _net(rng: np.random.Generator, radius: float) -> list[Obstacle]:
    """Ropes both ways in the plane x = 0, about the origin."""
    sides = rng.uniform(*NET_SIDES_M, 2)
    mesh = float(rng.uniform(0.5, 1.0))
    ropes = []
    for axis, unit in enumerate(np.eye(3)[1:]):
        other = np.eye(3)[2 - axis]
        count = int(sides[1 - axis] / mesh) + 1
        for at in mesh * (np.arange(count) - 0.5 * (count - 1)):
            ends = [at * other + s * 0.5 * float(sides[axis]) * unit for s in (-1.0, 1.0)]
            ropes.append(Obstacle.line_between(ends[0], ends[1], radius_m=radius, name="rope"))
    return ropes
