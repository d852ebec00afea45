"""Returns in a line are a wire: what lies between neighbours of them is remembered too.

A thing thinner than the beams lie apart is hit here and there along it. A return belongs to a line
if many of those around it lie on one straight line through it; foliage and rain lie about instead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.sensors.remembered import (
    BETWEEN,
    IN_LINE,
    Boxes,
    box_key,
    copy_box,
    empty_boxes,
    first_boxes,
    key_of,
)
from clearway.sensors.voxels import slot_of, table_bits

GAP = 20.0
"""Voxels that neighbours on a wire may be apart."""
CLOSE = 1.0 / 3.0
"""Share of the gap within which neighbours count where there are many."""
MOST_NEIGHBOURS = 96
"""With more, not even so near by, it is no wire."""
MOST_DIRECTIONS = 12
"""Neighbours through which a line is tried."""
ON_LINE = 3
"""Other returns that must lie on it,"""
SHARE_ON_LINE = 0.4
"""and their share of all around."""
SLENDER = 4.0
"""Length of the line, in deviations that are allowed from it."""
EVEN = 1.5
"""Distance to the next return on a line, in those that they are apart on average: what lies off the
end of a wire, in line with it by chance, is none of it."""
MOST_TESTED = 400
"""Boxes of a sweep that are looked at, evenly picked by their voxels."""


class WireLine(NamedTuple):
    """Neighbours of a box along a line."""

    found: bool
    ahead: int
    """Number of the next one along it, -1 without any."""
    behind: int


@compiled
def join_lines(
    boxes: Boxes, first_new: int, voxel: float, deviation: float, time_s: float
) -> Boxes:
    """The boxes with those in a line marked, and the gaps of the line filled in at the end.

    first_new: from there on they were seen by the latest sweep. deviation: by which a return may
    lie off a line.
    """
    thin = np.empty(len(boxes.doubt), dtype=np.bool_)
    untold = 0
    for n in range(len(thin)):
        thin[n] = boxes.size_m[n] == 0.0 and boxes.level[n] == 0 and boxes.kind[n] != BETWEEN
        untold += n >= first_new and thin[n] and boxes.kind[n] != IN_LINE
    if untold == 0:
        return boxes
    gap = GAP * voxel
    middles = 0.5 * (boxes.low_m + boxes.high_m)
    order, start, keys, shift = _by_cell(middles, thin, gap)
    one_in = 1 + untold // MOST_TESTED
    near, off = np.empty(MOST_NEIGHBOURS, dtype=np.int64), np.empty(MOST_NEIGHBOURS)
    pairs = np.empty((2 * len(thin), 2), dtype=np.int64)
    count = 0
    lined = boxes.kind.copy()
    for n in range(first_new, len(thin)):
        if not thin[n] or boxes.kind[n] == IN_LINE:
            continue
        if one_in > 1 and key_of(boxes, n, voxel) * 0x9E3779B1 % one_in != 0:
            continue
        line = _line_through(middles, n, order, start, keys, shift, gap, deviation, near, off)
        if not line.found:
            continue
        lined[n] = IN_LINE
        for other in (line.ahead, line.behind):
            if other >= 0:
                pairs[count, 0], pairs[count, 1] = n, other
                count += 1
    boxes.kind[:] = lined
    return _filled(boxes, middles, pairs[:count], voxel, time_s) if count else boxes


@compiled
def _by_cell(
    middles: FloatArray, thin: BoolArray, gap: float
) -> tuple[IntArray, IntArray, IntArray, int]:
    """Thin boxes sorted by cubes of a gap: their numbers, where a slot's begin, the slots' keys."""
    total = 0
    for n in range(len(thin)):
        total += thin[n]
    bits = table_bits(total)
    shift = 64 - bits
    keys = np.full(1 << bits, -1, dtype=np.int64)
    start = np.zeros((1 << bits) + 1, dtype=np.int64)
    for n in range(len(thin)):
        if thin[n]:
            key = box_key(middles[n, 0], middles[n, 1], middles[n, 2], 0, gap)
            slot = slot_of(key, keys, shift)
            keys[slot] = key
            start[slot + 1] += 1
    for slot in range(1 << bits):
        start[slot + 1] += start[slot]
    filled = start[:-1].copy()
    order = np.empty(total, dtype=np.int64)
    for n in range(len(thin)):
        if thin[n]:
            key = box_key(middles[n, 0], middles[n, 1], middles[n, 2], 0, gap)
            slot = slot_of(key, keys, shift)
            order[filled[slot]] = n
            filled[slot] += 1
    return order, start, keys, shift


@borrowing
def _neighbours(
    middles: FloatArray,
    n: int,
    order: IntArray,
    start: IntArray,
    keys: IntArray,
    shift: int,
    gap: float,
    within: float,
    near: IntArray,
) -> int:
    """How many thin boxes lie within a distance of box n, written into `near`; -1 if too many."""
    count = 0
    for i in range(-1, 2):
        for j in range(-1, 2):
            for k in range(-1, 2):
                key = box_key(
                    middles[n, 0] + i * gap,
                    middles[n, 1] + j * gap,
                    middles[n, 2] + k * gap,
                    0,
                    gap,
                )
                slot = slot_of(key, keys, shift)
                if keys[slot] != key:
                    continue
                for at in range(start[slot], start[slot + 1]):
                    m = order[at]
                    dx = middles[m, 0] - middles[n, 0]
                    dy = middles[m, 1] - middles[n, 1]
                    dz = middles[m, 2] - middles[n, 2]
                    if m != n and dx * dx + dy * dy + dz * dz <= within * within:
                        if count == len(near):
                            return -1
                        near[count] = m
                        count += 1
    return count


@compiled
def _line_through(
    middles: FloatArray,
    n: int,
    order: IntArray,
    start: IntArray,
    keys: IntArray,
    shift: int,
    gap: float,
    deviation: float,
    near: IntArray,
    off: FloatArray,
) -> WireLine:
    """The line through a box on which most of those around it lie."""
    count = _neighbours(middles, n, order, start, keys, shift, gap, gap, near)
    if count < 0:
        count = _neighbours(middles, n, order, start, keys, shift, gap, CLOSE * gap, near)
    if count < ON_LINE:
        return WireLine(False, -1, -1)
    px, py, pz = middles[n, 0], middles[n, 1], middles[n, 2]
    # Directions from near by to far off: those far off are surer, those near by may be alone.
    for m in range(count):
        k = near[m]
        off[m] = (middles[k, 0] - px) ** 2 + (middles[k, 1] - py) ** 2 + (middles[k, 2] - pz) ** 2
    ranked = np.argsort(off[:count])
    tried = min(count, MOST_DIRECTIONS)
    best, found = WireLine(False, -1, -1), 0
    for rank in range(tried):
        k = near[ranked[count - 1 - rank * count // tried]]
        ax, ay, az = middles[k, 0] - px, middles[k, 1] - py, middles[k, 2] - pz
        length = np.sqrt(ax * ax + ay * ay + az * az)
        if length < deviation:
            continue
        ax, ay, az = ax / length, ay / length, az / length
        on, far_ahead, far_behind = 0, 0.0, 0.0
        next_ahead, next_behind, ahead, behind = np.inf, np.inf, -1, -1
        for m in range(count):
            k = near[m]
            x, y, z = middles[k, 0] - px, middles[k, 1] - py, middles[k, 2] - pz
            forward = ax * x + ay * y + az * z
            if off[m] - forward * forward > deviation * deviation:
                continue
            on += 1
            if forward > 0.0:
                far_ahead = max(far_ahead, forward)
                if forward < next_ahead:
                    next_ahead, ahead = forward, k
            else:
                far_behind = max(far_behind, -forward)
                if -forward < next_behind:
                    next_behind, behind = -forward, k
        length = far_ahead + far_behind
        even = EVEN * length / max(on, 1)
        if on < ON_LINE or on < SHARE_ON_LINE * count or on <= found:
            continue
        if length >= SLENDER * deviation and min(next_ahead, next_behind) <= even:
            ahead = ahead if next_ahead <= even else -1
            behind = behind if next_behind <= even else -1
            best, found = WireLine(True, ahead, behind), on
    return best


@compiled
def _filled(
    boxes: Boxes, middles: FloatArray, pairs: IntArray, voxel: float, time_s: float
) -> Boxes:
    """The boxes, then one per voxel that none is in between the middles of pairs."""
    steps = 0
    for p in range(len(pairs)):
        apart = np.sqrt(np.sum((middles[pairs[p, 0]] - middles[pairs[p, 1]]) ** 2))
        steps += int(np.ceil(apart / voxel))
    bits = table_bits(len(boxes.doubt) + steps)
    shift = 64 - bits
    keys = np.full(1 << bits, -1, dtype=np.int64)
    numbers = np.empty(1 << bits, dtype=np.int64)
    every = empty_boxes(len(boxes.doubt) + steps)
    count = 0
    for n in range(len(boxes.doubt)):
        copy_box(boxes, n, every, count)
        key = key_of(boxes, n, voxel)
        slot = slot_of(key, keys, shift)
        keys[slot], numbers[slot] = key, count
        count += 1
    for p in range(len(pairs)):
        one, other = middles[pairs[p, 0]], middles[pairs[p, 1]]
        # The same way round from either end.
        if one[0] > other[0] or (one[0] == other[0] and one[1] > other[1]):
            one, other = other, one
        pieces = int(np.ceil(np.sqrt(np.sum((one - other) ** 2)) / voxel))
        for piece in range(1, pieces):
            place = one + (other - one) * (piece / pieces)
            key = box_key(place[0], place[1], place[2], 0, voxel)
            slot = slot_of(key, keys, shift)
            if keys[slot] != -1 and numbers[slot] < len(boxes.doubt):
                continue
            if keys[slot] == -1:
                keys[slot], numbers[slot] = key, count
                every.low_m[count], every.high_m[count] = place, place
                every.spacing_m[count], every.last_seen_s[count] = 0.5 * voxel, time_s
                every.size_m[count], every.doubt[count] = 0.0, 0.0
                every.sweeps[count], every.kind[count], every.level[count] = 0, BETWEEN, 0
                count += 1
            m = numbers[slot]
            for axis in range(3):
                every.low_m[m, axis] = min(every.low_m[m, axis], place[axis])
                every.high_m[m, axis] = max(every.high_m[m, axis], place[axis])
    return first_boxes(every, count)
