"""How thick what a sweep hits is at least: a thing that stops beams side by side and above each
other is as wide as they lie apart; one that stops single beams, or a line of them, may be a wire.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.sensors.binning import TINY
from clearway.sensors.passing import BeamRaster, Sensor, bin_of, place_returns

BEAMS_ACROSS = 3.0
"""Beams across a thing from which on no lone return can come from it."""
Counts = npt.NDArray[np.int32]
Known = npt.NDArray[np.uint8]
UNKNOWN, SPARSE, BLOCK, WIDE, NARROW = range(5)
"""Of a bin: nothing yet; that it is in no block; that it is; that it adjoins one; or does not."""
ALIKE = 0.1
"""Share of the range by which neighbouring returns of one thing may differ in range."""


@compiled
def is_wide(nearest: FloatArray, known: Known, c: int, r: int) -> bool:
    """Whether returns stand in two columns and two rows at about the same range.

    nearest: `passing.nearest_returns`. True also of a return that adjoins such ones at their range.
    known: [columns, rows] what was found out before, filled in.
    """
    if known[c, r] == UNKNOWN or known[c, r] == SPARSE:
        if _in_block(nearest, known, c, r) or _adjoins(nearest, known, c, r):
            known[c, r] = WIDE if known[c, r] == SPARSE else known[c, r]
        else:
            known[c, r] = NARROW
    return bool(known[c, r] != NARROW)


@compiled
def _in_block(nearest: FloatArray, known: Known, c: int, r: int) -> bool:
    """Whether a bin is one of four, two by two, with returns at about the same range."""
    if known[c, r] == UNKNOWN:
        columns, rows = nearest.shape
        known[c, r] = SPARSE
        for a in (c - 1, c + 1):
            d = a + columns if a < 0 else (a - columns if a >= columns else a)
            for b in (r - 1, r + 1):
                if not 0 <= b < rows:
                    continue
                low = min(min(nearest[c, r], nearest[c, b]), min(nearest[d, r], nearest[d, b]))
                high = max(max(nearest[c, r], nearest[c, b]), max(nearest[d, r], nearest[d, b]))
                if high < np.inf and high - low <= ALIKE * low:
                    known[c, r] = BLOCK
    return bool(known[c, r] == BLOCK)


@compiled
def _adjoins(nearest: FloatArray, known: Known, c: int, r: int) -> bool:
    """Whether a bin next to one is in a block, at about the same range."""
    columns, rows = nearest.shape
    for a in range(c - 1, c + 2):
        d = a + columns if a < 0 else (a - columns if a >= columns else a)
        for b in range(max(r - 1, 0), min(r + 2, rows)):
            alike = abs(nearest[d, b] - nearest[c, r]) <= ALIKE * nearest[c, r]
            if alike and (d != c or b != r) and _in_block(nearest, known, d, b):
                return True
    return False


@compiled
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
    nearest: FloatArray,
    raster: BeamRaster,
    smallest: float,
) -> Seen:
    """`passing.place_returns`, and how thick what they hit is at least.

    smallest: thickness of the smallest thing sought, 0 where unknown. Where it spans several
    beams, a return with no other about it is none of such a thing.
    """
    half_spacing = sensor.half_spacing
    # Out to here a thing of the smallest size stops several beams, some of which may get lost.
    fine = smallest / (2.0 * BEAMS_ACROSS * half_spacing) if half_spacing > 0.0 else 0.0
    known = np.zeros(nearest.shape, dtype=np.uint8)
    per_bin = count_returns(points, raster) if fine > 0.0 else np.zeros((0, 0), dtype=np.int32)
    per_column, per_row, bottom = raster.per_column, raster.per_row, raster.bottom
    placed, distances, source = place_returns(points, sensor, reach, ground)
    radii, sizes = np.empty(len(placed)), np.empty(len(placed))
    m, too_small = 0, 0
    for n in range(len(placed)):
        a, b, c = points[source[n], 0], points[source[n], 1], points[source[n], 2]
        distance = distances[n]
        column, row = bin_of(a, b, c / (distance + TINY), nearest, per_column, per_row, bottom)
        size = 0.0
        if row >= 0:
            if distance <= (1.0 + ALIKE) * nearest[column, row] and is_wide(
                nearest, known, column, row
            ):
                size = 2.0 * half_spacing * distance
            elif _is_lone(distance, fine, per_bin, nearest, column, row):
                too_small += 1
                continue
        placed[m] = placed[n]
        radii[m], sizes[m] = half_spacing * distance, size
        m += 1
    return Seen(placed[:m], radii[:m], sizes[:m], too_small)


@compiled
def count_returns(points: FloatArray, raster: BeamRaster) -> Counts:
    """[columns, rows] returns per bin."""
    counts = np.zeros(raster.low.shape, dtype=np.int32)
    per_column, per_row, bottom = raster.per_column, raster.per_row, raster.bottom
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        distance = np.sqrt(x * x + y * y + z * z)
        if distance < np.inf:
            column, row = bin_of(
                x, y, z / (distance + TINY), raster.low, per_column, per_row, bottom
            )
            if row >= 0:
                counts[column, row] += 1
    return counts
