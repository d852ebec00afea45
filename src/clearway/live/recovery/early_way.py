"""A way past what bars the straight one, flown before that comes to nothing.

Trajectories lead no farther than sensors see, and cost what the straight way on from their ends
does: so what bars it is flown up to, and only there another way looked for. For who turns in no
room and at once a way over cells is as good as flown from where the obstacle comes into view, if
all of it was seen until the goal lies open. A way that hangs on unobserved space is not: straight
on, more of both sides comes into view, and to go on to the wrong end of a wall costs more than to
go on to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.live.routing.field.cell_prices import BEGINS, PricedCells, cell_holding
from clearway.live.routing.seen_planner import SeenPlanner

ASIDE_RAD = tuple(np.radians([5.0, 10.0, 15.0]).tolist())
"""Of the straight way, to either side: where one of these is open, trajectories lead past."""
STEPS = 2
"""Places looked at along a cell's width of the straight way to the goal."""


def early_way(
    routes: SeenPlanner,
    position_m: FloatArray,
    goal_m: FloatArray,
    flown_m: Sequence[FloatArray] = (),
    ahead_m: float = np.inf,
) -> tuple[FloatArray, ...]:
    """Corners [3] of a way to the goal, without its ends; none where the straight way is open as
    far as is known, or one little to the side of it as far as trajectories lead, or where what was
    seen of another way does not lead past what bars it.

    flown_m: corners [3] of the way being flown, which is kept while it leads past. ahead_m: how far
    trajectories lead.
    """
    cells = routes.cells
    if _lies_open(cells, position_m, goal_m) or _opens_aside(cells, position_m, goal_m, ahead_m):
        return ()
    if len(flown_m) > 1 and _leads_past(cells, np.stack([position_m, *flown_m]), goal_m):
        return tuple(flown_m[:-1])
    route = routes.find_seen_route(position_m, goal_m, flown_m)
    corners = np.concatenate([position_m[None], route.corners_m])
    if not route.reaches or not _leads_past(cells, corners, goal_m):
        return ()
    return route.via_m(goal_m)


@compiled
def _leads_past(cells: PricedCells, corners: Floats2, goal: Floats) -> bool:
    """Whether a way through corners [n, 3] was seen until nothing that is known stands between it
    and the goal."""
    width = cells.levels.width_m
    for n in range(len(corners) - 1):
        step = corners[n + 1] - corners[n]
        count = int(np.ceil(np.sqrt(np.sum(step * step)) / width))
        for s in range(count + 1):
            at = corners[n] + step * (s / max(count, 1))
            if np.sum((at - corners[0]) ** 2) <= (BEGINS * width) ** 2:
                continue
            cell = cell_holding(cells.levels, at[0], at[1], at[2])
            if cell < 0 or cells.price[cell] > 1.0:
                return False
            if _lies_open(cells, at, goal):
                return True
    return True


@compiled
def _opens_aside(cells: PricedCells, start: Floats, goal: Floats, ahead_m: float) -> bool:
    """Whether a straight way little to the side of the one to the goal is open so far."""
    dx, dy, dz = goal[0] - start[0], goal[1] - start[1], goal[2] - start[2]
    share = min(1.0, ahead_m / np.sqrt(dx * dx + dy * dy + dz * dz))
    for aside in ASIDE_RAD:
        for sign in (-1.0, 1.0):
            cos, sin = np.cos(sign * aside), np.sin(sign * aside)
            turned = np.array([cos * dx - sin * dy, sin * dx + cos * dy, dz])
            if _lies_open(cells, start, start + share * turned):
                return True
    return False


@compiled
def _lies_open(cells: PricedCells, start: Floats, goal: Floats) -> bool:
    """Whether nothing is known to stand in the straight way from beyond the first cell's width;
    where there are no cells nothing is known."""
    length = np.sqrt(np.sum((goal - start) ** 2)) / cells.levels.width_m
    for step in range(STEPS, int(np.ceil(STEPS * length))):
        at = start + (goal - start) * (step / (STEPS * length))
        cell = cell_holding(cells.levels, at[0], at[1], at[2])
        if cell >= 0 and cells.price[cell] == np.inf:
            return False
    return True
