"""What is filled in along a wire: boxes in the voxels between returns that lie on a line."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2, Ints, Ints2
from clearway.base.compiled import compiled
from clearway.sensors.memory.remembered import BETWEEN, Boxes, box_key, empty_boxes, first_boxes
from clearway.sensors.voxels import slot_of, table_bits

TAKEN = -2
"""In place of the number of a box to come: there is one in its voxel already."""


class Table(NamedTuple):
    """Where the box of a voxel is."""

    keys: Ints
    """Of a power of two slots; -1 marks empty ones."""
    numbers: Ints
    shift: int


@compiled
def fill_between(
    boxes: Boxes, middles: Floats2, pairs: Ints2, voxel: float, time_s: float
) -> Boxes:
    """The boxes, then one per voxel that none is in between the middles of pairs."""
    known, steps = len(boxes.doubt), 0
    for p in range(len(pairs)):
        apart = np.sqrt(np.sum((middles[pairs[p, 0]] - middles[pairs[p, 1]]) ** 2))
        steps += int(np.ceil(apart / voxel))
    places, keys = np.empty((steps, 3)), np.empty(steps, dtype=np.int64)
    total = _lay_between(middles, pairs, voxel, places, keys)
    bits = table_bits(total)
    table = Table(
        np.full(1 << bits, -1, dtype=np.int64), np.full(1 << bits, -1, dtype=np.int64), 64 - bits
    )
    _note_taken(boxes, middles, voxel, places[:total], keys, table)
    every = empty_boxes(known + total)
    _copy_all(boxes, every)
    return first_boxes(
        every, _put_between(places[:total], keys, known, voxel, time_s, table, every)
    )


@compiled
def _lay_between(middles: Floats2, pairs: Ints2, voxel: float, places: Floats2, keys: Ints) -> int:
    """Fill in places between the middles of pairs, no more than a voxel apart, and their voxels;
    how many there are."""
    total = 0
    for p in range(len(pairs)):
        one, other = pairs[p, 0], pairs[p, 1]
        ax, ay = middles[one, 0] - middles[other, 0], middles[one, 1] - middles[other, 1]
        if ax > 0.0 or (ax == 0.0 and ay > 0.0):  # The same way round from either end.
            one, other = other, one
        squared = 0.0
        for axis in range(3):
            squared += (middles[one, axis] - middles[other, axis]) ** 2
        pieces = int(np.ceil(np.sqrt(squared) / voxel))
        for piece in range(1, pieces):
            for axis in range(3):
                start, end = middles[one, axis], middles[other, axis]
                places[total, axis] = start + (end - start) * (piece / pieces)
            x, y, z = places[total, 0], places[total, 1], places[total, 2]
            keys[total] = box_key(x, y, z, 0, voxel)
            total += 1
    return total


@compiled
def _note_taken(
    boxes: Boxes,
    middles: Floats2,
    voxel: float,
    places: Floats2,
    keys: Ints,
    table: Table,
) -> None:
    """Enter the voxels of places into a table, as TAKEN where a box is there already."""
    low_x, low_y, low_z = np.inf, np.inf, np.inf
    high_x, high_y, high_z = -np.inf, -np.inf, -np.inf
    for n in range(len(places)):
        table.keys[slot_of(keys[n], table.keys, table.shift)] = keys[n]
        low_x, high_x = min(low_x, places[n, 0] - voxel), max(high_x, places[n, 0] + voxel)
        low_y, high_y = min(low_y, places[n, 1] - voxel), max(high_y, places[n, 1] + voxel)
        low_z, high_z = min(low_z, places[n, 2] - voxel), max(high_z, places[n, 2] + voxel)
    for n in range(len(boxes.level)):
        x, y, z = middles[n, 0], middles[n, 1], middles[n, 2]
        near = low_x <= x <= high_x and low_y <= y <= high_y and low_z <= z <= high_z
        if near and boxes.level[n] == 0:
            key = box_key(x, y, z, 0, voxel)
            slot = slot_of(key, table.keys, table.shift)
            if table.keys[slot] == key:
                table.numbers[slot] = TAKEN


@compiled
def _copy_all(boxes: Boxes, every: Boxes) -> None:
    """Fill in the first boxes, column by column."""
    for n in range(len(boxes.doubt)):
        for axis in range(3):
            every.low_m[n, axis] = boxes.low_m[n, axis]
    for n in range(len(boxes.doubt)):
        for axis in range(3):
            every.high_m[n, axis] = boxes.high_m[n, axis]
    for n in range(len(boxes.doubt)):
        every.spacing_m[n], every.last_seen_s[n] = boxes.spacing_m[n], boxes.last_seen_s[n]
    for n in range(len(boxes.doubt)):
        every.size_m[n], every.doubt[n] = boxes.size_m[n], boxes.doubt[n]
    for n in range(len(boxes.doubt)):
        every.sweeps[n], every.kind[n] = boxes.sweeps[n], boxes.kind[n]
    for n in range(len(boxes.doubt)):
        every.level[n] = boxes.level[n]


@compiled
def _put_between(
    places: Floats2,
    keys: Ints,
    known: int,
    voxel: float,
    time_s: float,
    table: Table,
    every: Boxes,
) -> int:
    """Add a box for each voxel of places that is not taken; how many boxes there are then."""
    count = known
    for n in range(len(places)):
        slot = slot_of(keys[n], table.keys, table.shift)
        if table.numbers[slot] == TAKEN:
            continue
        if table.numbers[slot] < 0:
            table.numbers[slot] = count
            for axis in range(3):
                every.low_m[count, axis] = every.high_m[count, axis] = places[n, axis]
            every.spacing_m[count], every.last_seen_s[count] = 0.5 * voxel, time_s
            every.size_m[count], every.doubt[count] = 0.0, 0.0
            every.sweeps[count], every.kind[count], every.level[count] = 0, BETWEEN, 0
            count += 1
        m = table.numbers[slot]
        for axis in range(3):
            every.low_m[m, axis] = min(every.low_m[m, axis], places[n, axis])
            every.high_m[m, axis] = max(every.high_m[m, axis], places[n, axis])
    return count
