"""Which cells were seen to be free: a compiled loop over the voxels of free space."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Bools, Floats
from clearway.base.compiled import compiled
from clearway.live.routing.field.route_levels import Levels, middle_of
from clearway.sensors.observed.free_voxels import WORD, is_declared, is_marked
from clearway.sensors.observed.seen_space import SeenSpace

ASIDE = 0.2
"""Of a cell's edge: as far from its middle a place of each eighth is looked up, in the middle of a
voxel where four lie along a cell."""
MOSTLY = 4
"""Of the eight places, for most of a cell."""


@compiled
def mark_seen(
    levels: Levels, seen: Bools, space: SeenSpace, vehicle: Floats, within_m: float
) -> None:
    """Mark cells [cells] within a distance of a vehicle [3] most of which was seen to be free, and
    all those where a map is declared complete."""
    n, layers = levels.n, levels.layers
    for level in range(levels.depth):
        width = levels.width_m * (1 << level)
        low_x, low_y = levels.low[level, 0], levels.low[level, 1]
        first = max(int(np.floor((vehicle[0] - within_m) / width)) - low_x, 0)
        last = min(int(np.floor((vehicle[0] + within_m) / width)) - low_x, n - 1)
        first_b = max(int(np.floor((vehicle[1] - within_m) / width)) - low_y, 0)
        last_b = min(int(np.floor((vehicle[1] + within_m) / width)) - low_y, n - 1)
        for i in range(first, last + 1):
            for j in range(first_b, last_b + 1):
                x, y, _ = middle_of(levels, level, i, j, 0)
                if not _is_any_free(space, x, y, ASIDE * width):
                    continue
                for k in range(layers):
                    cell = ((level * n + i) * n + j) * layers + k
                    if not seen[cell]:
                        z = levels.lowest_m + k * levels.layer_m
                        up = ASIDE * levels.layer_m if layers > 1 else 0.0
                        seen[cell] = _is_mostly_free(space, x, y, z, ASIDE * width, up)
    if space.window[8] <= space.window[11]:
        _mark_declared(levels, seen, space.window)


@compiled
def _mark_declared(levels: Levels, seen: Bools, window: Floats) -> None:
    cell = 0
    for level in range(levels.depth):
        for i in range(levels.n):
            for j in range(levels.n):
                for k in range(levels.layers):
                    x, y, z = middle_of(levels, level, i, j, k)
                    seen[cell] = seen[cell] or is_declared(window, x, y, z, 0.0)
                    cell += 1


@compiled
def _is_any_free(space: SeenSpace, x: float, y: float, aside: float) -> bool:
    """Whether anything is free in the columns that stand for the cells above each other."""
    free, window = space.free, space.window
    last = free.shape[0] - 1
    for u in (x - aside, x + aside):
        for v in (y - aside, y + aside):
            a, b = int(np.floor(u * window[3])), int(np.floor(v * window[3]))
            if a < window[0] or b < window[1] or a > window[0] + last or b > window[1] + last:
                continue
            for word in range(free.shape[2]):
                if free[np.uint64(a & last), np.uint64(b & last), word] != np.uint64(0):
                    return True
    return False


@compiled
def _is_mostly_free(
    space: SeenSpace, x: float, y: float, z: float, aside: float, up: float
) -> bool:
    free, window = space.free, space.window
    columns, rows = free.shape[0], WORD * free.shape[2]
    count = 0
    for u in (x - aside, x + aside):
        a = int(np.floor(u * window[3]))
        if a < window[0] or a >= window[0] + columns:
            continue
        for v in (y - aside, y + aside):
            b = int(np.floor(v * window[3]))
            if b < window[1] or b >= window[1] + columns:
                continue
            for w in (z - up, z + up):
                c = int(np.floor(w * window[3]))
                if window[2] <= c < window[2] + rows:
                    count += is_marked(free, a, b, c)
    return count >= MOSTLY
