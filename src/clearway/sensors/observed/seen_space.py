"""What was seen to be free, as compiled loops look it up: a bit for each voxel of a window.

Sixty-four voxels above each other share a word, so that what is looked at at one decision stays in
the processor's cache, and most columns of a box are told by one look.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, UInt64s3
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray

Voxels = npt.NDArray[np.uint64]
WORD = 64
"""Voxels in one."""
VoxelBox = tuple[int, int, int, int, int, int]
"""First and last voxel along each axis."""
NO_VOXELS: VoxelBox = (0, -1, 0, -1, 0, -1)
ONE, EVERY = np.uint64(1), np.uint64(0xFFFF_FFFF_FFFF_FFFF)


class SeenSpace(NamedTuple):
    """What was seen to be free, as compiled loops take it: as few arrays as can be."""

    free: Voxels
    """[columns, columns, rows / WORD] a bit each, 1 where seen to be free; a voxel of the world
    lies at its number modulo columns and rows, which are powers of two."""
    window: FloatArray
    """[14] number of the lowest voxel of the window along each axis, voxels per metre, middle and
    radius of a ball of the world that the mission declares free, and lowest and highest corner of
    the box in which a map is declared complete."""

    def __repr__(self) -> str:
        return brief(self)

    @property
    def voxel_m(self) -> float:
        return 1.0 / float(self.window[3])

    @property
    def complete_m(self) -> FloatArray:
        """[2, 3] corners of the box in which a map is declared complete; without one, infinite
        ones the wrong way round."""
        return self.window[8:14].reshape(2, 3)

    @property
    def low(self) -> IntArray:
        """[3] number of the lowest voxel along each axis."""
        return self.window[:3].astype(np.int64)


NO_BOX = np.array([[np.inf] * 3, [-np.inf] * 3])
"""Where no map is declared complete."""
NOTHING_SEEN = SeenSpace(
    np.zeros((1, 1, 1), dtype=np.uint64),
    np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], NO_BOX.ravel()]),
)
"""Where no range sensor looks."""


def pack_voxels(free: npt.ArrayLike) -> Voxels:
    """Bits of voxels [columns, columns, rows] that are marked or not; rows are whole words."""
    octets = np.packbits(np.asarray(free, dtype=np.bool_), axis=2, bitorder="little")
    return np.ascontiguousarray(octets).view("<u8").astype(np.uint64, copy=False)


@compiled
def is_free(free: UInt64s3, window: Floats, x: float, y: float, z: float, radius: float) -> bool:
    """Whether a ball in the world was seen to be free, by all voxels that its box meets.

    free, window: of a `SeenSpace`.
    """
    if is_declared(window, x, y, z, radius):
        return True
    return is_box_free(free, window, box_about(window, x, y, z, radius), NO_VOXELS)


@compiled
def is_place_free(free: UInt64s3, window: Floats, x: float, y: float, z: float) -> bool:
    """`is_free` of a ball without a radius, quickly."""
    per_m, columns, rows = window[3], free.shape[0], WORD * free.shape[2]
    a = int(np.floor(x * per_m))
    b = int(np.floor(y * per_m))
    c = int(np.floor(z * per_m))
    if (
        window[0] <= a < window[0] + columns
        and window[1] <= b < window[1] + columns
        and window[2] <= c < window[2] + rows
        and is_marked(free, a, b, c)
    ):
        return True
    dx, dy, dz = x - window[4], y - window[5], z - window[6]
    # A voxel that lies in the ball declared free reaches no farther than it.
    around = window[7] + 2.0 / per_m
    if window[8] > window[11] and dx * dx + dy * dy + dz * dz > around * around:
        return False
    return is_free(free, window, x, y, z, 0.0)


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
def is_box_free(free: UInt64s3, window: Floats, box: VoxelBox, known: VoxelBox) -> bool:
    """Whether all voxels of a box were seen to be free; those of another are known to be."""
    a0, a1, b0, b1, c0, c1 = box
    if a0 < window[0] or b0 < window[1] or c0 < window[2]:
        return False
    columns, rows = free.shape[0], WORD * free.shape[2]
    if a1 >= window[0] + columns or b1 >= window[1] + columns or c1 >= window[2] + rows:
        return False
    tall = known[4] <= c0 and c1 <= known[5]
    for a in range(a0, a1 + 1):
        for b in range(b0, b1 + 1):
            if tall and known[0] <= a <= known[1] and known[2] <= b <= known[3]:
                continue
            i, j = np.uint64(a & (columns - 1)), np.uint64(b & (columns - 1))
            c = c0
            while c <= c1:
                at = c & (rows - 1)
                count = min(c1 - c + 1, WORD - (at & (WORD - 1)))
                missing = bits_from(at, count) & ~free[i, j, np.uint64(at // WORD)]
                if missing != 0 and not _all_declared(window, a, b, c, at, count, missing):
                    return False
                c += count
    return True


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
        if (missing >> bit) & ONE and not _declared(window, a, b, c + n):
            return False
    return True


@compiled
def _declared(window: Floats, a: int, b: int, c: int) -> bool:
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
