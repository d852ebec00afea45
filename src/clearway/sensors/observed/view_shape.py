"""Range images of a beam pattern: their pixels, and which of them beams look at densely enough."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from clearway.base.arrays import FloatArray, Floats, Floats2, Int16s
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import TINY
from clearway.sensors.beams.pattern import BeamPattern

MOST_PIXELS = 100_000
"""Of an image: 64 of them take 17 MB."""
FINE = 0.5
"""Width of a pixel in beam spacings, where that makes no more pixels than these."""
HOLE = 0.75
SCATTERED = 1.5
"""Beam spacings from the nearest beam beyond which nothing is looked at: sqrt(2) / 2 in a square,
more where beams are scattered."""
WHOLE = 0.9
"""Share of a field that beams of a scattered pattern look at as densely as others do."""
EDGE = 1.25
"""Beam spacings by which an image is wider than its beams: its edge rows lie about those."""
ROUNDING = 1.01
"""By which distances between beams are taken larger than they were found at the sampled places."""
EVEN = 2.0 / np.pi - 1.0
"""What makes columns of equal width of pseudo-angles, nearly."""
FARTHEST = 32_767
"""Of a pixel, in centimetres: no beam through it returned. Where a pixel is not looked at densely
enough everywhere, one more than its range stands there with a minus."""
IMAGE_ROWS = 0
IMAGE_COLUMNS = 1
AROUND = 2
FIRST = 3
BOTTOM = 4
PER_ROW = 5
SIN_GAP = 6
COS_GAP = 7
SIN_GUARD = 8
COS_GUARD = 9
SIN_HALF = 10
COS_HALF = 11
RIGHT_X = 12
RIGHT_Y = 13
LEFT_X = 14
LEFT_Y = 15
NUMBERS = 16
"""What stands where in `ViewShape.numbers`: rows and columns of the image, columns of a full circle
and the number of the image's first, sine at which the first row begins, rows per unit of sine; then
sine and cosine of the gap: the greatest angle from any direction that is looked at to the nearest
beam; of the guard, twice as wide; and of half a pixel's diagonal; and the level directions in which
the image ends at its right and its left."""


class ViewShape(NamedTuple):
    """The image of a pattern."""

    numbers: FloatArray
    """[NUMBERS]"""
    directions: FloatArray
    """[2 * columns + 2 * rows] cosine and sine of the middle of each column, sine and cosine of the
    middle of each row."""
    beam_sines: tuple[float, float]
    """Of the lowest and the highest beam."""
    clear: Int16s
    """[rows * columns] what a scan without returns shows: FARTHEST, or -1 - FARTHEST."""

    @property
    def gap_rad(self) -> float:
        return float(np.arcsin(self.numbers[SIN_GAP]))


@compiled
def column_at(x: float, y: float, around: float) -> float:
    """The column, of a full circle's, in which a direction lies, and how far across it."""
    forward = y / (abs(x) + abs(y) + TINY)
    size = abs(forward)
    even = forward + EVEN * forward * (1.0 - size) * (1.0 - 2.0 * size)
    turned = even if x >= 0.0 else np.copysign(2.0, y) - even
    return min((turned + 2.0) * 0.25 * around, around * (1.0 - 1e-12))


@lru_cache(maxsize=16)
def view_shape(pattern: BeamPattern) -> ViewShape:
    """Return the image of a pattern.

    Notes
    -----
    A direction is looked at if a beam lies within the gap of it. The gap is measured: the greatest
    distance to the nearest beam within the pattern, at the corners of pixels. So whatever spans the
    gap on either side, anywhere in pixels that are looked at, is met by a beam.
    """
    beams = pattern.directions
    spacing = max(pattern.spacing_rad, 1e-3)
    low, high = float(pattern.elevation_rad.min()), float(pattern.elevation_rad.max())
    behind = float(np.abs(pattern.azimuth_rad).max()) > 0.75 * np.pi
    right, left = float(pattern.azimuth_rad.min()), float(pattern.azimuth_rad.max())
    beside = spacing / max(np.cos(max(abs(low), abs(high))), 0.2)
    across = 2.0 * np.pi if behind else left - right + 2.0 * beside
    bottom = np.sin(max(low - EDGE * spacing, -0.5 * np.pi))
    tall = np.sin(min(high + EDGE * spacing, 0.5 * np.pi)) - bottom
    width = max(FINE * spacing, float(np.sqrt(across * tall / MOST_PIXELS)))
    around = int(np.clip(2.0 * np.pi / width, 16, 8192))
    rows = max(int(np.ceil(tall / width)), 1)
    if behind:
        first, columns = 0, around
    else:
        first, last = (
            int(np.clip(column_at(np.cos(a), np.sin(a), around), 0, around - 1))
            for a in (max(right - beside, -np.pi), min(left + beside, np.pi))
        )
        columns = last - first + 1
    azimuth = _azimuth_of((first + 0.5 * np.arange(2 * columns + 1)) * 4.0 / around - 2.0)
    sine = np.clip(bottom + 0.5 * np.arange(2 * rows + 1) * tall / rows, -1.0, 1.0)
    off = _off_beams(beams, azimuth, sine, spacing)
    within = (sine >= np.sin(low) - 1e-9) & (sine <= np.sin(high) + 1e-9)
    inside = (
        np.ones(len(azimuth), dtype=np.bool_) if behind else (azimuth >= right) & (azimuth <= left)
    )
    gap = ROUNDING * _widest_gap(off[np.ix_(within, inside)].ravel(), spacing)
    if high - low < spacing:  # Beams of one level alone leave their own row about them.
        gap = HOLE * spacing
    worst = np.max([off[i : i + 2 * rows - 1 : 2, j : j + 2 * columns - 1 : 2]
                    for i in range(3) for j in range(3)], axis=0)  # fmt: skip
    clear = np.where(worst <= gap, FARTHEST, -1 - FARTHEST).astype(np.int16).ravel()
    half = _half_diagonal(azimuth, sine)
    guard = 2.0 * gap
    ends = azimuth[0], azimuth[-1]
    numbers = np.array(
        [rows, columns, around, first, bottom, rows / tall]
        + [f(a) for a in (gap, guard, half) for f in (np.sin, np.cos)]
        + [f(a) for a in ends for f in (np.cos, np.sin)]
    )
    middles, heights = azimuth[1::2], sine[1::2]
    cosines = np.sqrt(np.maximum(1.0 - heights**2, 0.0))
    directions = np.concatenate([np.cos(middles), np.sin(middles), heights, cosines])
    return ViewShape(numbers, directions, (float(np.sin(low)), float(np.sin(high))), clear)


def _azimuth_of(evened: FloatArray) -> FloatArray:
    """The azimuths at which `column_at` has turned so far, in quarters from -2 to 2."""
    tried = np.linspace(-np.pi, np.pi, 40_001)
    x, y = np.cos(tried), np.sin(tried)
    forward = y / (np.abs(x) + np.abs(y) + TINY)
    size = np.abs(forward)
    even = forward + EVEN * forward * (1.0 - size) * (1.0 - 2.0 * size)
    turned = np.where(x >= 0.0, even, np.copysign(2.0, tried) - even)
    return np.asarray(np.interp(evened, turned, tried))


def _widest_gap(off: FloatArray, spacing: float) -> float:
    """Greatest angle to the nearest beam within a pattern; of one that leaves much of it open, such
    as rows far apart at its edges, only within what lies near to beams."""
    near = off <= HOLE * spacing
    if np.count_nonzero(near) > WHOLE * near.size:
        near = off <= SCATTERED * spacing
    return float(off[near].max()) if near.any() else HOLE * spacing


def _off_beams(
    beams: FloatArray, azimuth: FloatArray, sine: FloatArray, spacing: float
) -> FloatArray:
    """[sines, azimuths] angle from each direction to the nearest beam; pi where none is near."""
    cosine = np.sqrt(1.0 - sine**2)[:, None]
    places = np.stack(
        [cosine * np.cos(azimuth), cosine * np.sin(azimuth), sine[:, None] + 0.0 * azimuth], axis=-1
    )
    distance, _ = cKDTree(beams).query(
        places.reshape(-1, 3), distance_upper_bound=SCATTERED * spacing
    )
    away = np.where(np.isfinite(distance), 2.0 * np.arcsin(np.minimum(0.5 * distance, 1.0)), np.pi)
    return np.asarray(away.reshape(places.shape[:2]))


def _half_diagonal(azimuth: FloatArray, sine: FloatArray) -> float:
    """Greatest angle from the middle of a pixel to a corner of it."""
    across = 0.5 * float(np.diff(azimuth[::2]).max())
    rise = np.arcsin(sine)
    up = np.maximum(rise[1::2] - rise[:-1:2], rise[2::2] - rise[1::2])
    widest = np.maximum(np.cos(rise[:-1:2]), np.cos(rise[2::2])) * across
    return ROUNDING * float(np.hypot(up, widest).max())


@compiled
def lay_returns(points: Floats2, short: float, numbers: Floats, image: Int16s) -> None:
    """Note in an image how far beams go on for sure: up to `short` of the nearest return."""
    rows, columns, around = int(numbers[IMAGE_ROWS]), int(numbers[IMAGE_COLUMNS]), numbers[AROUND]
    first, bottom, per_row = int(numbers[FIRST]), numbers[BOTTOM], numbers[PER_ROW]
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        distance = np.sqrt(x * x + y * y + z * z)
        if not distance < np.inf:
            continue
        row = int(np.floor((z / (distance + TINY) - bottom) * per_row))
        column = int(column_at(x, y, around)) - first
        if 0 <= row < rows and 0 <= column < columns:
            at = np.uint32(row * columns + column)
            far = int(max(min(100.0 * (distance - short), FARTHEST - 1.0), 0.0))
            before = int(image[at])
            image[at] = np.int16(min(before, far) if before >= 0 else max(before, -1 - far))
