"""Made-up warehouses, each from a seed: racks up to the roof, aisles, and pallets in them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.world_parts import WALL_M, MadeWorld, Span, draw_between

AISLES_M: Span = (3.0, 4.0)
ROWS = 6
"""Of racks; beside the outer ones an aisle leads along the wall."""
DEEP_M: Span = (2.0, 2.6)
"""A row: two racks back to back."""
BLOCKS_M: Span = (14.0, 18.0)
"""Length of the rows before and behind the cross aisle."""
STAGING_M = 10.0
"""Free from the rows to the wall at either end, where flights start and end."""
ROOF_M = 9.0
TOPS_M: Span = (8.0, 8.6)
"""Of racks: what is left below the roof is too low to fly through."""
FLOWN_M: Span = (1.5, 6.5)
"""Heights of starts and goals."""
STACKS_APART_M: Span = (5.0, 9.0)
"""Between stacks of pallets along an aisle."""
STACK_M: Span = (0.8, 1.2)
STACK_TOPS_M: Span = (1.0, 7.0)
PASS_M = 2.0
"""Stacks leave as much of an aisle's width: a body of 0.3 m, and margins of 0.6 m."""
OFF_RACK_M: Span = (0.0, 0.15)


def warehouse(seed: int, aisle_m: Span = AISLES_M) -> MadeWorld:
    """A hall with rows of racks up to its roof, aisles of 3 to 4 m with stacks, a cross aisle."""
    rng = np.random.default_rng([seed, 27])
    aisles, deep = rng.uniform(*aisle_m, ROWS + 1), rng.uniform(*DEEP_M, ROWS)
    blocks, cross = rng.uniform(*BLOCKS_M, 2), draw_between(rng, aisle_m)
    width, length = float(aisles.sum() + deep.sum()), float(blocks.sum() + cross)
    lows = np.cumsum(aisles) + np.concatenate([[0.0], np.cumsum(deep)])
    parts = _hall(length, width)
    for x, block in ((0.0, blocks[0]), (blocks[0] + cross, blocks[1])):
        for row, (y, depth) in enumerate(zip(lows[:ROWS], deep, strict=True)):
            parts.append(
                _box((x, y, 0.0), (block, depth, draw_between(rng, TOPS_M)), f"rack {row}")
            )
        for aisle, y, free in zip(range(ROWS + 1), lows - aisles, aisles, strict=True):
            parts += _stacks(rng, (x, y), (block, free), f"stack {aisle}")
    y_start, y_goal = rng.uniform(0.1 * width, 0.9 * width, 2)
    z_start, z_goal = rng.uniform(*FLOWN_M, 2)
    middle = 0.5 * STAGING_M
    start = State(np.array([-middle, y_start, z_start]), np.zeros(3))
    goal = np.array([[length + middle, y_goal, z_goal]])
    return MadeWorld(ObstacleMap(parts), Mission(f"warehouse-{seed}", start, waypoints_m=goal))


def _hall(length: float, width: float) -> list[Obstacle]:
    """Floor, roof and outer walls."""
    low = (-STAGING_M - WALL_M, -WALL_M, -WALL_M)
    long, wide = length + 2.0 * (STAGING_M + WALL_M), width + 2.0 * WALL_M
    high = ROOF_M + 2.0 * WALL_M
    return [
        _box(low, (long, wide, WALL_M), "floor"),
        _box((*low[:2], ROOF_M), (long, wide, WALL_M), "roof"),
        _box(low, (long, WALL_M, high), "wall"),
        _box((low[0], width, low[2]), (long, WALL_M, high), "wall"),
        _box(low, (WALL_M, wide, high), "wall"),
        _box((length + STAGING_M, *low[1:]), (WALL_M, wide, high), "wall"),
    ]


def _stacks(
    rng: np.random.Generator, low_m: tuple[float, float], size_m: tuple[float, float], name: str
) -> Iterator[Obstacle]:
    """Stacks of pallets at either side of an aisle, with room to pass."""
    at = float(rng.uniform(1.0, STACKS_APART_M[1]))
    while at < size_m[0] - STACK_M[1]:
        off, top = draw_between(rng, OFF_RACK_M), draw_between(rng, STACK_TOPS_M)
        long, wide = rng.uniform(*STACK_M, 2)
        wide = min(float(wide), size_m[1] - PASS_M - off)
        aside = off if rng.random() < 0.5 else size_m[1] - off - wide
        yield _box((low_m[0] + at, low_m[1] + aside, 0.0), (float(long), wide, top), name)
        at += draw_between(rng, STACKS_APART_M)


def _box(
    low_m: tuple[float, float, float], size_m: tuple[float, float, float], name: str
) -> Obstacle:
    """A box along the axes, from its lowest corner on."""
    low, size = np.array(low_m), np.array(size_m)
    return Obstacle.cuboid(low + 0.5 * size, tuple(size.tolist()), name=name)
