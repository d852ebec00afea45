"""Returns in a line are a wire: what lies between neighbours of them is remembered too.

A thing thinner than the beams lie apart is hit here and there along it. A return belongs to a line
if many of those around it lie on one straight line through it; foliage and rain lie about instead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.sensors.memory.remembered import BETWEEN, IN_LINE, Boxes, box_key, key_of
from clearway.sensors.memory.wire_gaps import fill_between
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


SIZE_SPARE = 1e-6
"""Share of its size by which a cell lies too far off at least to be passed over."""


class ThinBoxes(NamedTuple):
    """Thin boxes sorted by cubes."""

    size_m: float
    order: Ints
    """[thin] their numbers, cube by cube."""
    middle_m: Floats2
    """[3, thin] their middles, likewise: those of a cube are looked at one after the other."""
    start: Ints
    """[slots + 1] where those of a slot begin."""
    keys: Ints
    """[slots] which cube is whose."""
    shift: int


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
    cells = close = _by_cell(middles, thin, gap)
    one_in = 1 + untold // MOST_TESTED
    near, about = np.empty(MOST_NEIGHBOURS + 1, dtype=np.int64), np.empty((4, MOST_NEIGHBOURS))
    pairs = np.empty((2 * len(thin), 2), dtype=np.int64)
    count = 0
    lined = boxes.kind.copy()
    for n in range(first_new, len(thin)):
        if not thin[n] or boxes.kind[n] == IN_LINE:
            continue
        if one_in > 1 and key_of(boxes, n, voxel) * 0x9E3779B1 % one_in != 0:
            continue
        around = _neighbours(middles, n, cells, near)
        if around < 0:
            if close.size_m == gap:
                close = _by_cell(middles, thin, CLOSE * gap)
            around = _neighbours(middles, n, close, near)
        if around < ON_LINE:
            continue
        line = _line_through(middles, n, deviation, near[:around], about)
        if not line.found:
            continue
        lined[n] = IN_LINE
        for other in (line.ahead, line.behind):
            if other >= 0:
                pairs[count, 0], pairs[count, 1] = n, other
                count += 1
    boxes.kind[:] = lined
    return fill_between(boxes, middles, pairs[:count], voxel, time_s) if count else boxes


@compiled
def _by_cell(middles: Floats2, thin: Bools, size: float) -> ThinBoxes:
    total = 0
    for n in range(len(thin)):
        total += thin[n]
    bits = table_bits(total)
    cells = ThinBoxes(
        size,
        np.empty(total, dtype=np.int64),
        np.empty((3, total)),
        np.zeros((1 << bits) + 1, dtype=np.int64),
        np.full(1 << bits, -1, dtype=np.int64),
        64 - bits,
    )
    slots, filled = np.empty(len(thin), dtype=np.int64), np.empty(1 << bits, dtype=np.int64)
    _sort_into(middles, thin, cells, slots, filled)
    return cells


@compiled
def _sort_into(middles: Floats2, thin: Bools, cells: ThinBoxes, slots: Ints, filled: Ints) -> None:
    """Fill in cells. slots: [boxes] room for the slot of each; filled: [slots] up to where each
    is."""
    start, keys, order = cells.start, cells.keys, cells.order
    for n in range(len(thin)):
        if thin[n]:
            key = box_key(middles[n, 0], middles[n, 1], middles[n, 2], 0, cells.size_m)
            slot = slot_of(key, keys, cells.shift)
            keys[slot], slots[n] = key, slot
            start[slot + 1] += 1
    for slot in range(len(keys)):
        filled[slot] = start[slot]
        start[slot + 1] += start[slot]
    for n in range(len(thin)):
        if thin[n]:
            at = filled[slots[n]]
            filled[slots[n]] = at + 1
            order[at] = n
            for axis in range(3):
                cells.middle_m[axis, at] = middles[n, axis]


@compiled
def _neighbours(middles: Floats2, n: int, cells: ThinBoxes, near: Ints) -> int:
    """How many thin boxes lie within the size of a cell of box n, written into `near`; -1 if as
    many as there is room for."""
    count, x, y, z = 0, middles[n, 0], middles[n, 1], middles[n, 2]
    size, order, start, keys = cells.size_m, cells.order, cells.start, cells.keys
    xs, ys, zs = cells.middle_m[0], cells.middle_m[1], cells.middle_m[2]
    surely2 = (size + SIZE_SPARE * size) ** 2
    for i in range(-1, 2):
        away_x = _to_cell(x, i, size)
        for j in range(-1, 2):
            away_y = _to_cell(y, j, size)
            for k in range(-1, 2):
                away_z = _to_cell(z, k, size)
                if away_x * away_x + away_y * away_y + away_z * away_z > surely2:
                    continue
                key = box_key(x + i * size, y + j * size, z + k * size, 0, size)
                slot = slot_of(key, keys, cells.shift)
                if keys[slot] != key:
                    continue
                for at in range(start[slot], start[slot + 1]):
                    dx, dy, dz, m = xs[at] - x, ys[at] - y, zs[at] - z, order[at]
                    near[count] = m  # Written always and passed over if far: no branch.
                    count += (dx * dx + dy * dy + dz * dz <= size * size) & (m != n)
                    if count == len(near):
                        return -1
    return count


@compiled
def _to_cell(at: float, step: int, size: float) -> float:
    """Distance along an axis from a place to the cell beside its own, or to its own."""
    into = at - np.floor(at / size) * size
    return 0.0 if step == 0 else into if step < 0 else size - into


@compiled
def _line_through(
    middles: Floats2, n: int, deviation: float, near: Ints, about: Floats2
) -> WireLine:
    """The line through a box on which most of those near it [count] lie.

    about: [4, MOST_NEIGHBOURS] room for where they are from it, and their squared distances.
    """
    count = len(near)
    x, y, z, off = about[0], about[1], about[2], about[3]
    for m in range(count):
        for axis in range(3):
            about[axis, m] = middles[near[m], axis] - middles[n, axis]
    for m in range(count):
        off[m] = x[m] ** 2 + y[m] ** 2 + z[m] ** 2
    # Directions from near by to far off: those far off are surer, those near by may be alone.
    ranked = np.argsort(off[:count])
    tried = min(count, MOST_DIRECTIONS)
    best, found = WireLine(False, -1, -1), 0
    for rank in range(tried):
        k = ranked[count - 1 - rank * count // tried]
        length = np.sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k])
        if length < deviation:
            continue
        ax, ay, az = x[k] / length, y[k] / length, z[k] / length
        on = _count_on(about, count, ax, ay, az, deviation)
        if on < ON_LINE or on < SHARE_ON_LINE * count or on <= found:
            continue
        line = _along(about, count, near, ax, ay, az, deviation, on)
        if line.found:
            best, found = line, on
    return best


@compiled
def _count_on(about: Floats2, count: int, ax: float, ay: float, az: float, deviation: float) -> int:
    """How many neighbours lie on a line along a direction."""
    on = 0
    for m in range(count):
        forward = ax * about[0, m] + ay * about[1, m] + az * about[2, m]
        on += not about[3, m] - forward * forward > deviation * deviation
    return on


@compiled
def _along(
    about: Floats2,
    count: int,
    near: Ints,
    ax: float,
    ay: float,
    az: float,
    deviation: float,
    on: int,
) -> WireLine:
    """The line along a direction, which so many lie on, if it is long enough and a neighbour is no
    farther off than they are from each other."""
    far_ahead, far_behind = 0.0, 0.0
    next_ahead, next_behind, ahead, behind = np.inf, np.inf, -1, -1
    for m in range(count):
        forward = ax * about[0, m] + ay * about[1, m] + az * about[2, m]
        if about[3, m] - forward * forward > deviation * deviation:
            continue
        if forward > 0.0:
            far_ahead = max(far_ahead, forward)
            if forward < next_ahead:
                next_ahead, ahead = forward, near[m]
        else:
            far_behind = max(far_behind, -forward)
            if -forward < next_behind:
                next_behind, behind = -forward, near[m]
    length = far_ahead + far_behind
    even = EVEN * length / max(on, 1)
    if length < SLENDER * deviation or min(next_ahead, next_behind) > even:
        return WireLine(False, -1, -1)
    return WireLine(
        True, ahead if next_ahead <= even else -1, behind if next_behind <= even else -1
    )
