"""Fields of cells as in BARN, the Benchmark for Autonomous Robot Navigation (Perille et al., 2020).

Cells are filled at random and smoothed by a cellular automaton. A copter flies through them at one
height, where BARN drives a robot of about the same width.
"""

from __future__ import annotations

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.state import BoolArray
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.peer_worlds.cells import boxes_of, ground_under
from clearway.sim.world_parts import MadeWorld, leg

CELLS = 30
CELL_M = 0.15
FILLS = (0.15, 0.2, 0.25, 0.3, 0.35)
"""Shares of cells that are filled before they are smoothed; the seed counts through them."""
ROUNDS = (2, 3, 4)
"""Rounds of the automaton; the seed counts through them too."""
TO_WALL = 5
TO_FREE = 1
"""Of eight neighbours: so many at least make a wall, so many at most free a cell."""
WAY_M = 10.0
"""From start to goal."""
FLOWN_M = 1.0
WALL_TOP_M = 2.5
SIDE_M = 0.3
"""Thickness of the walls along both sides, and at both ends."""
BEHIND_M = 2.0
"""From start and goal to the walls at the ends."""
CLEAR_M = 0.22
"""A field counts if some way along middles of cells keeps this from everything: three free cells
beside each other, the width of a small robot."""
MOST_DRAWN = 3000
"""Of a hundred fields that are filled by 0.35 at first, one leads through."""


def barn(seed: int, fill: float | None = None, rounds: int | None = None) -> MadeWorld:
    """Cells of 0.15 m in a long room, filled at random and smoothed, with a way through them.

    fill, rounds: share filled at first, and rounds of smoothing; by the seed if not given, so that
    300 seeds are 20 fields of each of 15 kinds.
    """
    rng = np.random.default_rng([seed, 65])
    fill = FILLS[seed % len(FILLS)] if fill is None else fill
    rounds = ROUNDS[seed // len(FILLS) % len(ROUNDS)] if rounds is None else rounds
    width = CELLS * CELL_M
    near = 0.5 * (WAY_M - width)
    corner = (near, -0.5 * width, 0.0)
    filled = _passable(rng, fill, rounds)
    tall = boxes_of(filled[:, :, None], (*corner[:2], 0.0), CELL_M)
    parts = [_raise(box) for box in tall]
    length, middle, height = WAY_M + 2.0 * BEHIND_M, 0.5 * WAY_M, 0.5 * WALL_TOP_M
    for side in (-0.5, 0.5):
        center = (middle, side * (width + SIDE_M), height)
        parts.append(Obstacle.cuboid(center, (length, SIDE_M, WALL_TOP_M), name="side"))
        center = (middle + side * (length + SIDE_M), 0.0, height)
        parts.append(Obstacle.cuboid(center, (SIDE_M, width, WALL_TOP_M), name="end"))
    parts.append(ground_under((0.0, -width), (WAY_M, width)))
    mission = leg(f"barn-{seed}", (0.0, 0.0, FLOWN_M), (WAY_M, 0.0, FLOWN_M))
    return MadeWorld(ObstacleMap(parts), mission, smallest_object_m=CELL_M)


def _raise(box: Obstacle) -> Obstacle:
    """Return a box of one cell's height as one that is too tall to fly over."""
    x, y, _ = box.position_m.tolist()
    length, width, _ = box.size_m
    center = (x, y, 0.5 * WALL_TOP_M)
    return Obstacle.cuboid(center, (length, width, WALL_TOP_M), name=box.name)


def _passable(rng: np.random.Generator, fill: float, rounds: int) -> BoolArray:
    """Return the first field drawn that has a way through; ClearwayError if there is none."""
    for _ in range(MOST_DRAWN):
        field = rng.random((CELLS, CELLS)) < fill
        for _ in range(rounds):
            field = smooth(field)
        if leads_through(field):
            return field
    raise ClearwayError(f"world barn: no way through {MOST_DRAWN} fields filled by {fill:g}")


def smooth(field: BoolArray) -> BoolArray:
    """Return a field [x, y] after one round: cells outside count as free."""
    padded = np.pad(field.astype(np.int64), 1)
    around = -field.astype(np.int64)
    for dx in range(3):
        for dy in range(3):
            around += padded[dx : dx + CELLS, dy : dy + CELLS]
    return np.asarray(np.where(around >= TO_WALL, True, np.where(around <= TO_FREE, False, field)))


def leads_through(field: BoolArray) -> bool:
    """Whether middles of cells that keep `CLEAR_M` from all filled ones, and from the walls along
    the sides, lead from the first row of cells to the last."""
    middles = (np.argwhere(np.ones_like(field)) + 0.5) * CELL_M
    walls = (np.argwhere(field) + 0.5) * CELL_M
    away = np.minimum(middles[:, 1], CELLS * CELL_M - middles[:, 1])
    if len(walls):
        offset = np.abs(middles[:, None] - walls[None]) - 0.5 * CELL_M
        apart = np.linalg.norm(np.maximum(offset, 0.0), axis=2).min(axis=1)
        away = np.minimum(away, apart)
    free = (away >= CLEAR_M).reshape(field.shape)
    reached = np.zeros_like(free)
    reached[0] = free[0]
    while True:
        padded = np.pad(reached, 1)
        grown = padded[2:, 1:-1] | padded[:-2, 1:-1] | padded[1:-1, 2:] | padded[1:-1, :-2]
        more = free & (reached | grown)
        if np.array_equal(more, reached):
            return bool(reached[-1].any())
        reached = more
