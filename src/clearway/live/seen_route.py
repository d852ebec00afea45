"""A way to a goal through what was seen to be free, and at a price through what nobody has seen.

What is seen of a room, a pocket or a maze shows where it cannot be left long before flying on
shows it. The space that was seen is cut into cells; a way costs its length, more where little room
to turn is left and where it leads through the unknown, and nothing leads through what stands there.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.avoidance.hazards import PointHazards
from clearway.base.arrays import BoolArray, IntArray
from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray
from clearway.live.distance_field import HALF_DIAGONAL
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors.free_space import SeenSpace, Voxels

FINE, COARSE = 4, 8
"""Voxels of free space along a cell: for vehicles that turn in little room, and for others."""
OF_TURN = 0.6
"""A coarse cell is at most this share of the turning radius wide."""
UNSEEN = 2.0
"""Price of a metre that nobody has seen."""
NO_ROOM_TO_TURN, HARDLY_ROOM = 2.0, 5.0
"""Price of a metre within a turning radius, and half of one, of something, beside the margin."""
VERTICAL = 2.0
"""Price of a metre up or down."""
TRIED = 0.5
"""Price of a metre for every time that a way was looked for there before."""
TALL = 4.0
"""Price of a metre that nobody has seen above or below what stands: most of it stands on."""


class Cells(NamedTuple):
    """Space about the vehicle as cells with prices."""

    low_m: FloatArray
    """[3] lowest corner."""
    width_m: float
    price: FloatArray
    """[nx, ny, nz] of a metre; inf where no way leads."""


class SeenRoute(NamedTuple):
    """A way over cells."""

    corners_m: FloatArray
    """[n, 3] world frame, without the place where it begins; the last is the goal, or where the way
    leaves the cells towards it."""
    reaches: bool
    """Whether there is a way at all; without one the corners are none."""


def seen_route(
    seen: SeenSpace,
    remembered: PointHazards,
    obstacle_map: ObstacleMap | None,
    position_m: FloatArray,
    goal_m: FloatArray,
    margin_m: float,
    turning_radius_m: float,
    tried_m: Sequence[FloatArray] = (),
) -> SeenRoute:
    """The cheapest way from a place to a goal, as far as is known.

    tried_m: places [3] where one was looked for before; ways past them have come to nothing.
    """
    rooms = (margin_m, margin_m + 0.5 * turning_radius_m, margin_m + turning_radius_m)
    coarse = COARSE * seen.voxel_m <= OF_TURN * turning_radius_m
    cells = _cells(seen, remembered, obstacle_map, rooms, COARSE if coarse else FINE)
    for place_m in tried_m:
        _mark_tried(cells.price, cells.low_m, cells.width_m, place_m, rooms[2] + cells.width_m)
    start = _cell_of(cells, position_m)
    goal = _towards(cells, position_m, goal_m)
    way = _cheapest(cells.price, start, goal)
    if not len(way):
        return SeenRoute(np.zeros((0, 3)), False)
    corners = _corners(cells.price, way)
    places = cells.low_m + (corners[1:] + 0.5) * cells.width_m
    if np.all(goal == _cell_of(cells, goal_m)):
        places = np.concatenate([places[:-1], goal_m[None]])
    return SeenRoute(places, True)


def _cells(
    seen: SeenSpace,
    remembered: PointHazards,
    obstacle_map: ObstacleMap | None,
    rooms_m: tuple[float, float, float],
    per_cell: int,
) -> Cells:
    low: FloatArray = np.asarray(seen.low * seen.voxel_m, dtype=np.float64)
    width = per_cell * seen.voxel_m
    was_seen = _mostly_seen(seen.free, seen.low, per_cell)
    # No gap between cells leads through a wall, however thin.
    barred_m = max(rooms_m[0], HALF_DIAGONAL * width)
    price = np.where(was_seen, 1.0, UNSEEN)
    nearest = np.full(price.shape, np.inf)
    _mark_balls(
        nearest,
        read_only(remembered.position_m),
        read_only(remembered.radius_m),
        low,
        width,
        rooms_m[2],
    )
    if obstacle_map is not None and len(obstacle_map):
        ticks = [low[axis] + (np.arange(n) + 0.5) * width for axis, n in enumerate(price.shape)]
        centers = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        nearest = np.minimum(nearest, obstacle_map.distance_m(centers).reshape(price.shape))
    stands = np.any(nearest < barred_m, axis=2, keepdims=True)
    price[~was_seen & stands] *= TALL
    price *= np.select(
        [nearest < barred_m, nearest < rooms_m[1], nearest < rooms_m[2]],
        [np.inf, HARDLY_ROOM, NO_ROOM_TO_TURN],
        1.0,
    )
    return Cells(low, width, price)


@compiled
def _mostly_seen(free: Voxels, low: IntArray, per_cell: int) -> BoolArray:
    """[nx, ny, nz] whether most of a cell was seen to be free, by the middles of its eighths."""
    nx, ny, nz = free.shape[0] // per_cell, free.shape[1] // per_cell, free.shape[2] // per_cell
    quarter = per_cell // 4
    mostly = np.empty((nx, ny, nz), dtype=np.bool_)
    for a in range(nx):
        for b in range(ny):
            for c in range(nz):
                count = 0
                for eighth in range(8):
                    u = low[0] + a * per_cell + quarter * (1 + 2 * (eighth & 1))
                    v = low[1] + b * per_cell + quarter * (1 + (eighth & 2))
                    w = low[2] + c * per_cell + quarter * (1 + (eighth & 4) // 2)
                    x, y, z = (
                        u & (free.shape[0] - 1),
                        v & (free.shape[1] - 1),
                        w & (free.shape[2] - 1),
                    )
                    count += free[x, y, z]
                mostly[a, b, c] = count >= 4
    return mostly


@compiled
def _mark_balls(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
) -> None:
    """Lower the distance of cells' centres to what balls leave."""
    shape = nearest.shape
    for n in range(len(radius)):
        far = reach + radius[n]
        first, last = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
        for axis in range(3):
            at = (position[n, axis] - low[axis]) / width - 0.5
            first[axis] = max(0, int(np.ceil(at - far / width)))
            last[axis] = min(shape[axis] - 1, int(np.floor(at + far / width)))
        for a in range(first[0], last[0] + 1):
            for b in range(first[1], last[1] + 1):
                for c in range(first[2], last[2] + 1):
                    dx = low[0] + (a + 0.5) * width - position[n, 0]
                    dy = low[1] + (b + 0.5) * width - position[n, 1]
                    dz = low[2] + (c + 0.5) * width - position[n, 2]
                    away = np.sqrt(dx * dx + dy * dy + dz * dz) - radius[n]
                    nearest[a, b, c] = min(nearest[a, b, c], away)


@compiled
def _mark_tried(
    price: FloatArray, low: FloatArray, width: float, place: FloatArray, radius: float
) -> None:
    """Raise the price of cells about a place that was tried."""
    reach = int(np.ceil(radius / width))
    at = np.floor((place - low) / width).astype(np.int64)
    for a in range(max(0, at[0] - reach), min(price.shape[0], at[0] + reach + 1)):
        for b in range(max(0, at[1] - reach), min(price.shape[1], at[1] + reach + 1)):
            for c in range(max(0, at[2] - reach), min(price.shape[2], at[2] + reach + 1)):
                dx, dy, dz = a - at[0], b - at[1], c - at[2]
                if dx * dx + dy * dy + dz * dz <= (radius / width) ** 2:
                    price[a, b, c] += TRIED


def _cell_of(cells: Cells, place_m: FloatArray) -> FloatArray:
    return np.floor((place_m - cells.low_m) / cells.width_m)


def _towards(cells: Cells, position_m: FloatArray, goal_m: FloatArray) -> FloatArray:
    """Cell of the goal, or the last one on the straight way to it."""
    last = np.array(cells.price.shape) - 1.0
    here, there = _cell_of(cells, position_m), _cell_of(cells, goal_m)
    way = there - here
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(way > 0, (last - here) / way, np.where(way < 0, -here / way, np.inf))
    return np.clip(np.floor(here + min(1.0, float(room.min())) * way), 0.0, last)


@compiled
def _cheapest(price: FloatArray, start: FloatArray, goal: FloatArray) -> FloatArray:
    """[n, 3] cells of the cheapest way, both ends included; none where there is no way.

    A*; a way may begin in cells that are barred, since the vehicle is there, and ends at the goal,
    or beside it where that is barred.
    """
    nx, ny, nz = price.shape
    best = np.full(price.shape, np.inf)
    came = np.full((nx, ny, nz), -1, dtype=np.int64)
    a, b, c = int(start[0]), int(start[1]), int(start[2])
    ga, gb, gc = int(goal[0]), int(goal[1]), int(goal[2])
    barred = price[ga, gb, gc] == np.inf
    best[a, b, c] = 0.0
    queue = [(0.0, (a * ny + b) * nz + c)]
    end = -1
    while len(queue) > 0:
        _, here = heapq.heappop(queue)
        c = here % nz
        b = (here // nz) % ny
        a = here // (nz * ny)
        if max(abs(a - ga), abs(b - gb), abs(c - gc)) <= (2 if barred else 0):
            end = here
            break
        if came[a, b, c] < -1:
            continue
        spent = best[a, b, c]
        for da in range(-1, 2):
            for db in range(-1, 2):
                for dc in range(-1, 2):
                    u, v, w = a + da, b + db, c + dc
                    if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz:
                        continue
                    length = np.sqrt(da * da + db * db + (VERTICAL * dc) ** 2)
                    here_price, there_price = price[a, b, c], price[u, v, w]
                    if there_price == np.inf:
                        if here_price < np.inf:
                            continue
                        there_price = 10.0
                    if here_price == np.inf:
                        here_price = 10.0
                    cost = spent + 0.5 * length * (here_price + there_price)
                    if cost < best[u, v, w]:
                        best[u, v, w] = cost
                        came[u, v, w] = here
                        da_, db_, dc_ = u - ga, v - gb, w - gc
                        ahead = np.sqrt(da_ * da_ + db_ * db_ + dc_ * dc_)
                        heapq.heappush(queue, (cost + ahead, (u * ny + v) * nz + w))
    if end < 0:
        return np.zeros((0, 3))
    count, at = 1, end
    while came[at // (nz * ny), (at // nz) % ny, at % nz] >= 0:
        at = came[at // (nz * ny), (at // nz) % ny, at % nz]
        count += 1
    way, at = np.empty((count, 3)), end
    for n in range(count - 1, -1, -1):
        way[n, 0], way[n, 1], way[n, 2] = at // (nz * ny), (at // nz) % ny, at % nz
        at = came[at // (nz * ny), (at // nz) % ny, at % nz]
    return way


@compiled
def _corners(price: FloatArray, way: FloatArray) -> FloatArray:
    """[n, 3] cells where the way really turns: between them straight lines cost no more."""
    spent = np.zeros(len(way))
    for n in range(1, len(way)):
        spent[n] = spent[n - 1] + _line_price(price, way[n - 1], way[n])
    kept = [0]
    at = 0
    while at < len(way) - 1:
        reach = at + 1
        for n in range(len(way) - 1, at + 1, -1):
            if _line_price(price, way[at], way[n]) <= 1.05 * (spent[n] - spent[at]) + 1.0:
                reach = n
                break
        kept.append(reach)
        at = reach
    corners = np.empty((len(kept), 3))
    for n in range(len(kept)):
        corners[n] = way[kept[n]]
    return corners


@compiled
def _line_price(price: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """What the straight line between two cells costs."""
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = np.sqrt(dx * dx + dy * dy + (VERTICAL * dz) ** 2)
    steps = max(1, int(np.ceil(2.0 * np.sqrt(dx * dx + dy * dy + dz * dz))))
    total = 0.0
    for s in range(steps):
        share = (s + 0.5) / steps
        a = int(np.floor(start[0] + share * dx + 0.5))
        b = int(np.floor(start[1] + share * dy + 0.5))
        c = int(np.floor(start[2] + share * dz + 0.5))
        total += min(price[a, b, c], 1e9)
    return float(length * total / steps)
