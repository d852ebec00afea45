"""Marking what a sweep saw where obstacles are declared to be columns.

Where whatever stands between two heights reaches through all of them, one beam that goes on above
a place at any of these heights shows the place to be free at all. So a scanner of one level plane
shows free space too.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Ints, UInt64s, UInt64s3
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import TINY
from clearway.sensors.observed.free_marking import (
    COLUMNS,
    ROWS,
)
from clearway.sensors.observed.free_voxels import ONE, WORD
from clearway.sensors.observed.range_views import RangeViews
from clearway.sensors.observed.view_shape import (
    AROUND,
    BOTTOM,
    FIRST,
    IMAGE_COLUMNS,
    IMAGE_ROWS,
    PER_ROW,
    SIN_GAP,
    SIN_GUARD,
    column_at,
)
from clearway.sensors.passing.passed_points import Sensor

HALF_WIDTH = 0.5 * float(np.sqrt(2.0))
"""From the middle of a voxel to a corner, seen from above, in widths."""
TILTED = 1.2
"""By which a voxel may look wider along the beams of a tilted sensor."""
SURELY_INSIDE = 1e-6
"""Of a voxel, by which rounding may put it beyond the heights."""
STEEPEST = 0.1
"""Cosine of the steepest beam that is looked along: steeper ones show the place overhead alone."""


@compiled
def mark_columns(
    free: UInt64s3,
    low: Ints,
    voxel: float,
    sines: tuple[float, float],
    sensor: Sensor,
    reach: float,
    views: RangeViews,
    slot: int,
    heights: Floats,
    tilt: float,
) -> None:
    """Mark the voxels above and below each place that a beam near to level goes beyond.

    sines: of the lowest and highest beam. heights: [2] between which whatever stands is a column,
    world frame. tilt: angle by which beams may point higher or lower than the pattern says.
    """
    # The bits between the heights: the same in every column.
    bits = np.zeros(free.shape[2], dtype=np.uint64)
    first = max(int(np.ceil(heights[0] / voxel - SURELY_INSIDE)), low[2])
    last = min(int(np.floor(heights[1] / voxel + SURELY_INSIDE)) - 1, low[2] + ROWS - 1)
    for c in range(first, last + 1):
        at = c & (ROWS - 1)
        bits[at // WORD] |= ONE << np.uint64(at & (WORD - 1))
    _mark_columns(free, low, voxel, sines, sensor, reach, views, slot, heights, tilt, bits)


@compiled
def _mark_columns(
    free: UInt64s3,
    low: Ints,
    voxel: float,
    sines: tuple[float, float],
    sensor: Sensor,
    reach: float,
    views: RangeViews,
    slot: int,
    heights: Floats,
    tilt: float,
    bits: UInt64s,
) -> None:
    r, o = sensor.rotation, sensor.origin
    first_a = max(int(np.floor((o[0] - reach) / voxel)), low[0])
    last_a = min(int(np.floor((o[0] + reach) / voxel)), low[0] + COLUMNS - 1)
    first_b = max(int(np.floor((o[1] - reach) / voxel)), low[1])
    last_b = min(int(np.floor((o[1] + reach) / voxel)), low[1] + COLUMNS - 1)
    slack, slope = np.cos(tilt), np.tan(tilt)
    for a in range(first_a, last_a + 1):
        dx = (a + 0.5) * voxel - o[0]
        for b in range(first_b, last_b + 1):
            i, j = np.uint64(a & (COLUMNS - 1)), np.uint64(b & (COLUMNS - 1))
            missing = False
            for word in range(len(bits)):
                missing = missing or (bits[word] & ~free[i, j, np.uint64(word)]) != 0
            if not missing:
                continue
            dy = (b + 0.5) * voxel - o[1]
            level = np.sqrt(dx * dx + dy * dy)
            if level > reach:
                continue
            # The sine of a direction so far up in the sensor's frame: size * sin(up + ahead).
            along = (r[0, 2] * dx + r[1, 2] * dy) / (level + TINY)
            upright = r[2, 2]
            sine, up = along, 0.0
            if along < sines[0] or along > sines[1]:
                sine = min(max(along, sines[0]), sines[1])
                size = np.sqrt(along * along + upright * upright)
                if abs(sine) >= size:
                    continue
                turned = 1.0 if upright >= 0.0 else -1.0  # Upside down it looks up for down.
                up = np.arcsin(turned * sine / size) - np.arctan2(turned * along, turned * upright)
            if np.cos(up) < STEEPEST:
                continue
            dz, distance = level * np.tan(up), level / np.cos(up)
            off = level * slope + abs(dz) * (1.0 - slack)
            if o[2] + dz - off < heights[0] or o[2] + dz + off > heights[1]:
                continue
            if distance < sensor.min_range or distance > reach * slack:
                continue
            x = r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz
            y = r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz
            half = HALF_WIDTH * voxel
            if level <= half:
                continue
            beyond = (distance + half / np.cos(up)) / slack
            if _row_goes_on(x, y, sine, beyond, half / level, views, slot):
                for word in range(len(bits)):
                    free[i, j, np.uint64(word)] |= bits[word]


@compiled
def _row_goes_on(
    x: float, y: float, sine: float, beyond: float, aside: float, views: RangeViews, slot: int
) -> bool:
    """Whether all beams about a direction go on, as far to the side as a voxel is wide and the
    guard.

    aside: sine of half the voxel's width.
    """
    kind = np.uint64(views.kind[slot])
    numbers = views.numbers[kind]
    rows, columns, around = int(numbers[IMAGE_ROWS]), int(numbers[IMAGE_COLUMNS]), numbers[AROUND]
    row = int(np.floor((sine - numbers[BOTTOM]) * numbers[PER_ROW]))
    need = int(100.0 * beyond / (1.0 - numbers[SIN_GAP])) + 1
    half_sine = TILTED * aside + numbers[SIN_GUARD] / np.sqrt(max(1.0 - sine * sine, TINY))
    if row < 0 or row >= rows or half_sine >= 1.0:
        return False
    half_cosine, first = np.sqrt(1.0 - half_sine * half_sine), int(numbers[FIRST])
    j0 = int(column_at(x * half_cosine + y * half_sine, y * half_cosine - x * half_sine, around))
    j1 = int(column_at(x * half_cosine - y * half_sine, y * half_cosine + x * half_sine, around))
    j0, j1 = j0 - first, j1 - first
    if columns < int(around) and (j0 < 0 or j1 >= columns or j1 < j0):
        return False
    if j1 < j0:
        j1 += columns
    stride = len(views.pixels) // len(views.kind)
    beside = int(np.ceil(numbers[SIN_GUARD] * numbers[PER_ROW]))
    for i in range(max(row - beside, 0), min(row + beside + 1, rows)):
        for j in range(j0, j1 + 1):
            at = i * columns + (j if j < columns else j - columns)
            far = int(views.pixels[np.uint64(slot * stride + at)])
            if i == row and far < 0:
                return False
            if (far if far >= 0 else -1 - far) < need:
                return False
    return True
