"""The way over cells down from a place, where time falls fastest, and the corners that it needs:
compiled loops."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.rate.route_field import Pace, straight_time
from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.live.routing.field.cell_march import ENDS_BESIDE
from clearway.live.routing.field.cell_prices import PricedCells, cell_holding, middle_of_cell
from clearway.live.routing.field.route_levels import Levels
from clearway.live.routing.field.wave import IN_SIGHT

MOST_STEPS = 4000
"""Cells of a way at most."""
LONGER = 1.05
"""Times what a way costs, up to which a straight line is flown instead of it."""
ASIDE = 0.3
"""Finest cells to both sides of a straight line that are open, too: it keeps off corners."""


@compiled
def cells_down(cells: PricedCells, pace: Pace, time_s: Floats, own: int, target: Floats) -> Ints:
    """Return the cells of the way from one, where time falls fastest, to where it began; beside
    a target that something stands at, the first."""
    levels = cells.levels
    n, layers = levels.n, levels.layers
    home = cell_holding(levels, target[0], target[1], target[2])
    is_open = home >= 0 and cells.price[home] < np.inf
    beside = 0.0 if is_open else (ENDS_BESIDE + 0.5) * levels.width_m
    way = np.empty(MOST_STEPS, dtype=np.int64)
    way[0], count = own, 1
    while count < MOST_STEPS:
        here = way[count - 1]
        x, y, z = middle_of_cell(levels, here)
        step = 0.75 * levels.width_m * (1 << (here // (layers * n * n)))
        dz = target[2] - z if layers > 1 else 0.0
        if max(abs(target[0] - x), abs(target[1] - y)) <= beside:
            straight = straight_time(pace, target[0] - x, target[1] - y, dz)[0]
            if time_s[here] <= IN_SIGHT * straight:
                break
        steepest, to = 0.0, -1
        for a in range(-1, 2):
            for b in range(-1, 2):
                for c in range(-1, 2):
                    k = here % layers + c
                    if k < 0 or k >= layers or (a == 0 and b == 0 and c == 0):
                        continue
                    up = z + c * levels.layer_m
                    there = here + c
                    if a != 0 or b != 0:
                        there = cell_holding(levels, x + a * step, y + b * step, up)
                    if there < 0 or not time_s[there] < time_s[here]:
                        continue
                    # Past a corner of what stands nothing leads aslant.
                    aslant = a != 0 and b != 0
                    if aslant and not _are_open_beside(
                        levels, time_s, x, y, up, a * step, b * step
                    ):
                        continue
                    u, v, w = middle_of_cell(levels, there)
                    away = np.sqrt((u - x) ** 2 + (v - y) ** 2 + (w - z) ** 2)
                    if c != 0 and cells.clearance_m[here] + cells.clearance_m[there] < away:
                        continue
                    level_m = np.sqrt((u - x) ** 2 + (v - y) ** 2 + 4.0 * (w - z) ** 2)
                    slope = (time_s[here] - time_s[there]) / level_m
                    if slope > steepest:
                        steepest, to = slope, there
        if to < 0:
            break
        way[count] = to
        count += 1
    return way[:count].copy()


@compiled
def _are_open_beside(
    levels: Levels, time_s: Floats, x: float, y: float, z: float, dx: float, dy: float
) -> bool:
    """Whether time came to both cells beside a step aslant."""
    one, other = cell_holding(levels, x + dx, y, z), cell_holding(levels, x, y + dy, z)
    return bool(one >= 0 and time_s[one] < np.inf and other >= 0 and time_s[other] < np.inf)


@compiled
def corners_on(
    cells: PricedCells, speed_mps: Floats, places: Floats2, left_s: Floats, slight_s: float
) -> Ints:
    """Return which places [n, 3] of a way it turns at: between, straight lines take no longer,
    or only so slightly.

    left_s: [n] time to go from each.
    """
    kept = [0]
    at, last = 0, len(places) - 1
    while at < last:
        reach, ahead = at + 1, 2
        while at + ahead // 2 < last:
            to = min(at + ahead, last)
            if not _is_straight(cells, speed_mps, places, left_s, slight_s, at, to):
                break
            reach = to
            ahead *= 2
        # Between the last that was straight and the first that was not.
        high = min(at + ahead, last)
        while high - reach > 1:
            middle = (reach + high) // 2
            if _is_straight(cells, speed_mps, places, left_s, slight_s, at, middle):
                reach = middle
            else:
                high = middle
        kept.append(reach)
        at = reach
    return np.array(kept)


@compiled
def _is_straight(
    cells: PricedCells,
    speed_mps: Floats,
    places: Floats2,
    left_s: Floats,
    slight_s: float,
    at: int,
    to: int,
) -> bool:
    allowed = LONGER * (left_s[at] - left_s[to]) + slight_s
    return bool(line_seconds(cells, speed_mps, places[at], places[to]) <= allowed)


@compiled
def line_seconds(cells: PricedCells, speed_mps: Floats, start: Floats, end: Floats) -> float:
    """Return the seconds of the straight line between two places [3]; inf through what stands, or
    close by it."""
    levels = cells.levels
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = np.sqrt(dx * dx + dy * dy + 4.0 * dz * dz)
    steps = max(int(np.ceil(2.0 * length / levels.width_m)), 1)
    aside = ASIDE * levels.width_m / max(np.hypot(dx, dy), 1e-9)
    least_m = np.hypot(levels.layer_m, levels.width_m)
    total, before = 0.0, -1
    for s in range(steps):
        share = (s + 0.5) / steps
        x, y, z = start[0] + share * dx, start[1] + share * dy, start[2] + share * dz
        for sign in (-1.0, 1.0):
            beside = cell_holding(levels, x - sign * aside * dy, y + sign * aside * dx, z)
            if beside < 0 or speed_mps[beside] <= 0.0:
                return np.inf
        cell = cell_holding(levels, x, y, z)
        if cell < 0 or speed_mps[cell] <= 0.0:
            return np.inf
        changes = before >= 0 and cell % levels.layers != before % levels.layers
        # Balls about both middles that overlap leave no slab between them.
        if changes and cells.clearance_m[cell] + cells.clearance_m[before] < least_m:
            return np.inf
        total += 1.0 / speed_mps[cell]
        before = cell
    return float(length * total / steps)


@compiled
def middles_of(levels: Levels, cells: Ints) -> Floats2:
    """Return the middles [n, 3] of cells [n]."""
    places = np.empty((len(cells), 3))
    for n in range(len(cells)):
        places[n, 0], places[n, 1], places[n, 2] = middle_of_cell(levels, cells[n])
    return places
