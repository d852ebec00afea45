"""How time marches over cells with cost weights, from a target to the vehicle: compiled loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.rate.route_field import Pace
from clearway.base.arrays import Bools, Floats, Floats2
from clearway.base.compiled import compiled
from clearway.live.routing.field.cell_prices import PricedCells, cell_holding, middle_of_cell
from clearway.live.routing.field.clearance_speed import BARRED_M
from clearway.live.routing.field.marching import BUCKET, lay_out_march, let_time_pass
from clearway.live.routing.field.route_levels import Levels
from clearway.live.routing.field.wave import March, begin_in_cell

BEGINS_WITHIN = 3
"""Cells about a place in which the one is looked for that a way begins in."""
MOST_ROOM = 2.0
"""Cells about a place beyond which more room says nothing of which side of a wall it is on."""
SLIGHTLY = 1e-3
"""Weight of a metre towards the target, and its square of one to the right, against one of room."""
ENDS_BESIDE = 2
"""Cells from a target that something stands at at which a way to it ends."""
SLACK = 3.0
"""Finest cells that time marches on after it has come to the vehicle."""
FLOWN = 0.75
"""Share of the cost along the way that is being flown: another must be better by so much."""
APART = 5e-5
"""Share of its cost by which a way to the left costs more than its like to the right: else of two
that cost the same the order of cells would decide, and with it where north lies."""


@compiled
def cell_beside(cells: PricedCells, place: Floats, target: Floats, clear_m: float) -> int:
    """Return the open cell by which a place is left: that with most room near it, of its side of
    a wall; of several the one towards the target, and to the right. -1 where there is none.

    clear_m: from the place [3] to what is nearest. A ball about it and one about the middle of the
    cell, which nothing stands in, meet.
    """
    levels = cells.levels
    width, up = levels.width_m, levels.layer_m if levels.layers > 1 else 0.0
    ahead_x, ahead_y = target[0] - place[0], target[1] - place[1]
    far = max(np.hypot(ahead_x, ahead_y), 1e-9) / SLIGHTLY
    best, found = -np.inf, -1
    for a in range(-BEGINS_WITHIN, BEGINS_WITHIN + 1):
        for b in range(-BEGINS_WITHIN, BEGINS_WITHIN + 1):
            for c in range(-1, 2 if up > 0.0 else 0):
                cell = cell_holding(
                    levels, place[0] + a * width, place[1] + b * width, place[2] + c * up
                )
                if cell < 0 or cells.price[cell] == np.inf:
                    continue
                x, y, z = middle_of_cell(levels, cell)
                dx, dy, dz = x - place[0], y - place[1], z - place[2]
                if up == 0.0:
                    dz = 0.0
                away = np.sqrt(dx * dx + dy * dy + dz * dz)
                room = cells.clearance_m[cell]
                if away > room + clear_m:
                    continue
                score = min(room, MOST_ROOM * width) - away
                score += (dx * ahead_x + dy * ahead_y) / far
                score += SLIGHTLY * (dx * ahead_y - dy * ahead_x) / far
                if score > best:
                    best, found = score, cell
    return found


class WayRule(NamedTuple):
    """What ways are looked for by."""

    mps: float
    """Speed where a metre costs 1."""
    most: float
    """A metre costs no more than that."""
    far: float
    """Cost of a metre where cells that are not of the finest are closed: they may be too coarse to
    show a gap; inf for none."""


@compiled
def way_speeds(
    cells: PricedCells, rule: WayRule, flown: Floats2, start: Floats, target: Floats
) -> Floats:
    """Return the speed [cells] of ways by their cost.

    flown: [n, 3] corners of the way that is being flown, from the vehicle on; none for none.
    """
    levels, price = cells.levels, cells.price
    n, layers = levels.n, levels.layers
    speed = np.empty(len(price))
    along = _along(levels, flown, len(price))
    others = 1.0 / FLOWN if len(flown) > 0 else 1.0
    ahead_x, ahead_y = target[0] - start[0], target[1] - start[1]
    widest = levels.width_m * (1 << levels.depth) * n
    least = max(np.hypot(ahead_x, ahead_y), levels.width_m) * widest
    cell = 0
    for level in range(levels.depth):
        width = levels.width_m * (1 << level)
        for i in range(n):
            x = (levels.low[level, 0] + i + 0.5) * width - start[0]
            for j in range(n):
                y = (levels.low[level, 1] + j + 0.5) * width - start[1]
                left = (y * ahead_x - x * ahead_y) / least
                for k in range(layers):
                    slower = 1.0 + APART * (0.5 + 0.5 * left + 0.1 * k / layers)
                    if not along[cell]:
                        slower *= others
                    speed[cell] = rule.mps / (min(price[cell], rule.most) * slower)
                    if price[cell] == np.inf:
                        is_far = level > 0 and cells.clearance_m[cell] > BARRED_M
                        speed[cell] = rule.mps / rule.far if is_far else 0.0
                    cell += 1
    return speed


@compiled
def _along(levels: Levels, corners: Floats2, count: int) -> Bools:
    """Which cells lie along a polyline [n, 3], or touch those that do."""
    marked = np.zeros(count, dtype=np.bool_)
    width, up = levels.width_m, levels.layer_m if levels.layers > 1 else 0.0
    for n in range(len(corners) - 1):
        step = corners[n + 1] - corners[n]
        steps = int(np.ceil(2.0 * np.sqrt(np.sum(step * step)) / width)) + 1
        for s in range(steps + 1):
            at = corners[n] + step * (s / steps)
            for a in range(-1, 2):
                for b in range(-1, 2):
                    for c in range(-1, 2):
                        x, y, z = at[0] + a * width, at[1] + b * width, at[2] + c * up
                        cell = cell_holding(levels, x, y, z)
                        if cell >= 0:
                            marked[cell] = True
    return marked


@compiled
def march_to(
    cells: PricedCells,
    pace: Pace,
    speed_mps: Floats,
    target: Floats,
    vehicle: Floats,
    own: int,
    most_s: float,
) -> tuple[Floats, bool]:
    """Return the time to go [cells] to a target [3], as far as it matters for a way from the
    vehicle's own cell, and whether there is one that takes no longer than `most_s`."""
    levels = cells.levels
    cell_s = levels.width_m / pace.fastest_mps
    m = lay_out_march(levels, pace, cells.clearance_m, speed_mps, target, BUCKET * cell_s)
    _begin_beside(m)
    found, _ = let_time_pass(m, vehicle, own, SLACK * cell_s, most_s)
    return m.time_s, found


@compiled
def _begin_beside(m: March) -> None:
    """Let time begin in the cells that clear balls about their middles hold the target of; else,
    where something stands there, in those beside it."""
    levels = m.levels
    n, layers = levels.n, levels.layers
    x, y, z = m.target[0], m.target[1], m.target[2]
    home = -1
    for level in range(levels.depth):
        width = levels.width_m * (1 << level)
        i = int(np.floor(x / width)) - levels.low[level, 0]
        j = int(np.floor(y / width)) - levels.low[level, 1]
        if (0 <= i < n and 0 <= j < n) or level == levels.depth - 1:
            i, j = min(max(i, 0), n - 1), min(max(j, 0), n - 1)
            x = (levels.low[level, 0] + i + 0.5) * width
            y = (levels.low[level, 1] + j + 0.5) * width
            home = cell_holding(levels, x, y, z)
            for far in range(ENDS_BESIDE + 1):
                begun = 0
                for a in range(-far, far + 1):
                    for b in range(-far, far + 1):
                        for c in range(-far, far + 1 if layers > 1 else 1 - far):
                            up = c * levels.layer_m
                            cell = cell_holding(levels, x + a * width, y + b * width, z + up)
                            if cell < 0 or m.speed_mps[cell] <= 0.0 or m.waits[cell]:
                                continue
                            at = middle_of_cell(levels, cell)
                            dx, dy, dz = at[0] - m.target[0], at[1] - m.target[1], 0.0
                            if layers > 1:
                                dz = at[2] - m.target[2]
                            away2 = dx * dx + dy * dy + dz * dz
                            if far > 1 or cell == home or away2 < m.clearance_m[cell] ** 2:
                                begin_in_cell(m, cell, at)
                                begun += 1
                if far > 0 and (begun > 0 or m.counts[1] > 0):
                    return
            return
