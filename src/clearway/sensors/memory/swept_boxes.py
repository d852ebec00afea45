"""The returns of a sweep in boxes, one per voxel, and which of them an old box is of the same voxel
as.

First every return gets the number of its box, then boxes grow around their returns: the table of
numbers fits into the fast caches as long as nothing else is asked for between.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Int32s, Ints
from clearway.base.compiled import compiled
from clearway.sensors.memory.remembered import (
    LEVEL_SHIFT,
    LONE,
    Boxes,
    Pitch,
    box_key,
    empty_boxes,
    key_of,
    level_at,
)
from clearway.sensors.voxels import first_slot

SMALLEST_TABLE = 12
GROWTH = 2
"""Bits of the table of voxels that a sweep begins with, and those that it grows by: while it is
small it stays in the fastest cache."""
MOST_FULL = 4
"""Slots for each number at least: nearly all are found where they are first looked for."""

NumberArray = npt.NDArray[np.int32]


class VoxelNumbers(NamedTuple):
    """Where the box of a voxel is."""

    slots: Int32s
    """Of a power of two: numbers of boxes; -1 marks empty ones."""
    keys: Ints
    """[boxes] the voxel of each."""
    shift: int


@compiled
def boxes_of_returns(
    points: Floats2,
    radii: Floats,
    sizes: Floats,
    origin: Floats,
    pitch: Pitch,
    time_s: float,
) -> Boxes:
    """One box per voxel of the returns [m, 3] of one sweep.

    radii: [m] half the beam spacing. sizes: [m] how thick the thing is at least, 0 where unknown.
    """
    return number_boxes(points, radii, sizes, origin, pitch, time_s)[0]


@compiled
def number_boxes(
    points: Floats2,
    radii: Floats,
    sizes: Floats,
    origin: Floats,
    pitch: Pitch,
    time_s: float,
) -> tuple[Boxes, VoxelNumbers]:
    """`boxes_of_returns`, and which voxel is whose."""
    keys, numbers = np.empty(len(points), dtype=np.int64), np.empty(len(points), dtype=np.int32)
    _keys_of(points, origin, pitch, keys)
    table = _number_in_order(keys, numbers)
    boxes = empty_boxes(len(table.keys))
    boxes.low_m[:], boxes.high_m[:] = np.inf, -np.inf
    boxes.spacing_m[:], boxes.size_m[:] = 0.0, 0.0
    _grow(points, radii, sizes, numbers, boxes)
    boxes.last_seen_s[:] = time_s
    boxes.doubt[:] = 0.0
    boxes.sweeps[:] = 1
    boxes.kind[:] = LONE
    boxes.level[:] = table.keys >> LEVEL_SHIFT
    return boxes, table


@compiled
def _keys_of(points: Floats2, origin: Floats, pitch: Pitch, keys: Ints) -> None:
    """Fill in the voxel of each return; without a branch the compiler takes several at a time."""
    voxel, fine, flat = pitch.voxel_m, pitch.fine_m, points.reshape(points.size)
    if not fine < np.inf:
        for n in range(len(keys)):
            keys[n] = box_key(flat[3 * n], flat[3 * n + 1], flat[3 * n + 2], 0, voxel)
        return
    ox, oy, oz = origin[0], origin[1], origin[2]
    for n in range(len(keys)):
        x, y, z = flat[3 * n], flat[3 * n + 1], flat[3 * n + 2]
        away = np.sqrt((x - ox) ** 2 + (y - oy) ** 2 + (z - oz) ** 2)
        keys[n] = box_key(x, y, z, level_at(away, fine), voxel)


@compiled
def _number_in_order(keys: Ints, numbers: Int32s) -> VoxelNumbers:
    """The table of voxels in the order in which they first come; numbers: [m] filled in."""
    own = np.empty(len(keys), dtype=np.int64)
    bits, begin, count = SMALLEST_TABLE, 0, 0
    while True:
        table = VoxelNumbers(np.full(1 << bits, -1, dtype=np.int32), own, 64 - bits)
        _enter(count, table)
        begin, count = _number(keys, begin, count, table, numbers)
        if begin == len(keys):
            return VoxelNumbers(table.slots, own[:count], table.shift)
        bits += GROWTH


@compiled
def _enter(count: int, table: VoxelNumbers) -> None:
    """Enter so many boxes, no two of a voxel, into an empty table."""
    for n in range(count):
        table.slots[_slot_of(table.keys[n], table)] = n


@compiled
def _slot_of(key: int, table: VoxelNumbers) -> int:
    """Where the number of a voxel's box is, or goes."""
    slots, keys = table.slots, table.keys
    mask, slot = np.uint64(len(slots) - 1), first_slot(key, table.shift)
    while slots[slot] >= 0 and keys[np.uint64(slots[slot])] != key:
        slot = (slot + np.uint64(1)) & mask
    return int(slot)


@compiled
def _number(
    keys: Ints, begin: int, count: int, table: VoxelNumbers, numbers: Int32s
) -> tuple[int, int]:
    """Fill in the numbers of the boxes of voxels from `begin` on, up to where the table is full:
    where that is, and how many boxes there are then."""
    slots, own, most = table.slots, table.keys, len(table.slots) // MOST_FULL
    for n in range(begin, len(keys)):
        slot = np.uint64(_slot_of(keys[n], table))
        number = slots[slot]
        if number < 0:
            if count == most:
                return n, count
            number = np.int32(count)
            slots[slot], own[count] = number, keys[n]
            count += 1
        numbers[n] = number
    return len(keys), count


@compiled
def _grow(points: Floats2, radii: Floats, sizes: Floats, numbers: Int32s, boxes: Boxes) -> None:
    """Let each box hold its returns."""
    low, high, spacing, size = boxes.low_m, boxes.high_m, boxes.spacing_m, boxes.size_m
    for n in range(len(numbers)):
        at = np.uint64(numbers[n])
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        low[at, 0], high[at, 0] = min(low[at, 0], x), max(high[at, 0], x)
        low[at, 1], high[at, 1] = min(low[at, 1], y), max(high[at, 1], y)
        low[at, 2], high[at, 2] = min(low[at, 2], z), max(high[at, 2], z)
        spacing[at] = max(spacing[at], radii[n])
        size[at] = max(size[at], sizes[n])


@compiled
def match_boxes_seen(old: Boxes, seen: Boxes, voxel: float) -> Ints:
    """[old] number of the box seen now in the same voxel; -1 without any."""
    count = len(seen.doubt)
    keys, bits = np.empty(count, dtype=np.int64), SMALLEST_TABLE
    _keys_of_boxes(seen, voxel, keys)
    while (1 << bits) < MOST_FULL * count:
        bits += GROWTH
    table = VoxelNumbers(np.full(1 << bits, -1, dtype=np.int32), keys, 64 - bits)
    _enter(count, table)
    return match_numbered_boxes(old, table, voxel)


@compiled
def match_numbered_boxes(old: Boxes, table: VoxelNumbers, voxel: float) -> Ints:
    """`match_boxes_seen` of boxes whose voxels are in a table."""
    again = np.full(len(old.doubt), -1, dtype=np.int64)
    if len(table.keys) > 0:
        _keys_of_boxes(old, voxel, again)
        _look_up(table, again)
    return again


@compiled
def _keys_of_boxes(boxes: Boxes, voxel: float, keys: Ints) -> None:
    for n in range(len(keys)):
        keys[n] = key_of(boxes, n, voxel)


@compiled
def _look_up(table: VoxelNumbers, keys: Ints) -> None:
    """Write over voxels the numbers of their boxes; -1 where there is none."""
    for n in range(len(keys)):
        keys[n] = table.slots[_slot_of(keys[n], table)]
