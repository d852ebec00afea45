"""How thick what a sweep hits is at least: a thing that stops beams side by side and above each
other is as wide as they lie apart; one that stops single beams, or a line of them, may be a wire.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.sensors.passing import Directions, Sensor, place_returns

BEAMS_ACROSS = 3.0
"""Beams across a thing from which on no lone return can come from it."""
Counts = npt.NDArray[np.int32]
Known = npt.NDArray[np.uint8]
UNKNOWN, WIDE, NARROW = range(3)
"""Of a bin that is in no block: nothing is known yet; it adjoins one at its range; or does not."""
ALIKE = 0.1
"""Share of the range by which neighbouring returns of one thing may differ in range."""


@borrowing
def _is_beside_block(nearest: FloatArray, blocks: Known, known: Known, c: int, r: int) -> bool:
    """Whether a return that is in no block adjoins one at its range.

    nearest: `passing.nearest_returns`; blocks: of it. known: [columns, rows] what was found out
    before, filled in.
    """
    if known[c, r] == UNKNOWN:
        known[c, r] = WIDE if _adjoins(nearest, blocks, c, r) else NARROW
    return bool(known[c, r] == WIDE)


@compiled
def blocks_of(nearest: FloatArray) -> Known:
    """[columns, rows] 1 where a bin is one of four, two by two, with returns at about the same
    range."""
    blocks = np.zeros(nearest.shape, dtype=np.uint8)
    _mark_blocks(nearest, np.zeros(nearest.shape, dtype=np.uint8), blocks)
    return blocks


@borrowing
def _mark_blocks(nearest: FloatArray, alike: Known, blocks: Known) -> None:
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


@borrowing
def _adjoins(nearest: FloatArray, blocks: Known, c: int, r: int) -> bool:
    """Whether a bin next to one is in a block, at about the same range."""
    columns, rows = nearest.shape
    for a in range(c - 1, c + 2):
        d = a + columns if a < 0 else (a - columns if a >= columns else a)
        for b in range(max(r - 1, 0), min(r + 2, rows)):
            alike = abs(nearest[d, b] - nearest[c, r]) <= ALIKE * nearest[c, r]
            if alike and (d != c or b != r) and blocks[d, b]:
                return True
    return False


@borrowing
def _is_lone(
    distance: float, fine: float, per_bin: Counts, nearest: FloatArray, c: int, r: int
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


class Seen(NamedTuple):
    """The returns of one sweep that are remembered, world frame."""

    points_m: FloatArray
    """[m, 3]"""
    radius_m: FloatArray
    """[m] half the beam spacing there."""
    size_m: FloatArray
    """[m] how thick the thing is at least; 0 where single beams hit it, or a line of them."""
    too_small: int
    """Returns left out: other beams show that what they hit is smaller than anything sought."""


@compiled
def returns_with_size(
    points: FloatArray,
    sensor: Sensor,
    reach: float,
    ground: float,
    directions: Directions,
    nearest: FloatArray,
    smallest: float,
) -> Seen:
    """`passing.place_returns`, and how thick what they hit is at least.

    directions, nearest: of the same returns. smallest: thickness of the smallest thing sought, 0
    where unknown. Where it spans several beams, a return with no other about it is none of such a
    thing.
    """
    half_spacing = sensor.half_spacing
    # Out to here a thing of the smallest size stops several beams, some of which may get lost.
    fine = smallest / (2.0 * BEAMS_ACROSS * half_spacing) if half_spacing > 0.0 else 0.0
    per_bin = count_returns(directions, nearest) if fine > 0.0 else np.zeros((0, 0), dtype=np.int32)
    placed, distances, source = place_returns(points, sensor, reach, ground)
    radii, sizes = np.empty(len(placed)), np.empty(len(placed))
    known = np.zeros(nearest.shape, dtype=np.uint8)
    m = _note_sizes(
        placed,
        distances,
        source,
        directions.bin,
        nearest,
        blocks_of(nearest),
        known,
        per_bin,
        half_spacing,
        fine,
        radii,
        sizes,
    )
    return Seen(placed[:m], radii[:m], sizes[:m], len(placed) - m)


@borrowing
def _note_sizes(
    placed: FloatArray,
    distances: FloatArray,
    source: IntArray,
    bins: npt.NDArray[np.int32],
    nearest: FloatArray,
    blocks: Known,
    known: Known,
    per_bin: Counts,
    half_spacing: float,
    fine: float,
    radii: FloatArray,
    sizes: FloatArray,
) -> int:
    """Fill in radii and sizes, and move the placed that are kept to the front; how many."""
    rows, m = nearest.shape[1], 0
    # Column and row of a bin take a division, so most are looked at without.
    nearest_at, block_at = nearest.reshape(nearest.size), blocks.reshape(blocks.size)
    for n in range(len(placed)):
        distance, at = distances[n], bins[source[n]]
        size = 0.0
        if at >= 0:
            near = distance <= (1.0 + ALIKE) * nearest_at[np.uint32(at)]
            if near and block_at[np.uint32(at)]:
                size = 2.0 * half_spacing * distance
            else:
                column = at // rows
                row = at - column * rows
                if near and _is_beside_block(nearest, blocks, known, column, row):
                    size = 2.0 * half_spacing * distance
                elif fine > 0.0 and _is_lone(distance, fine, per_bin, nearest, column, row):
                    continue
        placed[m, 0], placed[m, 1], placed[m, 2] = placed[n, 0], placed[n, 1], placed[n, 2]
        radii[m], sizes[m] = half_spacing * distance, size
        m += 1
    return m


@compiled
def count_returns(directions: Directions, nearest: FloatArray) -> Counts:
    """[columns, rows] returns per bin."""
    counts = np.zeros(nearest.shape, dtype=np.int32)
    _count(directions.bin, counts.reshape(counts.size))
    return counts


@borrowing
def _count(bins: npt.NDArray[np.int32], counts: Counts) -> None:
    for n in range(len(bins)):
        if bins[n] >= 0:
            counts[np.uint32(bins[n])] += 1
