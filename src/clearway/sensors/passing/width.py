"""How thick what a sweep hits is at least: a thing that stops beams side by side and above each
other is as wide as they lie apart; one that stops single beams, or a line of them, may be a wire.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Int32s, Int32s2, Ints, UInt8s, UInt8s2
from clearway.base.compiled import compiled
from clearway.sensors.beams.raster import Directions
from clearway.sensors.passing.passed_points import Sensor, place_returns

BEAMS_ACROSS = 3.0
"""Beams across a thing from which on no lone return can come from it."""
Counts = npt.NDArray[np.int32]
Known = npt.NDArray[np.uint8]
UNKNOWN = 0
WIDE = 1
NARROW = 2
"""Of a bin: not known yet; its return is of a block, or adjoins one at its range; or does not."""
ALIKE = 0.1
"""Share of the range by which neighbouring returns of one thing may differ in range."""


@compiled
def blocks_of(nearest: Floats2) -> UInt8s2:
    """[columns, rows] 1 where a bin is one of four, two by two, with returns at about the same
    range."""
    blocks = np.zeros(nearest.shape, dtype=np.uint8)
    _mark_blocks(nearest, np.zeros(nearest.shape, dtype=np.uint8), blocks)
    return blocks


@compiled
def _mark_blocks(nearest: Floats2, alike: UInt8s2, blocks: UInt8s2) -> None:
    """Fill in `blocks_of`. alike: [columns, rows] room for whether the four begin with a bin."""
    columns, rows = nearest.shape
    for c in range(columns):
        d = c + 1 if c + 1 < columns else 0
        for r in range(rows - 1):
            low = min(min(nearest[c, r], nearest[c, r + 1]), min(nearest[d, r], nearest[d, r + 1]))
            high = max(max(nearest[c, r], nearest[c, r + 1]), max(nearest[d, r], nearest[d, r + 1]))
            alike[c, r] = (high < np.inf) & (high - low <= ALIKE * low)
    for c in range(columns):
        b = c - 1 if c > 0 else columns - 1
        blocks[c, 0] = alike[c, 0] | alike[b, 0]
        for r in range(1, rows):
            blocks[c, r] = alike[c, r] | alike[b, r] | alike[c, r - 1] | alike[b, r - 1]


@compiled
def mark_first_known(blocks: UInt8s2) -> UInt8s2:
    """[columns, rows] what blocks alone tell of each bin: bins of blocks are wide, and what adjoins
    none at any range is narrow."""
    known = np.empty(blocks.shape, dtype=np.uint8)
    _mark_known(blocks, np.zeros(blocks.shape[1] + 2, dtype=np.uint8), known)
    return known


@compiled
def _mark_known(blocks: UInt8s2, beside: UInt8s, known: UInt8s2) -> None:
    """Fill in `mark_first_known`. beside: [rows + 2] room for blocks of three columns."""
    columns, rows = blocks.shape
    for c in range(columns):
        b, d = c - 1 if c > 0 else columns - 1, c + 1 if c + 1 < columns else 0
        for r in range(rows):
            beside[r + 1] = blocks[b, r] | blocks[c, r] | blocks[d, r]
        for r in range(rows):
            none = (beside[r] | beside[r + 1] | beside[r + 2]) == 0
            told = NARROW if none else UNKNOWN
            known[c, r] = WIDE if blocks[c, r] else told


@compiled
def _adjoins(nearest: Floats2, blocks: UInt8s2, c: int, r: int) -> bool:
    """Whether a bin next to one that is in no block is in one, at about the same range."""
    columns, rows = nearest.shape
    for a in range(c - 1, c + 2):
        d = a + columns if a < 0 else (a - columns if a >= columns else a)
        for b in range(max(r - 1, 0), min(r + 2, rows)):
            if blocks[d, b] and abs(nearest[d, b] - nearest[c, r]) <= ALIKE * nearest[c, r]:
                return True
    return False


@compiled
def _is_lone(
    distance: float, fine: float, per_bin: Int32s2, nearest: Floats2, c: int, r: int
) -> bool:
    """Whether a return, near enough to tell, is alone: in its bin, and at its range around it."""
    if distance > fine or per_bin[c, r] != 1:
        return False
    columns, rows = nearest.shape
    for a in range(c - 1, c + 2):
        d = a + columns if a < 0 else (a - columns if a >= columns else a)
        for b in range(max(r - 1, 0), min(r + 2, rows)):
            other = d != c or b != r
            if other and abs(nearest[d, b] - nearest[c, r]) <= ALIKE * nearest[c, r]:
                return False
    return True


class Widths(NamedTuple):
    """What tells how thick things are that a sweep hits."""

    nearest_m: Floats2
    """[columns, rows] of its `Directions`."""
    blocks: UInt8s2
    """[columns, rows] `blocks_of` it."""
    known: UInt8s2
    """[columns, rows] `mark_first_known`; what is found out is filled in."""
    per_bin: Int32s2
    """[columns, rows] returns per bin; empty where no lone ones are looked for."""
    half_spacing: float
    fine_m: float
    """Out to here a thing of the smallest size stops several beams, some of which may get lost."""


@compiled
def widths_of(directions: Directions, half_spacing: float, smallest: float) -> Widths:
    """smallest: thickness of the smallest thing sought, 0 where unknown."""
    nearest = directions.nearest_m
    fine = smallest / (2.0 * BEAMS_ACROSS * half_spacing) if half_spacing > 0.0 else 0.0
    per_bin = np.zeros(nearest.shape if fine > 0.0 else (0, 0), dtype=np.int32)
    if fine > 0.0:
        _count(directions.bin, per_bin.reshape(per_bin.size))
    blocks = blocks_of(nearest)
    return Widths(nearest, blocks, mark_first_known(blocks), per_bin, half_spacing, fine)


@compiled
def _count(bins: Int32s, counts: Int32s) -> None:
    for n in range(len(bins)):
        if bins[n] >= 0:
            counts[np.uint32(bins[n])] += 1


class Seen(NamedTuple):
    """The returns of one sweep that are remembered, world frame."""

    points_m: Floats2
    """[m, 3]"""
    radius_m: Floats
    """[m] half the beam spacing there."""
    size_m: Floats
    """[m] how thick the thing is at least; 0 where single beams hit it, or a line of them."""
    too_small: int
    """Returns left out: other beams show that what they hit is smaller than anything sought."""


@compiled
def returns_with_size(
    points: Floats2,
    sensor: Sensor,
    reach: float,
    ground: float,
    directions: Directions,
    smallest: float,
) -> Seen:
    """`passing.place_returns`, and how thick what they hit is at least.

    directions: of the same returns. smallest: thickness of the smallest thing sought, 0 where
    unknown. Where it spans several beams, a return with no other about it is none of such a thing.
    """
    placed, distances, source = place_returns(points, sensor, reach, ground)
    radii, sizes = np.empty(len(placed)), np.empty(len(placed))
    widths = widths_of(directions, sensor.half_spacing, smallest)
    m = _note_sizes(placed, distances, source, directions.bin, widths, radii, sizes)
    return Seen(placed[:m], radii[:m], sizes[:m], len(placed) - m)


@compiled
def _note_sizes(
    placed: Floats2,
    distances: Floats,
    source: Ints,
    bins: Int32s,
    widths: Widths,
    radii: Floats,
    sizes: Floats,
) -> int:
    """Fill in radii and sizes, and move the placed that are kept to the front; how many.

    distances, source: [placed] as of `passing.Placed`. bins: of the returns that these are of.
    """
    nearest, blocks, known = widths.nearest_m, widths.blocks, widths.known
    half_spacing, fine, per_bin = widths.half_spacing, widths.fine_m, widths.per_bin
    rows, m = np.uint32(nearest.shape[1]), 0
    nearest_at, known_at = nearest.reshape(nearest.size), known.reshape(known.size)
    for n in range(len(distances)):
        distance, at = distances[n], bins[source[n]]
        size = 0.0
        if at >= 0:
            own = np.uint32(at)
            told = known_at[own]
            if told != NARROW and distance <= (1.0 + ALIKE) * nearest_at[own]:
                if told == UNKNOWN:
                    beside = _adjoins(nearest, blocks, int(own // rows), int(own % rows))
                    told = WIDE if beside else NARROW
                    known_at[own] = told
                if told == WIDE:
                    size = 2.0 * half_spacing * distance
            if size == 0.0 and fine > 0.0:
                column, row = int(own // rows), int(own % rows)
                if _is_lone(distance, fine, per_bin, nearest, column, row):
                    continue
        placed[m, 0], placed[m, 1], placed[m, 2] = placed[n, 0], placed[n, 1], placed[n, 2]
        radii[m], sizes[m] = half_spacing * distance, size
        m += 1
    return m
