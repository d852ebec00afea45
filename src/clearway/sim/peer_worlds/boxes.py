"""Fields of upright boxes and small mazes of walls, as maps of mockamap are."""

from __future__ import annotations

import numpy as np

from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.mazes import maze_walls
from clearway.sim.peer_worlds.cells import ground_under
from clearway.sim.world_parts import MadeWorld, Span, draw_between, leg, roomy

AREA_M = (40.0, 20.0)
"""Where boxes stand: ahead of the start, and centred on the way across."""
WIDTHS_M: Span = (0.6, 1.5)
TOPS_M: Span = (1.5, 4.0)
PER_M2 = 0.15
ENDS_M = 2.0
"""Nothing stands so near start and goal."""
SIDE_M = 3.0
"""How far outside of the area start and goal lie."""
FLOWN_M: Span = (0.7, 2.9)
ROOMS = (8, 6)
"""Of a small maze, along and across the way."""
ROOM_M: Span = (2.5, 3.5)
WALL_M = 0.2
WALL_TOP_M = 4.0


def box_field(seed: int, boxes_per_m2: float = PER_M2) -> MadeWorld:
    """Upright boxes 0.6 to 1.5 m wide that may touch, some low enough to fly over."""
    rng = np.random.default_rng([seed, 67])
    length, width = AREA_M
    start, goal = (-SIDE_M, 0.0, 1.5), (length + SIDE_M, 0.0, 1.5)
    mission = leg(f"boxes-{seed}", start, goal)
    parts = [ground_under((0.0, -0.5 * width), (length, 0.5 * width))]
    for number in range(round(boxes_per_m2 * length * width)):
        x, y = rng.uniform([0.0, -0.5 * width], [length, 0.5 * width])
        (across, along), top = rng.uniform(*WIDTHS_M, 2), draw_between(rng, TOPS_M)
        if roomy(mission, np.array([x, y]), 0.5 * float(np.hypot(across, along)), ENDS_M):
            size = (float(across), float(along), top)
            parts.append(Obstacle.cuboid((x, y, 0.5 * top), size, name=f"box {number}"))
    corridor = 0.5 * width - 1.0
    return MadeWorld(ObstacleMap(parts), mission, FLOWN_M, corridor, smallest_object_m=WIDTHS_M[0])


def small_maze(seed: int, room_m: Span = ROOM_M) -> MadeWorld:
    """A maze of eight by six small rooms for a copter, with one way through and walls too tall."""
    rng = np.random.default_rng([seed, 68])
    across, along = ROOMS
    side = draw_between(rng, room_m)
    walls = maze_walls(rng, across, along)
    parts = [
        Obstacle.cuboid(
            (*(side * 0.5 * (a + b)), 0.5 * WALL_TOP_M),
            (*(side * np.abs(b - a) + WALL_M), WALL_TOP_M),
            name=f"wall {number}",
        )
        for number, (a, b) in enumerate(walls)
    ]
    far = np.array([across, along]) * side
    parts.append(ground_under((0.0, 0.0), far.tolist()))
    start, goal = 0.5 * side, far - 0.5 * side
    mission = leg(f"small-maze-{seed}", (start, start, 1.5), (*goal.tolist(), 1.5))
    return MadeWorld(ObstacleMap(parts), mission, FLOWN_M, smallest_object_m=WALL_M)
