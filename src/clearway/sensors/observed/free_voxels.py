"""Voxels in a window of the world, a bit for each.

Sixty-four voxels above each other share a word, so that what is looked at at one decision stays in
the processor's cache, and most columns of a box are decided by one look.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, UInt64s3
from clearway.base.compiled import compiled

Voxels = npt.NDArray[np.uint64]
WORD = 64
"""Voxels in one."""
VoxelBox = tuple[int, int, int, int, int, int]
"""First and last voxel along each axis."""
HALF_DIAGONAL = 0.5 * np.sqrt(3.0)
"""Of a voxel, in widths."""
ONE = np.uint64(1)
EVERY = np.uint64(0xFFFF_FFFF_FFFF_FFFF)


NO_VOXELS = np.zeros((1, 1, 1), dtype=np.uint64)
"""Where no voxel is known to be free."""
NO_BOX = np.array([[np.inf] * 3, [-np.inf] * 3])
"""Where no map is declared complete."""


def pack_voxels(free: npt.ArrayLike) -> Voxels:
    """Bits of voxels [columns, columns, rows] that are marked or not; rows are whole words."""
    octets = np.packbits(np.asarray(free, dtype=np.bool_), axis=2, bitorder="little")
    return np.ascontiguousarray(octets).view("<u8").astype(np.uint64, copy=False)


@compiled
def is_declared(window: Floats, x: float, y: float, z: float, radius: float) -> bool:
    """Whether a ball lies in the one that the mission declares free, or in the mapped box."""
    dx, dy, dz = x - window[4], y - window[5], z - window[6]
    inside = window[7] - radius
    if inside >= 0.0 and dx * dx + dy * dy + dz * dz <= inside * inside:
        return True
    return _in_box(window, x - radius, x + radius, y - radius, y + radius, z - radius, z + radius)


@compiled
def box_about(window: Floats, x: float, y: float, z: float, radius: float) -> VoxelBox:
    """Voxels that the box about a ball meets."""
    per_m = window[3]
    return (
        int(np.floor((x - radius) * per_m)),
        int(np.floor((x + radius) * per_m)),
        int(np.floor((y - radius) * per_m)),
        int(np.floor((y + radius) * per_m)),
        int(np.floor((z - radius) * per_m)),
        int(np.floor((z + radius) * per_m)),
    )


@compiled
def are_voxels_free(
    free: UInt64s3, window: Floats, x: float, y: float, z: float, radius: float
) -> bool:
    """Whether all voxels that a ball meets were seen to be free, or are declared to be."""
    per_m, columns, rows = window[3], free.shape[0], WORD * free.shape[2]
    u, v, w, reach = x * per_m, y * per_m, z * per_m, radius * per_m
    a0, a1 = int(np.floor(u - reach)), int(np.floor(u + reach))
    b0, b1 = int(np.floor(v - reach)), int(np.floor(v + reach))
    c0, c1 = int(np.floor(w - reach)), int(np.floor(w + reach))
    if a0 < window[0] or b0 < window[1] or c0 < window[2]:
        return False
    if a1 >= window[0] + columns or b1 >= window[1] + columns or c1 >= window[2] + rows:
        return False
    for a in range(a0, a1 + 1):
        along = max(max(a - u, u - (a + 1)), 0.0)
        for b in range(b0, b1 + 1):
            aside = max(max(b - v, v - (b + 1)), 0.0)
            left = reach * reach - along * along - aside * aside
            if left < 0.0:
                continue
            tall = np.sqrt(left)
            low, high = max(int(np.floor(w - tall)), c0), min(int(np.floor(w + tall)), c1)
            if not _is_column_free(free, window, a, b, low, high):
                return False
    return True


@compiled
def _is_column_free(free: UInt64s3, window: Floats, a: int, b: int, low: int, high: int) -> bool:
    """Whether voxels of the window above each other were seen to be free, or are declared to be."""
    columns, rows = free.shape[0], WORD * free.shape[2]
    i, j = np.uint64(a & (columns - 1)), np.uint64(b & (columns - 1))
    c = low
    while c <= high:
        at = c & (rows - 1)
        count = min(high - c + 1, WORD - (at & (WORD - 1)))
        missing = bits_from(at, count) & ~free[i, j, np.uint64(at // WORD)]
        if missing != 0 and not _all_declared(window, a, b, c, at, count, missing):
            return False
        c += count
    return True


@compiled
def is_voxel_marked(free: UInt64s3, window: Floats, a: int, b: int, c: int) -> bool:
    """Whether a voxel was seen to be free, or is declared to be; never beyond the window."""
    columns, rows = free.shape[0], WORD * free.shape[2]
    return (
        window[0] <= a < window[0] + columns
        and window[1] <= b < window[1] + columns
        and window[2] <= c < window[2] + rows
        and _is_column_free(free, window, a, b, c, c)
    )


@compiled
def is_marked(free: UInt64s3, a: int, b: int, c: int) -> bool:
    """Whether the bit of a voxel is set; of one in the window, whether it was seen to be free."""
    columns, at = free.shape[0], c & (WORD * free.shape[2] - 1)
    i, j = np.uint64(a & (columns - 1)), np.uint64(b & (columns - 1))
    return bool((free[i, j, np.uint64(at // WORD)] >> np.uint64(at & (WORD - 1))) & ONE)


@compiled
def bits_from(at: int, count: int) -> np.uint64:
    """The bits, in one word, of so many voxels from one on."""
    return np.uint64((EVERY >> np.uint64(WORD - count)) << np.uint64(at & (WORD - 1)))


@compiled
def _all_declared(
    window: Floats, a: int, b: int, c: int, at: int, count: int, missing: np.uint64
) -> bool:
    """Whether those of `count` voxels above each other that are missing are declared free."""
    for n in range(count):
        bit = np.uint64((at & (WORD - 1)) + n)
        if (missing >> bit) & ONE and not _is_declared(window, a, b, c + n):
            return False
    return True


@compiled
def _is_declared(window: Floats, a: int, b: int, c: int) -> bool:
    """Whether a voxel lies in the ball that the mission declares free, or in the mapped box."""
    width = 1.0 / window[3]
    x0, y0, z0 = a * width, b * width, c * width
    if _in_box(window, x0, x0 + width, y0, y0 + width, z0, z0 + width):
        return True
    if window[7] <= 0.0:
        return False
    x = max(abs(a * width - window[4]), abs((a + 1) * width - window[4]))
    y = max(abs(b * width - window[5]), abs((b + 1) * width - window[5]))
    z = max(abs(c * width - window[6]), abs((c + 1) * width - window[6]))
    return bool(x * x + y * y + z * z <= window[7] ** 2)


@compiled
def _in_box(
    window: Floats, x0: float, x1: float, y0: float, y1: float, z0: float, z1: float
) -> bool:
    """Whether a box lies in the one in which a map is declared complete."""
    return bool(
        window[8] <= x0
        and x1 <= window[11]
        and window[9] <= y0
        and y1 <= window[12]
        and window[10] <= z0
        and z1 <= window[13]
    )
