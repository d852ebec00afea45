"""What a metre costs in a cell: compiled loops over the levels of cells.

More in unobserved space, where little room to turn is left and where ways have come to
nothing; nothing leads through what stands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Ints2
from clearway.base.compiled import compiled
from clearway.live.routing.field.clearance_speed import BARRED_M, find_barred_clearance
from clearway.live.routing.field.route_levels import Levels, middle_of

UNOBSERVED_COST = 2.0
"""Cost of a metre that nobody has seen."""
BEGINS = 2
"""Cells from the vehicle that a way cannot hang on, and from a goal at which it comes to it."""
OF_TURN = 0.6
"""Cells wider than that share of the turning radius tell nothing of room to turn."""


class PriceRule(NamedTuple):
    """What a metre costs where."""

    closed_m: float
    """Clearance below which near cells are closed."""
    margin_m: float
    tall: float
    """Where nobody has seen it, above or below what stands: most of it stands on."""
    turning_m: float
    """Turning radius; 0 for what turns on the spot."""
    no_room: float
    """With no room beside the margin to turn."""
    hardly_room: float
    """With none to turn half as wide."""


class PricedCells(NamedTuple):
    """Space about the vehicle as cells with cost weights."""

    levels: Levels
    price: Floats
    """[cells] of a metre, at least 1; inf where no way leads."""
    in_vain: Floats
    """[cells] the part of it for ways that came to nothing."""
    clearance_m: Floats
    """[cells] from the middle of each to what is nearest, as far as it matters."""


@compiled
def prices_of(
    levels: Levels, clearance_m: Floats, seen: Bools, in_vain: Floats, rule: PriceRule
) -> Floats:
    """Return the cost [cells] of a metre."""
    n, layers = levels.n, levels.layers
    price = np.empty(len(clearance_m))
    for level in range(levels.depth):
        barred = find_barred_clearance(levels, level, rule.closed_m)
        first = level * n * n * layers
        for above in range(n * n):
            column, stands = first + above * layers, False
            for cell in range(column, column + layers):
                stands = stands or BARRED_M < clearance_m[cell] < barred
            unseen = rule.tall if stands else UNOBSERVED_COST
            for cell in range(column, column + layers):
                price[cell] = 1.0 if seen[cell] else unseen
        if rule.turning_m > 0.0 and levels.width_m * (1 << level) <= OF_TURN * rule.turning_m:
            further = rule.hardly_room / rule.no_room
            _raise_without_room(levels, level, clearance_m, price, barred, rule, 1.0, rule.no_room)
            _raise_without_room(levels, level, clearance_m, price, barred, rule, 0.5, further)
        for cell in range(first, first + n * n * layers):
            price[cell] += in_vain[cell]
            if clearance_m[cell] < barred:
                price[cell] = np.inf
    return price


@compiled
def _raise_without_room(
    levels: Levels,
    level: int,
    clearance_m: Floats,
    price: Floats,
    barred: float,
    rule: PriceRule,
    share: float,
    times: float,
) -> None:
    """Raise the cost of cells of a level about which no turn of a share of the radius has room: off
    something beside a wide place nobody has to keep for a turn."""
    n, layers, within = levels.n, levels.layers, share * rule.turning_m
    room = rule.margin_m + within
    steps = _outwards(levels, level, within)
    first = level * n * n * layers
    for cell in range(first, first + n * n * layers):
        if clearance_m[cell] >= room or clearance_m[cell] < barred:
            continue
        k = cell % layers
        j = (cell // layers) % n
        i = (cell // (layers * n)) % n
        has_room = False
        for s in range(1, len(steps)):
            u, v, w = i + steps[s, 0], j + steps[s, 1], k + steps[s, 2]
            if u < 0 or v < 0 or w < 0 or u >= n or v >= n or w >= layers:
                continue
            if clearance_m[first + (u * n + v) * layers + w] >= room:
                has_room = True
                break
        if not has_room:
            price[cell] *= times


@compiled
def _outwards(levels: Levels, level: int, within_m: float) -> Ints2:
    """[k, 3] steps to the cells about one whose middles lie within a distance, the nearest first;
    the first is none."""
    width = levels.width_m * (1 << level)
    far, up = int(within_m / width), int(within_m / levels.layer_m)
    if levels.layers == 1:
        up = 0
    side, high = 2 * far + 1, 2 * up + 1
    steps = np.empty((side * side * high, 3), dtype=np.int64)
    away2 = np.empty(len(steps))
    for s in range(len(steps)):
        steps[s, 0], steps[s, 1] = s // (side * high) - far, s // high % side - far
        steps[s, 2] = s % high - up
        level2 = width * width * (steps[s, 0] ** 2 + steps[s, 1] ** 2)
        away2[s] = level2 + (levels.layer_m * steps[s, 2]) ** 2
    order = np.argsort(away2, kind="mergesort")
    count = 0
    while count < len(order) and away2[order[count]] <= within_m * within_m:
        count += 1
    return steps[order[:count]]


@compiled
def add_balls(levels: Levels, values: Floats, balls: Floats2) -> None:
    """Add to the cells [cells] about places, and twice as far above and below.

    balls: [n, 6] of each x, y, lowest and highest height, radius and what is added.
    """
    n, layers = levels.n, levels.layers
    for at in range(len(balls)):
        x, y, radius = balls[at, 0], balls[at, 1], balls[at, 4]
        for level in range(levels.depth):
            width = levels.width_m * (1 << level)
            far = int(np.ceil(radius / width))
            a = int(np.floor(x / width)) - levels.low[level, 0]
            b = int(np.floor(y / width)) - levels.low[level, 1]
            for i in range(max(a - far, 0), min(a + far + 1, n)):
                for j in range(max(b - far, 0), min(b + far + 1, n)):
                    for k in range(layers):
                        u, v, w = middle_of(levels, level, i, j, k)
                        dx, dy = u - x, v - y
                        dz = 0.5 * max(0.0, balls[at, 2] - w, w - balls[at, 3])
                        if layers == 1:
                            dz = 0.0
                        if dx * dx + dy * dy + dz * dz <= radius * radius:
                            values[((level * n + i) * n + j) * layers + k] += balls[at, 5]


@compiled
def cell_holding(levels: Levels, x: float, y: float, z: float) -> int:
    """Return the finest cell that holds a place, of the layer nearest to it; -1 beyond all."""
    n, layers, k = levels.n, levels.layers, 0
    if layers > 1:
        k = int(np.floor((z - levels.lowest_m) / levels.layer_m + 0.5))
        k = min(max(k, 0), layers - 1)
    width = levels.width_m
    for level in range(levels.depth):
        i = int(np.floor(x / width)) - levels.low[level, 0]
        j = int(np.floor(y / width)) - levels.low[level, 1]
        if 0 <= i < n and 0 <= j < n:
            return int(((level * n + i) * n + j) * layers + k)
        width *= 2.0
    return -1


@compiled
def middle_of_cell(levels: Levels, cell: int) -> tuple[float, float, float]:
    n, layers = levels.n, levels.layers
    level = cell // (layers * n * n)
    return middle_of(levels, level, (cell // (layers * n)) % n, (cell // layers) % n, cell % layers)
