"""Directions of a sweep in bins: where the pattern has beams, and how near the nearest return is.

A scan lists returns only, so directions are sorted into bins at least as wide as the beam spacing.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Bools2, Floats, Floats2, Int32s
from clearway.base.compiled import compiled
from clearway.base.state import BoolArray
from clearway.sensors.beams.binning import TINY
from clearway.sensors.beams.pattern import BeamPattern

MAX_COLUMNS = 2048
MAX_ROWS = 1024
BLOCK = 512
"""Returns at a time: what is worked out about them stays in the fastest cache."""

BinArray = npt.NDArray[np.int32]


class BeamRaster(NamedTuple):
    """Bins of direction, at least as wide as the beam spacing: where the pattern has beams.

    Azimuth by its pseudo-angle and elevation by its sine, as in `binning`.
    """

    low: Floats2
    """[columns, rows] sine of the lowest beam in the bin; inf where there is none."""
    high: Floats2
    """[columns, rows] sine of the highest; -inf where there is none."""
    flanked: Bools2
    """[columns, rows] true where there are beams on either side too."""
    per_column: float
    """Columns per unit of pseudo-angle."""
    per_row: float
    """Rows per unit of sine."""
    bottom: float
    """Sine at which the first row begins."""


@lru_cache(maxsize=16)
def beam_raster(pattern: BeamPattern) -> BeamRaster:
    spacing = max(pattern.spacing_rad, 1e-3)
    sines = pattern.directions[:, 2]
    columns = int(np.clip(4.0 / spacing, 8, MAX_COLUMNS))
    height = max(spacing, (sines.max() - sines.min()) / (MAX_ROWS - 3))
    # One empty row above and below the pattern, and the window never leaves the raster.
    bottom = float(sines.min()) - 1.5 * height
    rows = int((sines.max() - bottom) / height) + 2
    low, high = np.full((columns, rows), np.inf), np.full((columns, rows), -np.inf)
    per_column, per_row = columns / 4.0, 1.0 / height
    _note_beams(pattern.directions, low, high, per_column, per_row, bottom)
    return BeamRaster(low, high, _find_flanked(low < np.inf), per_column, per_row, bottom)


def _find_flanked(beams: BoolArray) -> BoolArray:
    """[columns, rows] whether both neighbouring columns have beams in about the same row."""
    band = beams.copy()
    band[:, 1:] |= beams[:, :-1]
    band[:, :-1] |= beams[:, 1:]
    return np.ascontiguousarray(np.roll(band, 1, axis=0) & np.roll(band, -1, axis=0))


@compiled
def _note_beams(
    directions: Floats2,
    low: Floats2,
    high: Floats2,
    per_column: float,
    per_row: float,
    bottom: float,
) -> None:
    """Fill in the lowest and highest beam of every bin."""
    for n in range(len(directions)):
        x, y, z = directions[n, 0], directions[n, 1], directions[n, 2]
        column, row = find_bin(x, y, z, low, per_column, per_row, bottom)
        low[column, row] = min(low[column, row], z)
        high[column, row] = max(high[column, row], z)


@compiled
def find_bin(
    x: float,
    y: float,
    sine: float,
    bins: Floats2,
    per_column: float,
    per_row: float,
    bottom: float,
) -> tuple[int, int]:
    """Column and row of a direction; row -1 outside the raster."""
    forward = y / (abs(x) + abs(y) + TINY)
    turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
    column = min(int((turned + 2.0) * per_column), bins.shape[0] - 1)
    offset = (sine - bottom) * per_row
    row = int(offset) if 0.0 <= offset < bins.shape[1] else -1
    return column, row


class Directions(NamedTuple):
    """Where the returns [n] of a sweep lie among the bins of a raster."""

    bin: Int32s
    """[n] column * rows + row; -1 outside the raster, and where there is no finite distance."""
    nearest_m: Floats2
    """[columns, rows] range of the nearest return per bin; inf without any."""


@compiled
def directions_of(points: Floats2, raster: BeamRaster) -> Directions:
    """Bins of returns [n, 3], sensor frame, and how near the nearest of each is."""
    bins, nearest = np.empty(len(points), dtype=np.int32), np.full(raster.low.shape, np.inf)
    columns, rows = raster.low.shape
    flat, nearest_at = points.reshape(points.size), nearest.reshape(nearest.size)
    distance = np.empty(BLOCK)
    for begin in range(0, len(points), BLOCK):
        end = min(begin + BLOCK, len(points))
        sort_into_bins(
            flat[3 * begin : 3 * end],
            columns,
            rows,
            raster.per_column,
            raster.per_row,
            raster.bottom,
            distance[: end - begin],
            bins[begin:end],
        )
        _note_nearest(distance, bins[begin:end], nearest_at)
    return Directions(bins, nearest)


@compiled
def nearest_returns(points: Floats2, raster: BeamRaster) -> Floats2:
    """[columns, rows] range of the nearest return per bin; inf without any."""
    return directions_of(points, raster).nearest_m


@compiled
def sort_into_bins(
    flat: Floats,
    columns: int,
    rows: int,
    per_column: float,
    per_row: float,
    bottom: float,
    distance: Floats,
    bins: Int32s,
) -> None:
    """`find_bin` of a block of returns, without a branch: the compiler takes several at a time.

    flat: [3 * returns] one after the other: only so does the compiler know how far apart they are.
    """
    last = np.int32(columns - 1)
    for n in range(len(distance)):
        x, y, z = flat[3 * n], flat[3 * n + 1], flat[3 * n + 2]
        distance[n] = np.sqrt(x * x + y * y + z * z)
    for n in range(len(distance)):
        x, y, z = flat[3 * n], flat[3 * n + 1], flat[3 * n + 2]
        forward = y / (abs(x) + abs(y) + TINY)
        turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
        column = min(np.int32((turned + 2.0) * per_column), last)
        offset = (z / (distance[n] + TINY) - bottom) * per_row
        inside = (offset >= 0.0) & (offset < rows) & (distance[n] < np.inf)
        bins[n] = column * np.int32(rows) + np.int32(offset) if inside else -1


@compiled
def _note_nearest(distance: Floats, bins: Int32s, nearest: Floats) -> None:
    for n in range(len(bins)):
        if bins[n] >= 0:
            at = np.uint32(bins[n])
            nearest[at] = min(nearest[at], distance[n])
