"""Where to come from to a goal that was flown past: too near to turn to, it is circled for ever.

Who turns wide cannot hit what lies inside of its circle. In the open it flies away far enough and
comes back; between walls the room for that may lie out of its sight, where it has been before.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Bools3, Floats, Floats3
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.live.routing.route_map import UNOBSERVED_COST, Cells

LEAST, MOST = 2.5, 8.0
"""Turning radii from the goal at which a run-up begins."""
CLIMBS = 0.25
"""Metres that a run-up rises or sinks at most by the metre."""
PASSABLE = 20.0
"""A metre on the way costs at most that: it was seen, or nothing stands above or below it."""


def run_up(
    cells: Cells,
    position_m: FloatArray,
    goal_m: FloatArray,
    turning_radius_m: float,
    room_m: float,
) -> FloatArray | None:
    """The place [3] to come from: nothing known to stand within `room_m`, and a straight way to the
    goal; None where there is none. Of several, the one that is least way round."""
    found = _run_up(
        cells.price,
        cells.nearest_m >= room_m,
        (position_m - cells.low_m) / cells.width_m,
        (goal_m - cells.low_m) / cells.width_m,
        LEAST * turning_radius_m / cells.width_m,
        MOST * turning_radius_m / cells.width_m,
    )
    if found[0] < 0:
        return None
    place: FloatArray = cells.low_m + (np.array(found) + 0.5) * cells.width_m
    return place


@compiled
def _run_up(
    price: Floats3,
    has_room: Bools3,
    position: Floats,
    goal: Floats,
    least: float,
    most: float,
) -> tuple[int, int, int]:
    """The cell, in which a metre costs no more than in the unseen; -1 where there is none."""
    best, found = np.inf, (-1, -1, -1)
    for a in range(price.shape[0]):
        for b in range(price.shape[1]):
            level = np.hypot(a + 0.5 - goal[0], b + 0.5 - goal[1])
            if level < least or level > most:
                continue
            for c in range(price.shape[2]):
                if not has_room[a, b, c] or price[a, b, c] > UNOBSERVED_COST:
                    continue
                if abs(c + 0.5 - goal[2]) > CLIMBS * level + 1.0:
                    continue
                at = np.array([a + 0.5, b + 0.5, c + 0.5])
                length = np.sqrt(np.sum((at - position) ** 2)) + np.sqrt(np.sum((at - goal) ** 2))
                if length < best and _leads_to(price, at, goal):
                    best, found = length, (a, b, c)
    return found


@compiled
def _leads_to(price: Floats3, start: Floats, goal: Floats) -> bool:
    """Whether the straight line between two places is passable, as far as there are cells."""
    steps = int(np.ceil(2.0 * np.sqrt(np.sum((goal - start) ** 2))))
    for s in range(steps):
        at = start + (goal - start) * (s / steps)
        for axis in range(3):
            if not 0.0 <= at[axis] < price.shape[axis]:
                return False
        if not price[int(at[0]), int(at[1]), int(at[2])] <= PASSABLE:
            return False
    return True
