"""The compiled loops that keep up how far what is known stands from the middles of cells.

Points are reported by voxels, one point each, in a table of hashes. A point lowers the clearance
of the cells about it on all levels; where points vanish, cells are marked anew from those that
stay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints, Ints2
from clearway.base.compiled import compiled
from clearway.live.routing.field.route_levels import Levels

BITS = 21
"""Of a voxel's number along each axis."""
MASK = (1 << BITS) - 1
POINT_BITS = 17
"""Of a point's index, in the second number of the table."""
MOST_POINTS = 1 << POINT_BITS
"""Points that can be kept."""
GONE = -2
"""In place of the voxel of a point that vanished."""


class KnownPoints(NamedTuple):
    """Points that are known, one of each voxel."""

    voxel_m: float
    table: Ints2
    """[a power of two, 2] by the hash of a voxel: its number, -1 for none; and of its point, when
    it was reported last and its index, in one number: a look into memory less."""
    point: Floats2
    """[capacity, 4] world frame, and 1; -1 for one that vanished."""
    counts: Ints
    """[2] points kept, those that vanished included; and those that vanished."""


@compiled
def tell_points(
    known: KnownPoints,
    points: Floats2,
    telling: int,
) -> Ints:
    """Note points [n, 3], and return which are new; nothing is noted beyond the capacity."""
    fresh = [0]
    table, mask, last = known.table, len(known.table) - 1, -1
    per_metre = 1.0 / known.voxel_m
    for n in range(len(points)):
        a = int(np.floor(points[n, 0] * per_metre))
        b = int(np.floor(points[n, 1] * per_metre))
        c = int(np.floor(points[n, 2] * per_metre))
        key = ((a & MASK) << (2 * BITS)) | ((b & MASK) << BITS) | (c & MASK)
        if key == last:
            continue
        last = key
        slot = _slot(a, b, c, mask)
        while table[slot, 0] != -1 and table[slot, 0] != key:
            slot = (slot + 1) & mask
        at = table[slot, 1] & (MOST_POINTS - 1)
        if table[slot, 0] == -1:
            at = known.counts[0]
            if at >= len(known.point):
                continue
            known.counts[0] += 1
            table[slot, 0] = key
            for axis in range(3):
                known.point[at, axis] = points[n, axis]
            known.point[at, 3] = 1.0
            fresh.append(at)
        table[slot, 1] = (telling << POINT_BITS) | at
    return np.array(fresh)[1:]


@compiled
def _slot(a: int, b: int, c: int, mask: int) -> int:
    return ((a * 73856093) ^ (b * 19349663) ^ (c * 83492791)) & mask


@compiled
def find_vanished(known: KnownPoints, telling: int, vehicle: Floats, within_m: float) -> Ints:
    """Return the points within a distance of the vehicle [3] that were not reported, nor any
    beside them, and drop them: of the same surface, others are reported every time."""
    gone = [0]
    per_metre, mask = 1.0 / known.voxel_m, len(known.table) - 1
    for at in range(known.counts[0]):
        x, y, z = known.point[at, 0], known.point[at, 1], known.point[at, 2]
        dx, dy, dz = x - vehicle[0], y - vehicle[1], z - vehicle[2]
        is_near = dx * dx + dy * dy + dz * dz <= within_m * within_m
        if not is_near or known.point[at, 3] < 0.0:
            continue
        a, b = int(np.floor(x * per_metre)), int(np.floor(y * per_metre))
        c = int(np.floor(z * per_metre))
        key = ((a & MASK) << (2 * BITS)) | ((b & MASK) << BITS) | (c & MASK)
        slot = _slot(a, b, c, mask)
        while known.table[slot, 0] != key and known.table[slot, 0] != -1:
            slot = (slot + 1) & mask
        if known.table[slot, 0] == -1 or known.table[slot, 1] >> POINT_BITS == telling:
            continue
        if not _is_told_beside(known, telling, a, b, c):
            # Its place in the table stays taken: others may have been put behind it.
            known.table[slot, 0] = GONE
            known.point[at, 3] = -1.0
            known.counts[1] += 1
            gone.append(at)
    return np.array(gone)[1:]


@compiled
def _is_told_beside(known: KnownPoints, telling: int, a: int, b: int, c: int) -> bool:
    """Whether a point of a voxel that touches one was reported."""
    table, mask = known.table, len(known.table) - 1
    for u in range(a - 1, a + 2):
        for v in range(b - 1, b + 2):
            for w in range(c - 1, c + 2):
                key = ((u & MASK) << (2 * BITS)) | ((v & MASK) << BITS) | (w & MASK)
                slot = _slot(u, v, w, mask)
                while table[slot, 0] != -1 and table[slot, 0] != key:
                    slot = (slot + 1) & mask
                if table[slot, 0] == key and table[slot, 1] >> POINT_BITS == telling:
                    return True
    return False


@compiled
def keep_within(known: KnownPoints, low: Floats, high: Floats) -> None:
    """Forget points that vanished and those outside of a box, and lay out the rest anew."""
    mask, per_metre = len(known.table) - 1, 1.0 / known.voxel_m
    told = np.zeros(known.counts[0], dtype=np.int64)
    for slot in range(len(known.table)):
        if known.table[slot, 0] >= 0:
            told[known.table[slot, 1] & (MOST_POINTS - 1)] = known.table[slot, 1]
    known.table[:, 0] = -1
    kept = 0
    for at in range(known.counts[0]):
        x, y, z = known.point[at, 0], known.point[at, 1], known.point[at, 2]
        if known.point[at, 3] < 0.0 or x < low[0] or y < low[1] or x > high[0] or y > high[1]:
            continue
        for axis in range(4):
            known.point[kept, axis] = known.point[at, axis]
        a = int(np.floor(x * per_metre))
        b = int(np.floor(y * per_metre))
        c = int(np.floor(z * per_metre))
        slot = _slot(a, b, c, mask)
        while known.table[slot, 0] != -1:
            slot = (slot + 1) & mask
        known.table[slot, 0] = ((a & MASK) << (2 * BITS)) | ((b & MASK) << BITS) | (c & MASK)
        known.table[slot, 1] = (told[at] >> POINT_BITS << POINT_BITS) | kept
        kept += 1
    known.counts[0], known.counts[1] = kept, 0


@compiled
def mark_points(
    levels: Levels, clearance_m: Floats, reach_m: Floats, known: KnownPoints, which: Ints
) -> None:
    """Lower the clearance [cells] about points by their numbers, as far as `reach_m` [levels]."""
    for level in range(levels.depth):
        for n in range(len(which)):
            if known.point[which[n], 3] >= 0.0:
                _mark(
                    levels, clearance_m, reach_m[level], known.point, which[n], level,
                    0, 0, levels.n, levels.n,
                )  # fmt: skip


@compiled
def mark_box(
    levels: Levels,
    clearance_m: Floats,
    reach_m: float,
    known: KnownPoints,
    level: int,
    a: int,
    b: int,
    far_a: int,
    far_b: int,
) -> None:
    """Lower the clearance of the cells [a, far_a) x [b, far_b) of a level by all points."""
    width = levels.width_m * (1 << level)
    low_x, low_y = levels.low[level, 0] * width, levels.low[level, 1] * width
    for at in range(known.counts[0]):
        x, y = known.point[at, 0] - low_x, known.point[at, 1] - low_y
        if known.point[at, 3] < 0.0 or x < a * width - reach_m or x > far_a * width + reach_m:
            continue
        if y >= b * width - reach_m and y <= far_b * width + reach_m:
            _mark(levels, clearance_m, reach_m, known.point, at, level, a, b, far_a, far_b)


@compiled
def _mark(
    levels: Levels,
    clearance_m: Floats,
    reach_m: float,
    point: Floats2,
    at: int,
    level: int,
    low_a: int,
    low_b: int,
    far_a: int,
    far_b: int,
) -> None:
    width, n, layers = levels.width_m * (1 << level), levels.n, levels.layers
    reach = reach_m
    x = point[at, 0] / width - levels.low[level, 0] - 0.5
    y = point[at, 1] / width - levels.low[level, 1] - 0.5
    cells = reach / width
    first, last = max(int(np.ceil(x - cells)), low_a), min(int(np.floor(x + cells)), far_a - 1)
    first_b, last_b = max(int(np.ceil(y - cells)), low_b), min(int(np.floor(y + cells)), far_b - 1)
    bottom, top = 0, layers - 1
    above = point[at, 2] - levels.lowest_m
    if layers > 1:
        bottom = max(int(np.ceil((above - reach) / levels.layer_m)), 0)
        top = min(int(np.floor((above + reach) / levels.layer_m)), layers - 1)
    elif abs(above) >= reach:
        return
    for i in range(first, last + 1):
        dx2 = ((i - x) * width) ** 2
        for j in range(first_b, last_b + 1):
            level2 = dx2 + ((j - y) * width) ** 2
            if level2 >= reach * reach:
                continue
            cell = ((level * n + i) * n + j) * layers
            for k in range(bottom, top + 1):
                dz = k * levels.layer_m - above
                d2 = level2 + dz * dz
                most = clearance_m[cell + k]
                if most > 0.0 and d2 < most * most:
                    clearance_m[cell + k] = np.sqrt(d2)


@compiled
def unmark_points(
    levels: Levels,
    clearance_m: Floats,
    base_m: Floats,
    reach_m: Floats,
    known: KnownPoints,
    gone: Ints,
) -> None:
    """Mark the cells about points that vanished anew, from those that are left.

    base_m: clearance [cells] without any points.
    """
    n, layers = levels.n, levels.layers
    for level in range(levels.depth):
        width = levels.width_m * (1 << level)
        far = int(np.ceil(reach_m[level] / width)) + 1
        dirty = np.zeros((n, n), dtype=np.bool_)
        about = np.zeros((n, n), dtype=np.bool_)
        low_a, low_b, far_a, far_b = n, n, 0, 0
        for m in range(len(gone)):
            i = int(np.floor(known.point[gone[m], 0] / width)) - levels.low[level, 0]
            j = int(np.floor(known.point[gone[m], 1] / width)) - levels.low[level, 1]
            for u in range(max(i - 2 * far, 0), min(i + 2 * far + 1, n)):
                for v in range(max(j - 2 * far, 0), min(j + 2 * far + 1, n)):
                    about[u, v] = True
                    if abs(u - i) <= far and abs(v - j) <= far:
                        dirty[u, v] = True
                        low_a, low_b = min(low_a, u), min(low_b, v)
                        far_a, far_b = max(far_a, u + 1), max(far_b, v + 1)
        if far_a <= low_a:
            continue
        for i in range(low_a, far_a):
            for j in range(low_b, far_b):
                if dirty[i, j]:
                    cell = ((level * n + i) * n + j) * layers
                    for k in range(layers):
                        clearance_m[cell + k] = base_m[cell + k]
        beside = (far + 1) * width
        west = (levels.low[level, 0] + low_a) * width - beside
        south = (levels.low[level, 1] + low_b) * width - beside
        east = (levels.low[level, 0] + far_a) * width + beside
        north = (levels.low[level, 1] + far_b) * width + beside
        for at in range(known.counts[0]):
            x, y = known.point[at, 0], known.point[at, 1]
            if x < west or x > east or y < south or y > north or known.point[at, 3] < 0.0:
                continue
            i = int(np.floor(x / width)) - levels.low[level, 0]
            j = int(np.floor(y / width)) - levels.low[level, 1]
            # Beyond a side of the level a point may still come near.
            inside = 0 <= i < n and 0 <= j < n
            u, v = min(max(i, 0), n - 1), min(max(j, 0), n - 1)
            if about[u, v] and (inside or max(abs(u - i), abs(v - j)) <= far):
                _mark(
                    levels, clearance_m, reach_m[level], known.point, at, level,
                    low_a, low_b, far_a, far_b,
                )  # fmt: skip
