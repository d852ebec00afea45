"""Points into voxels by a hash table, for thinning and for memory."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled


@compiled
def voxel_key(x: float, y: float, z: float, per_voxel: float) -> int:
    """One integer for the voxel of a point; repeats only after two million voxels an axis."""
    i = int(np.floor(x * per_voxel)) & 0x1FFFFF
    j = int(np.floor(y * per_voxel)) & 0x1FFFFF
    k = int(np.floor(z * per_voxel)) & 0x1FFFFF
    return (i << 42) | (j << 21) | k


@compiled
def first_slot(key: int, shift: int) -> np.uint64:
    """Where a key is looked for first, in a hash table of two to the power of 64 - shift slots."""
    return np.uint64(np.uint64(key) * np.uint64(0x9E3779B97F4A7C15) >> np.uint64(shift))


@compiled
def slot_of(key: int, keys: Ints, shift: int) -> int:
    """Where a key is, or goes, in a hash table of a power of two slots; -1 marks empty ones."""
    mask, slot = np.uint64(len(keys) - 1), first_slot(key, shift)
    while keys[slot] != -1 and keys[slot] != key:
        slot = (slot + np.uint64(1)) & mask
    return int(slot)


@compiled
def table_bits(count: int) -> int:
    """Bits of a hash table that stays at most half full with `count` keys."""
    bits = 4
    while (1 << bits) < 2 * count:
        bits += 1
    return bits


@compiled
def number_voxels(points: Floats2, voxel: float) -> tuple[Ints, int]:
    """[m] number of the voxel of each point, in order of appearance, and how many there are."""
    bits = table_bits(len(points))
    keys = np.full(1 << bits, -1, dtype=np.int64)
    numbers = np.empty(1 << bits, dtype=np.int64)
    voxel_of = np.empty(len(points), dtype=np.int64)
    per_voxel, shift = 1.0 / voxel, 64 - bits
    count, last_key, number = 0, -1, 0
    for n in range(len(points)):
        key = voxel_key(points[n, 0], points[n, 1], points[n, 2], per_voxel)
        if key != last_key:  # neighbours in a scan mostly share their voxel
            slot = slot_of(key, keys, shift)
            if keys[slot] == -1:
                keys[slot] = key
                numbers[slot] = count
                count += 1
            last_key, number = key, int(numbers[slot])
        voxel_of[n] = number
    return voxel_of, count


@compiled
def merge_balls(
    points: Floats2, radii: Floats, voxel_of: Ints, voxels: int
) -> tuple[Floats2, Floats]:
    """Mean position and covering radius of the balls of each voxel: [voxels, 3], [voxels]."""
    means, members, covering = np.zeros((voxels, 3)), np.zeros(voxels), np.zeros(voxels)
    for n in range(len(points)):
        v = voxel_of[n]
        members[v] += 1.0
        means[v, 0] += points[n, 0]
        means[v, 1] += points[n, 1]
        means[v, 2] += points[n, 2]
    for v in range(voxels):
        means[v, 0] /= members[v]
        means[v, 1] /= members[v]
        means[v, 2] /= members[v]
    for n in range(len(points)):
        v = voxel_of[n]
        x, y, z = points[n, 0] - means[v, 0], points[n, 1] - means[v, 1], points[n, 2] - means[v, 2]
        # A voxel's only point stays where it was, whatever the rounding of the mean.
        moved = np.sqrt(x * x + y * y + z * z) if members[v] > 1.0 else 0.0
        covering[v] = max(covering[v], moved + radii[n])
    return means, covering
