"""Where to come from to a goal that was flown past: too near to turn to, it is circled for ever.

Who turns wide cannot hit what lies inside of its circle. In the open it flies away far enough and
comes back; between walls the room for that may lie out of its sight, where it has been before.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.live.routing.field.cell_prices import (
    UNOBSERVED_COST,
    PricedCells,
    cell_holding,
    middle_of_cell,
)
from clearway.live.routing.field.route_levels import is_covered

LEAST = 2.5
MOST = 8.0
"""Turning radii from the goal at which a run-up begins."""
CLIMBS = 0.25
"""Metres that a run-up rises or sinks at most by the metre."""
PASSABLE = 20.0
"""A metre on the way costs at most that: it was seen, or nothing stands above or below it."""


def run_up(
    cells: PricedCells,
    position_m: FloatArray,
    goal_m: FloatArray,
    turning_radius_m: float,
    room_m: float,
) -> FloatArray | None:
    """The place [3] to come from: nothing known to stand within `room_m`, and a straight way to the
    goal; None where there is none. Of several, the one that is least way round."""
    least_m, most_m = LEAST * turning_radius_m, MOST * turning_radius_m
    found = _run_up(cells, position_m, goal_m, least_m, most_m, room_m)
    return None if found < 0 else np.array(middle_of_cell(cells.levels, found))


@compiled
def _run_up(
    cells: PricedCells,
    position: Floats,
    goal: Floats,
    least_m: float,
    most_m: float,
    room_m: float,
) -> int:
    """The cell, in which a metre costs no more than in unobserved space; -1 where there is none."""
    levels = cells.levels
    n, layers = levels.n, levels.layers
    best, found = np.inf, -1
    for cell in range(len(cells.price)):
        if cells.clearance_m[cell] < room_m or cells.price[cell] > UNOBSERVED_COST:
            continue
        x, y, z = middle_of_cell(levels, cell)
        level = np.hypot(x - goal[0], y - goal[1])
        if level < least_m or level > most_m:
            continue
        if abs(z - goal[2]) > CLIMBS * level + levels.layer_m:
            continue
        depth = cell // (layers * n * n)
        if is_covered(levels, depth, (cell // (layers * n)) % n, (cell // layers) % n):
            continue
        at = np.array([x, y, z])
        length = np.sqrt(np.sum((at - position) ** 2)) + np.sqrt(np.sum((at - goal) ** 2))
        if length < best and _leads_to(cells, at, goal):
            best, found = length, cell
    return found


@compiled
def _leads_to(cells: PricedCells, start: Floats, goal: Floats) -> bool:
    """Whether the straight line between two places is passable."""
    steps = int(np.ceil(2.0 * np.sqrt(np.sum((goal - start) ** 2)) / cells.levels.width_m))
    for s in range(steps):
        at = start + (goal - start) * (s / steps)
        cell = cell_holding(cells.levels, at[0], at[1], at[2])
        if cell < 0 or not cells.price[cell] <= PASSABLE:
            return False
    return True
