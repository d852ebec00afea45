"""A way to a goal through what was seen to be free, and at a price through what nobody has seen.

What is seen of a room, a pocket or a maze shows where it cannot be left long before flying on
shows it. A way over the cells of a `RouteMap` costs its length, more where little room to turn is
left, where it leads through the unknown and where ways have come to nothing, and less along the way
that is being flown; nothing leads through what stands there.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats3, Ints
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.live.routing.least_cost import bound_cost, cheapness
from clearway.live.routing.open_way import any_way
from clearway.live.routing.route_map import MOST_ROOM, UNOBSERVED_COST, Cells

VERTICAL = 2.0
"""Price of a metre up or down."""
FLOWN = 0.75
"""Share of the price along the way that is being flown: another must be better by so much."""
BARRED = 10.0
"""Price of a metre in what is barred, for a vehicle that is there."""
ENDS_BESIDE = 2
"""Cells from a goal that is barred at which a way to it ends."""
BEGINS = 2.0
"""Cells from the vehicle that a way cannot hang on."""
MOST_LOOKED, MOST_GREEDILY = 66_000, 30_000
"""Cells that a search looks at, all of a window of the usual size; and a second one, in a wide
window where that was not enough. After both any way is taken."""
APART = 1e-6
"""Share of its price by which a way to the left costs more than its like to the right: else of two
that cost the same the order of cells would decide, and with it where north lies."""
GREEDY = 8.0
"""Times that what is left to the goal counts in the second."""


class SeenRoute(NamedTuple):
    """A way over cells."""

    corners_m: FloatArray
    """[n, 3] world frame, without the place where it begins; the last is the goal, or where the way
    leaves the cells towards it."""
    reaches: bool
    """Whether there is a way at all; without one the corners are none."""
    begins_m: FloatArray
    """[k, 3] cell by cell up to the first that was not seen to have room, on which all hangs; the
    whole of it where there is none."""
    length_m: float
    """From where it begins to the goal."""
    in_vain_m: float
    """Part of its price for ways that came to nothing."""
    was_cut_off: bool = False
    """Whether the search for it came to its bound: there may be a cheaper one."""

    def via_m(self, goal_m: FloatArray) -> tuple[FloatArray, ...]:
        """Its corners [3] before the goal [3]."""
        ends_at_goal = self.reaches and np.array_equal(self.corners_m[-1], goal_m)
        return tuple(self.corners_m[:-1] if ends_at_goal else self.corners_m)


def seen_route(
    cells: Cells,
    position_m: FloatArray,
    goal_m: FloatArray,
    flown_m: Sequence[FloatArray] = (),
) -> SeenRoute:
    """The cheapest way from a place to a goal, as far as is known.

    flown_m: corners [3] of the way being flown.
    """
    price = cells.price.copy()
    if len(flown_m):
        along = np.stack([position_m, *flown_m])
        _lower_along(price, (along - cells.low_m) / cells.width_m, FLOWN)
    goal = cells.cell_of(goal_m)
    goal[2] = np.clip(goal[2], 0, price.shape[2] - 1)
    begin, nearest = _beside(cells, position_m), cells.nearest_m / cells.width_m
    way, looked = _cheapest(price, nearest, begin, goal, cells.most, 1.0, MOST_LOOKED)
    was_cut_off = False
    if looked >= MOST_LOOKED and not len(way):
        some = any_way(price, nearest, begin, goal, ENDS_BESIDE)
        was_cut_off = len(some) > 0
        if was_cut_off:
            way, _ = _cheapest(price, nearest, begin, goal, cells.most, GREEDY, MOST_GREEDILY)
            way = way if len(way) else some
    if not len(way):
        if np.isinf(price[tuple(begin.astype(np.int64))]):  # Too coarse to tell.
            straight = np.stack([position_m, goal_m])
            return SeenRoute(
                straight[1:], True, straight, float(np.linalg.norm(goal_m - position_m)), 0.0
            )
        return SeenRoute(np.zeros((0, 3)), False, position_m[None], np.inf, 0.0)
    places = cells.low_m + (way + 0.5) * cells.width_m
    corners = places[_corners(price, way)][1:]
    if np.max(np.abs(way[-1] - goal)) <= BEGINS:
        corners = np.concatenate([corners[:-1], goal_m[None]])
    whole = np.concatenate([position_m[None], corners, goal_m[None]])
    length = float(np.linalg.norm(np.diff(whole, axis=0), axis=1).sum())
    at = way.astype(np.int64)
    doubtful = cells.price[at[:, 0], at[:, 1], at[:, 2]] > 1.0
    doubtful[: int(BEGINS)] = False
    hangs_on = int(np.argmax(doubtful)) if doubtful.any() else len(places) - 1
    begins = np.concatenate([position_m[None], places[1 : hangs_on + 1]])
    in_vain = float(cells.in_vain[at[:, 0], at[:, 1], at[:, 2]].sum()) * cells.width_m
    return SeenRoute(corners, True, begins, length, in_vain, was_cut_off)


def _beside(cells: Cells, place_m: FloatArray) -> FloatArray:
    """[3] the cell whose middle has most room round it, beyond the place: of its side of a wall."""
    around = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    near = np.clip(cells.cell_of(place_m) + around, 0, np.array(cells.price.shape) - 1)
    away = np.linalg.norm(cells.low_m + (near + 0.5) * cells.width_m - place_m, axis=1)
    room = cells.nearest_m[tuple(near.astype(np.int64).T)]
    best = np.argmax(np.minimum(room, MOST_ROOM * cells.width_m) - away)
    return np.asarray(near[best], dtype=np.float64)


@compiled
def _lower_along(price: Floats3, corners: Floats2, share: float) -> None:
    """Lower the price of the cells along a polyline [n, 3], and of those that touch them."""
    lowered = np.zeros(price.shape, dtype=np.bool_)
    for n in range(len(corners) - 1):
        step = corners[n + 1] - corners[n]
        count = int(np.ceil(2.0 * np.sqrt(np.sum(step * step)))) + 1
        for s in range(count + 1):
            at = corners[n] + step * (s / count)
            for da in range(-1, 2):
                for db in range(-1, 2):
                    for dc in range(-1, 2):
                        a, b = int(np.floor(at[0])) + da, int(np.floor(at[1])) + db
                        c = int(np.floor(at[2])) + dc
                        if a < 0 or b < 0 or c < 0:
                            continue
                        if a >= price.shape[0] or b >= price.shape[1] or c >= price.shape[2]:
                            continue
                        if not lowered[a, b, c]:
                            lowered[a, b, c] = True
                            price[a, b, c] *= share


@compiled
def _cheapest(
    price: Floats3,
    nearest: Floats3,
    start: Floats,
    goal: Floats,
    most: float,
    greed: float,
    most_looked: int,
) -> tuple[Floats2, int]:
    """[n, 3] cells of the cheapest way, both ends included; none where there is no way, and where
    none is found among so many cells. And how many were looked at.

    nearest: of a `Cells`, in cells. A*; a way may begin in cells that are barred, since the vehicle
    is there, and leads out of them where balls about their middles, which nothing stands in, meet;
    it ends at the goal, or beside it where that is barred. Where the goal lies beyond the cells, it
    leads over one of their sides, and the rest counts as not seen. greed: with more than 1 it looks
    at fewer cells, and the way costs at most so many times as much.
    """
    nx, ny, nz = price.shape
    best = np.full(price.shape, np.inf)
    came = np.empty((nx, ny, nz), dtype=np.int64)
    done = np.zeros((nx, ny, nz), dtype=np.bool_)
    a, b, c = int(start[0]), int(start[1]), int(start[2])
    ga, gb, gc = int(goal[0]), int(goal[1]), int(goal[2])
    beyond = ga < 0 or gb < 0 or ga >= nx or gb >= ny
    toward = ga - start[0], gb - start[1], float(nx + ny + nz)
    barred = not beyond and price[ga, gb, gc] == np.inf
    bound = cheapness(price, ga, gb, gc, ENDS_BESIDE * np.sqrt(3.0) if barred else 0.0)
    best[a, b, c], came[a, b, c] = 0.0, -1
    queue = [(0.0, (a * ny + b) * nz + c)]
    end, looked = -1, 0
    while len(queue) > 0 and looked < most_looked:
        _, here = heapq.heappop(queue)
        if here < 0:
            end = -here - 1
            break
        c = here % nz
        b = (here // nz) % ny
        a = here // (nz * ny)
        if done[a, b, c]:
            continue
        done[a, b, c] = True
        looked += 1
        if max(abs(a - ga), abs(b - gb), abs(c - gc)) <= (ENDS_BESIDE if barred else 0):
            end = here
            break
        spent = best[a, b, c]
        if beyond and (a == 0 or b == 0 or a == nx - 1 or b == ny - 1):
            rest = np.sqrt((a - ga) ** 2 + (b - gb) ** 2 + (c - gc) ** 2)
            heapq.heappush(queue, (spent + greed * UNOBSERVED_COST * rest, -here - 1))
        begins_barred = price[a, b, c] == np.inf
        here_price = BARRED if begins_barred else min(price[a, b, c], most)
        for da in range(-1, 2):
            for db in range(-1, 2):
                for dc in range(-1, 2):
                    u, v, w = a + da, b + db, c + dc
                    if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz:
                        continue
                    if done[u, v, w] or (price[u, v, w] == np.inf and not begins_barred):
                        continue
                    apart = np.sqrt(da * da + db * db + dc * dc)
                    if begins_barred and nearest[u, v, w] + nearest[a, b, c] <= apart:
                        continue
                    length = np.sqrt(da * da + db * db + (VERTICAL * dc) ** 2)
                    there_price = min(price[u, v, w], most)
                    if price[u, v, w] == np.inf:
                        there_price = BARRED
                    cost = spent + 0.5 * length * (here_price + there_price)
                    aside = _to_the_left(u - start[0], v - start[1], w - start[2], toward)
                    cost += APART * length * aside
                    if cost < best[u, v, w]:
                        best[u, v, w] = cost
                        came[u, v, w] = here
                        ahead = bound_cost(bound, u, v, w, ga, gb, gc)
                        heapq.heappush(queue, (cost + greed * ahead, (u * ny + v) * nz + w))
    if end < 0:
        return np.zeros((0, 3)), looked
    count, at = 1, end
    while came[at // (nz * ny), (at // nz) % ny, at % nz] >= 0:
        at = came[at // (nz * ny), (at // nz) % ny, at % nz]
        count += 1
    way, at = np.empty((count, 3)), end
    for n in range(count - 1, -1, -1):
        way[n, 0], way[n, 1], way[n, 2] = at // (nz * ny), (at // nz) % ny, at % nz
        at = came[at // (nz * ny), (at // nz) % ny, at % nz]
    return way, looked


@compiled
def _to_the_left(x: float, y: float, z: float, toward: tuple[float, float, float]) -> float:
    """Number from 0 to 1 of a cell: by how far it lies to the left of the straight way, farther on
    and up, all of them told apart. toward: of the goal, and cells along all sides."""
    level = max(np.hypot(toward[0], toward[1]), 1.0)
    ahead = (x * toward[0] + y * toward[1]) / level
    left = (y * toward[0] - x * toward[1]) / level
    most = toward[2]
    return float(0.5 + (left * (0.25 + 0.125 * ahead / most) + 0.0625 * z) / most)


@compiled
def _corners(price: Floats3, way: Floats2) -> Ints:
    """[n] where a way over cells really turns: between, straight lines cost no more."""
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
    return np.array(kept)


@compiled
def _line_price(price: Floats3, start: Floats, end: Floats) -> float:
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
