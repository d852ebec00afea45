"""Marking the coarse cells of a `RouteMap`: the compiled loops over them."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Bools3, Floats, Floats3, Ints, UInt64s3
from clearway.base.compiled import compiled
from clearway.live.routing.nearest_balls import outwards
from clearway.sensors.observed.free_voxels import WORD, is_marked


@compiled
def mark_seen(seen: Bools3, free: UInt64s3, free_low: Ints, low: Ints, per_cell: int) -> None:
    """Mark cells [nx, ny, nz] most of which was seen to be free, by a voxel of each eighth.

    free, free_low: of a `SeenSpace`. low: [3] number of the lowest cell, `per_cell` voxels wide.
    """
    nx, ny, nz = seen.shape
    columns, rows = free.shape[0], WORD * free.shape[2]
    for a in range(nx):
        u = (low[0] + a) * per_cell
        if u < free_low[0] or u + per_cell > free_low[0] + columns:
            continue
        for b in range(ny):
            v = (low[1] + b) * per_cell
            if v < free_low[1] or v + per_cell > free_low[1] + columns:
                continue
            if not _is_any_free(free, u, v, per_cell):
                continue
            for c in range(nz):
                w = (low[2] + c) * per_cell
                if w < free_low[2] or w + per_cell > free_low[2] + rows:
                    continue
                if not seen[a, b, c]:
                    seen[a, b, c] = _is_mostly_free(free, u, v, w, per_cell)


@compiled
def _is_any_free(free: UInt64s3, u: int, v: int, per_cell: int) -> bool:
    """Whether anything is free in what stands for the cells above each other from a voxel on."""
    last, quarter = free.shape[0] - 1, per_cell // 4
    other = per_cell - 1 - quarter  # As far from the other side, whichever way the world is turned.
    anything = np.uint64(0)
    for i in (u + quarter, u + other):
        for j in (v + quarter, v + other):
            for word in range(free.shape[2]):
                anything |= free[np.uint64(i & last), np.uint64(j & last), word]
    return bool(anything != 0)


@compiled
def _is_mostly_free(free: UInt64s3, u: int, v: int, w: int, per_cell: int) -> bool:
    quarter, count = per_cell // 4, 0
    other = per_cell - 1 - quarter
    for i in (u + quarter, u + other):
        for j in (v + quarter, v + other):
            for k in (w + quarter, w + other):
                count += is_marked(free, i, j, k)
    return count >= 4


@compiled
def renew_nearest(
    nearest: Floats3, fresh: Floats3, squared: tuple[Floats, Floats, Floats], within2: float
) -> None:
    """Take over distances [nx, ny, nz] known now: what is missing there was nothing only nearby.

    squared: [nx], [ny], [nz] distances of cells along each axis; within2: squared too.
    """
    x2, y2, z2 = squared
    nx, ny, nz = nearest.shape
    for a in range(nx):
        for b in range(ny):
            level2 = x2[a] + y2[b]
            for c in range(nz):
                near = level2 + z2[c] <= within2
                known = fresh[a, b, c]
                nearest[a, b, c] = known if near else min(known, nearest[a, b, c])


@compiled
def leaves_no_room(
    nearest: Floats3, barred: float, room: float, within: float, width: float
) -> Bools3:
    """[nx, ny, nz] of cells that are not barred, whether no centre `within` their own is as far as
    `room` from what stands: off something beside a wide place nobody has to keep for a turn.
    nearest: [nx, ny, nz] of centres, like all lengths in metres."""
    nx, ny, nz = nearest.shape
    none = np.zeros((nx, ny, nz), dtype=np.bool_)
    steps = outwards(int(within / width))
    reached = 0
    while reached < len(steps) and np.sum(steps[reached] ** 2) * width * width <= within * within:
        reached += 1
    for a in range(nx):
        for b in range(ny):
            for c in range(nz):
                if nearest[a, b, c] >= room or nearest[a, b, c] < barred:
                    continue
                narrow = True
                for k in range(1, reached):
                    u, v, w = a + steps[k, 0], b + steps[k, 1], c + steps[k, 2]
                    if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz:
                        continue
                    if nearest[u, v, w] >= room:
                        narrow = False
                        break
                none[a, b, c] = narrow
    return none


@compiled
def add_ball(
    values: Floats3, at: Ints, reach: float, lowest: int, highest: int, added: float
) -> None:
    """Add to the cells about one, as far as some cells away, from a lowest layer to a highest one;
    and twice as far above and below them."""
    far = int(np.ceil(reach))
    for a in range(max(0, at[0] - far), min(values.shape[0], at[0] + far + 1)):
        for b in range(max(0, at[1] - far), min(values.shape[1], at[1] + far + 1)):
            for c in range(values.shape[2]):
                dx, dy = a - at[0], b - at[1]
                dz = 0.5 * max(0, lowest - c, c - highest)
                if dx * dx + dy * dy + dz * dz <= reach * reach:
                    values[a, b, c] += added
