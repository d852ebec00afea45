"""Marking what a range view shows: voxels in which something may be free."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Ints, UInt64s3
from clearway.base.compiled import compiled
from clearway.sensors.observed.free_voxels import EVERY, HALF_DIAGONAL, ONE, WORD, bits_from
from clearway.sensors.observed.range_views import RangeViews, goes_by, may_show

COLUMNS, ROWS = 256, 128
"""Voxels of the window along each horizontal axis, and along the vertical: powers of two."""
ROLL_WITHIN = 8
"""The window follows once the vehicle is off its middle by this part of its width."""
WITHIN = 0.5 - 1.0 / ROLL_WITHIN
"""Part of the window's width that is always there on either side of the vehicle."""
SIDE = 4
"""Voxels along each side of a block: one that is marked, or out of sight, is passed over as one."""


@compiled
def mark(
    free: UInt64s3, low: Ints, voxel: float, reach: float, views: RangeViews, slot: int
) -> None:
    """Mark the voxels past whose middle a beam of a view goes; others were seen before."""
    pose, block = views.pose[slot], SIDE * voxel
    around = HALF_DIAGONAL * block
    first_a, last_a = _blocks_along(pose[9], reach, block)
    first_b, last_b = _blocks_along(pose[10], reach, block)
    first_c, last_c = _blocks_along(pose[11], min(reach, WITHIN * ROWS * voxel), block)
    # A sensor off the vehicle's middle sees beyond the window: a bit there is one at its other end.
    first_a, last_a = max(first_a, -(-low[0] // SIDE)), min(last_a, (low[0] + COLUMNS) // SIDE - 1)
    first_b, last_b = max(first_b, -(-low[1] // SIDE)), min(last_b, (low[1] + COLUMNS) // SIDE - 1)
    first_c, last_c = max(first_c, -(-low[2] // SIDE)), min(last_c, (low[2] + ROWS) // SIDE - 1)
    for a in range(first_a, last_a + 1):
        x = (a + 0.5) * block
        for b in range(first_b, last_b + 1):
            y = (b + 0.5) * block
            if np.sqrt((x - pose[9]) ** 2 + (y - pose[10]) ** 2) - around > reach:
                continue
            for c in range(first_c, last_c + 1):
                z = (c + 0.5) * block
                if not _is_block_marked(free, a, b, c) and may_show(views, slot, x, y, z, around):
                    _mark_voxels_of(free, voxel, (a, b, c), views, slot)


@compiled
def _blocks_along(origin: float, far: float, block: float) -> tuple[int, int]:
    """First and last block within a distance along an axis."""
    return int(np.floor((origin - far) / block)), int(np.floor((origin + far) / block))


@compiled
def _is_block_marked(free: UInt64s3, a: int, b: int, c: int) -> bool:
    at = (SIDE * c) & (ROWS - 1)
    word, bits, every = np.uint64(at // WORD), bits_from(at, SIDE), EVERY
    for i in range(SIDE * a, SIDE * a + SIDE):
        for j in range(SIDE * b, SIDE * b + SIDE):
            every &= free[np.uint64(i & (COLUMNS - 1)), np.uint64(j & (COLUMNS - 1)), word]
    return bool((every & bits) == bits)


@compiled
def _mark_voxels_of(
    free: UInt64s3, voxel: float, block: tuple[int, int, int], views: RangeViews, slot: int
) -> None:
    """Mark those of a block past whose middle a beam goes."""
    c0 = SIDE * block[2]
    at = c0 & (ROWS - 1)
    word = np.uint64(at // WORD)
    for a in range(SIDE * block[0], SIDE * block[0] + SIDE):
        for b in range(SIDE * block[1], SIDE * block[1] + SIDE):
            i, j = np.uint64(a & (COLUMNS - 1)), np.uint64(b & (COLUMNS - 1))
            marked = free[i, j, word]
            for n in range(SIDE):
                bit = ONE << np.uint64((at & (WORD - 1)) + n)
                x, y, z = (a + 0.5) * voxel, (b + 0.5) * voxel, (c0 + n + 0.5) * voxel
                if marked & bit == 0 and goes_by(views, slot, x, y, z):
                    marked |= bit
            free[i, j, word] = marked
