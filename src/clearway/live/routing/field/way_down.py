"""A way by the route field: where the time to go falls fastest, and the corners that it needs."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.rate.route_field import RouteField, time_to_go
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled

STEP = 1.5
"""Of the cells about a place: as far ahead the best direction is looked for."""
TURNS = 24
CLIMBS = (-0.6, 0.0, 0.6)
"""Directions that are looked at: around, and metres up by the metre."""
MOST_STEPS = 1000
"""A way is followed no farther."""
LONGER = 1.05
"""Times what the way takes, up to which a straight line may be flown instead of it."""


@compiled
def way_down(field: RouteField, start: Floats) -> Floats2:
    """Return the corners [n, 3] of a way from a place [3] to the target, without its start.

    None where no way is known. The last is the target, or as near to it as a way leads.
    """
    path = np.empty((MOST_STEPS + 2, 3))
    path[0] = start
    count, left = 1, time_to_go(field, start[0], start[1], start[2])[0]
    if left == np.inf:
        return path[:0].copy()
    while count <= MOST_STEPS:
        x, y, z = path[count - 1, 0], path[count - 1, 1], path[count - 1, 2]
        step = STEP * _cell_width(field, x, y)
        target = field.target_m
        level = np.hypot(target[0] - x, target[1] - y)
        if level <= step and abs(target[2] - z) <= max(step, field.layer_m):
            path[count] = target
            count += 1
            break
        best, to_x, to_y, to_z = left, x, y, z
        for turn in range(TURNS):
            angle = 2.0 * np.pi * turn / TURNS
            for climb in CLIMBS:
                if climb != 0.0 and field.time_s.shape[3] == 1:
                    continue
                u, v = x + step * np.cos(angle), y + step * np.sin(angle)
                w = z + climb * step
                there = time_to_go(field, u, v, w)[0]
                if there < best:
                    best, to_x, to_y, to_z = there, u, v, w
        if best >= left:
            break
        path[count, 0], path[count, 1], path[count, 2] = to_x, to_y, to_z
        left = best
        count += 1
    return _keep_turns(field, path[:count])


@compiled
def _cell_width(field: RouteField, x: float, y: float) -> float:
    """Of the finest cells that hold a place."""
    levels, n, _, _ = field.time_s.shape
    width = field.width_m
    for level in range(levels - 1):
        u, v = (x - field.low_m[level, 0]) / width, (y - field.low_m[level, 1]) / width
        if u >= 1.0 and v >= 1.0 and u < n - 1.0 and v < n - 1.0:
            return width
        width *= 2.0
    return width


@compiled
def _keep_turns(field: RouteField, path: Floats2) -> Floats2:
    """The places of a path at which it turns: between, straight lines take no longer."""
    kept = np.empty((len(path), 3))
    count, at, last = 0, 0, len(path) - 1
    while at < last:
        reach, ahead = at + 1, 2
        while at + ahead // 2 < last:
            to = min(at + ahead, last)
            if not _is_straight(field, path[at], path[to]):
                break
            reach = to
            ahead *= 2
        # Between the last that was straight and the first that was not.
        high = min(at + ahead, last)
        while high - reach > 1:
            middle = (reach + high) // 2
            if _is_straight(field, path[at], path[middle]):
                reach = middle
            else:
                high = middle
        kept[count] = path[reach]
        count += 1
        at = reach
    return kept[:count].copy()


@compiled
def _is_straight(field: RouteField, start: Floats, end: Floats) -> bool:
    """Whether the straight line between two places takes about what the field says."""
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    steps = max(int(np.ceil(2.0 * length / field.width_m)), 1)
    allowed = time_to_go(field, start[0], start[1], start[2])[0]
    allowed = LONGER * (allowed - time_to_go(field, end[0], end[1], end[2])[0])
    allowed += field.width_m / field.pace.fastest_mps
    seconds = 0.0
    for s in range(steps):
        share = (s + 0.5) / steps
        x, y, z = start[0] + share * dx, start[1] + share * dy, start[2] + share * dz
        left, _, _, _, speed = time_to_go(field, x, y, z)
        if left == np.inf or speed <= 0.0:
            return False
        seconds += length / (steps * speed)
        if seconds > allowed:
            return False
    return True
