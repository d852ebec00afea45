"""A way past what bars the straight one, flown before that comes to nothing.

Trajectories lead no farther than sensors see, and cost what the straight way on from their ends
does: so what bars it is flown up to, and only there another way looked for. For who turns in no
room and at once a way over cells is as good as flown from where the obstacle comes into view, if
all of it was seen until the goal lies open. A way that hangs on what nobody has seen is not:
straight on, more of both sides comes into view, and to go on to the wrong end of a wall costs more
than to go on to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats3
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.live.routing.route_map import Cells
from clearway.live.routing.seen_route import BEGINS, seen_route

ASIDE_RAD = tuple(np.radians([5.0, 10.0, 15.0]).tolist())
"""Of the straight way, to either side: where one of these is open, trajectories lead past."""
STEPS = 2
"""Places looked at along a cell's width of the straight way to the goal."""


def early_way(
    cells: Cells,
    position_m: FloatArray,
    goal_m: FloatArray,
    flown_m: Sequence[FloatArray] = (),
    ahead_m: float = np.inf,
) -> tuple[FloatArray, ...]:
    """Corners [3] of a way to the goal, without its ends; none where the straight way is open as
    far as is known, or one little aside of it as far as trajectories lead, or where what was seen
    of another way does not lead past what bars it.

    flown_m: corners [3] of the way being flown, which is kept while it leads past. ahead_m: how far
    trajectories lead.
    """
    start, goal = ((at - cells.low_m) / cells.width_m for at in (position_m, goal_m))
    if _lies_open(cells.price, start, goal):
        return ()
    if _opens_aside(cells.price, start, goal, ahead_m / cells.width_m):
        return ()
    if len(flown_m) > 1:
        places = (np.stack([position_m, *flown_m]) - cells.low_m) / cells.width_m
        if _leads_past(cells.price, places, goal):
            return tuple(flown_m[:-1])
    route = seen_route(cells, position_m, goal_m, flown_m)
    corners = (np.concatenate([position_m[None], route.corners_m]) - cells.low_m) / cells.width_m
    if not route.reaches or not _leads_past(cells.price, corners, goal):
        return ()
    return route.via_m(goal_m)


@compiled
def _leads_past(price: Floats3, corners: Floats2, goal: Floats) -> bool:
    """Whether a way through corners [n, 3] was seen until nothing that is known stands between it
    and the goal."""
    for n in range(len(corners) - 1):
        step = corners[n + 1] - corners[n]
        count = int(np.ceil(np.sqrt(np.sum(step * step))))
        for s in range(count + 1):
            at = corners[n] + step * (s / max(count, 1))
            if np.sum((at - corners[0]) ** 2) <= BEGINS * BEGINS:
                continue
            if not _lies_in(price, at) or price[int(at[0]), int(at[1]), int(at[2])] > 1.0:
                return False
            if _lies_open(price, at, goal):
                return True
    return True


@compiled
def _opens_aside(price: Floats3, start: Floats, goal: Floats, ahead: float) -> bool:
    """Whether a straight way little aside of the one to the goal is open so many cells far."""
    dx, dy, dz = goal[0] - start[0], goal[1] - start[1], goal[2] - start[2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    share = min(1.0, ahead / length)
    for aside in ASIDE_RAD:
        for sign in (-1.0, 1.0):
            cos, sin = np.cos(sign * aside), np.sin(sign * aside)
            turned = np.array([cos * dx - sin * dy, sin * dx + cos * dy, dz])
            if _lies_open(price, start, start + share * turned):
                return True
    return False


@compiled
def _lies_open(price: Floats3, start: Floats, goal: Floats) -> bool:
    """Whether nothing is known to stand in the straight way from beyond the first cell's width;
    where there are no cells nothing is known."""
    length = np.sqrt(np.sum((goal - start) ** 2))
    for step in range(STEPS, int(np.ceil(STEPS * length))):
        at = start + (goal - start) * (step / (STEPS * length))
        if _lies_in(price, at) and price[int(at[0]), int(at[1]), int(at[2])] == np.inf:
            return False
    return True


@compiled
def _lies_in(price: Floats3, at: Floats) -> bool:
    x, y, z = at[0], at[1], at[2]
    nx, ny, nz = price.shape
    return bool(0.0 <= x < nx and 0.0 <= y < ny and 0.0 <= z < nz)
