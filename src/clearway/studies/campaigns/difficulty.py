"""How hard a world is to fly through, before anyone flies: room, sight and turns of the way.

All is measured at the height of the start, on a grid of level places. FlightBench (Yu et al., 2024)
names the three; its own figures use a sphere corridor and are not comparable in size.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.live.mission import Mission
from clearway.obstacles.world import World

COLUMNS = 240
"""Cells of the grid along the straight way."""
SIDE_SHARE = 0.5
"""Half the width of the grid, of the straight way."""
BEYOND_SHARE = 0.05
"""How far it reaches past start and goal, of the straight way."""
PLACES = 60
DIRECTIONS = 24
"""Random places that the start leads to, at which room is measured; level directions from each."""
FARTHEST_M = 40.0
"""A free path is no longer."""
VIEW_M = 10.0
VIEW_RAD = np.radians(45.0)
RAYS = 31
"""How far and how wide a view along the way looks."""
STRIDE_M = 1.0
"""Between views."""


class Difficulty(NamedTuple):
    """NaN where no level way leads from start to goal."""

    free_path_m: float
    """Mean length of a level ray from a random free place: traversability."""
    nearest_m: float
    """Mean distance from such a place to the nearest surface."""
    occlusion: float
    """Share of the rays within 45 degrees of the shortest way that end within 10 m."""
    turn_rad_per_m: float
    """Angles of the shortest way by its length."""


def measure_difficulty(
    world: World, mission: Mission, margin_m: float, corridor_m: float | None, seed: int
) -> Difficulty:
    """Return how hard the world is between start and last waypoint for who keeps a margin.

    corridor_m: half the width of what may be flown in about the straight way; None for any.
    """
    start, goal = mission.start.position_m, mission.waypoints_m[-1]
    grid = LevelGrid(world, start, goal, margin_m, corridor_m)
    rng = np.random.default_rng([seed, 71])
    free_path, nearest = _room(world, grid, rng)
    way = grid.shortest_way()
    if way is None:
        return Difficulty(free_path, nearest, np.nan, np.nan)
    return Difficulty(free_path, nearest, _occlusion(world, way, start[2]), _turns(way))


def median_difficulty(several: Iterable[Difficulty]) -> Difficulty:
    """Return the median of each figure over worlds; NaN where no world has one."""
    table = np.array(list(several), dtype=np.float64).reshape(-1, len(Difficulty._fields))
    columns = (column[np.isfinite(column)] for column in table.T)
    return Difficulty(*(float(np.median(one)) if len(one) else np.nan for one in columns))


class LevelGrid:
    """Places [n, m, 2] at one height, and which of them keep the margin."""

    def __init__(
        self,
        world: World,
        start_m: FloatArray,
        goal_m: FloatArray,
        margin_m: float,
        corridor_m: float | None,
    ) -> None:
        way = goal_m[:2] - start_m[:2]
        length = float(np.linalg.norm(way))
        along = way / length
        self.cell_m = length / COLUMNS
        half_width_m = min(SIDE_SHARE * length, np.inf if corridor_m is None else corridor_m)
        beyond, side = round(BEYOND_SHARE * COLUMNS), int(half_width_m / self.cell_m)
        steps = np.arange(-beyond, COLUMNS + beyond + 1)
        across = np.arange(-side, side + 1)
        axes = self.cell_m * np.stack([along, [-along[1], along[0]]])
        i, j = np.meshgrid(steps, across, indexing="ij")
        self.places_m = start_m[:2] + np.stack([i, j], axis=-1) @ axes
        level = np.full(self.places_m.shape[:2], float(start_m[2]))
        points = np.concatenate([self.places_m, level[..., None]], axis=-1).reshape(-1, 3)
        self.distance_m = world.distance_m(np.ascontiguousarray(points)).reshape(i.shape)
        self.free: BoolArray = self.distance_m >= margin_m
        self.ends = (beyond, side), (beyond + COLUMNS, side)
        self.height_m = float(start_m[2])
        self.way_m, self._before = self._ways()

    def shortest_way(self) -> FloatArray | None:
        """Return the corners [n, 2] of the shortest way, pulled tight; None without one."""
        cells = self._cells()
        if cells is None:
            return None
        corners, at = [cells[0]], 0
        while at < len(cells) - 1:
            ahead = len(cells) - 1
            while ahead > at + 1 and not self._sees(cells[at], cells[ahead]):
                ahead = at + (ahead - at + 1) // 2
            corners.append(cells[ahead])
            at = ahead
        return np.array([self.places_m[tuple(cell)] for cell in corners])

    def _sees(self, a: IntArray, b: IntArray) -> bool:
        count = 2 * int(np.abs(b - a).max()) + 1
        line = np.rint(np.linspace(a, b, count)).astype(np.int64)
        return bool(self.free[line[:, 0], line[:, 1]].all())

    def _ways(self) -> tuple[FloatArray, IntArray]:
        """Return the length of the shortest way from the start to each cell [n, m] through free
        ones of 8 neighbours each, inf without one; and which cell comes before it."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import dijkstra

        number = np.arange(self.free.size).reshape(self.free.shape)
        pairs, widths = [], []
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            here = (slice(0, -dx or None), slice(max(-dy, 0), -dy if dy > 0 else None))
            there = (slice(dx, None), slice(max(dy, 0), dy if dy < 0 else None))
            both = self.free[here] & self.free[there]
            pairs.append(np.stack([number[here][both], number[there][both]]))
            widths.append(np.full(int(both.sum()), np.hypot(dx, dy)))
        first, second = np.concatenate(pairs, axis=1)
        size = self.free.size
        graph = coo_matrix((np.concatenate(widths), (first, second)), shape=(size, size)).tocsr()
        start = int(number[self.ends[0]])
        lengths, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
        return self.cell_m * lengths.reshape(self.free.shape), before

    def _cells(self) -> IntArray | None:
        """Return the cells [n, 2] of the shortest way to the goal; None without one."""
        start, goal = (int(np.ravel_multi_index(end, self.free.shape)) for end in self.ends)
        if not np.isfinite(self.way_m[self.ends[1]]):
            return None
        cells = [goal]
        while cells[-1] != start:
            cells.append(int(self._before[cells[-1]]))
        return np.column_stack(np.unravel_index(np.array(cells[::-1]), self.free.shape))


def _room(world: World, grid: LevelGrid, rng: np.random.Generator) -> tuple[float, float]:
    """Return mean free path and mean distance to the nearest surface, over random free places."""
    (first, _), (last, _) = grid.ends
    free = np.isfinite(grid.way_m)
    free[:first], free[last:] = False, False
    cells = np.argwhere(free)
    if not len(cells):
        return 0.0, 0.0
    chosen = cells[rng.integers(len(cells), size=PLACES)]
    yaw = rng.uniform(-np.pi, np.pi, (PLACES, DIRECTIONS))
    lengths = []
    for cell, angles in zip(chosen, yaw, strict=True):
        origin = np.array([*grid.places_m[tuple(cell)], grid.height_m])
        ways = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)])
        lengths.append(np.minimum(world.cast(origin, ways, FARTHEST_M), FARTHEST_M).mean())
    nearest = grid.distance_m[chosen[:, 0], chosen[:, 1]]
    return float(np.mean(lengths)), float(nearest.mean())


def _occlusion(world: World, way_m: FloatArray, height_m: float) -> float:
    """Return the share of rays along a way [n, 2] that meet something."""
    steps = np.diff(way_m, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    passed = np.append(0.0, np.cumsum(lengths))
    at = np.arange(0.0, passed[-1], STRIDE_M)
    leg = np.clip(np.searchsorted(passed, at, side="right") - 1, 0, len(steps) - 1)
    share = ((at - passed[leg]) / lengths[leg])[:, None]
    places = way_m[leg] + share * steps[leg]
    fan = np.linspace(-VIEW_RAD, VIEW_RAD, RAYS)
    met = []
    for place, step in zip(places, steps[leg], strict=True):
        yaw = np.arctan2(step[1], step[0]) + fan
        ways = np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros(RAYS)])
        ranges = world.cast(np.array([*place, height_m]), ways, VIEW_M)
        met.append(np.mean(ranges < VIEW_M))
    return float(np.mean(met))


def _turns(way_m: FloatArray) -> float:
    """Return the sum of the angles at the corners of a way [n, 2] by its length."""
    steps = np.diff(way_m, axis=0)
    yaw = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    return float(np.abs(np.diff(yaw)).sum() / np.linalg.norm(steps, axis=1).sum())
