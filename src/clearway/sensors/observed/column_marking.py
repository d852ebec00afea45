"""Marking what a sweep saw where obstacles are declared to be columns.

Where whatever stands between two heights reaches through all of them, one beam that goes on above
a place at any of these heights shows the place to be free at all. So a scanner of one level plane
shows free space too.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints, UInt64s, UInt64s3
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import TINY
from clearway.sensors.beams.raster import BeamRaster
from clearway.sensors.observed.free_marking import (
    ASIDE_SHARE,
    COLUMNS,
    ROWS,
    TO_LEFT,
    TO_RIGHT,
    BeamField,
    _ends_along,
    _nearest_around,
)
from clearway.sensors.observed.seen_space import ONE, WORD
from clearway.sensors.passing.passed_points import Sensor

STEEPEST = 0.1
"""Cosine of the steepest beam that is looked along: steeper ones show the place overhead alone."""


@compiled
def mark_columns(
    free: UInt64s3,
    low: Ints,
    voxel: float,
    raster: BeamRaster,
    field: BeamField,
    nearest: Floats2,
    sensor: Sensor,
    reach: float,
    short: float,
    heights: Floats,
    tilt: float,
) -> None:
    """Mark the voxels above and below each place that a beam near to level goes beyond.

    heights: [2] between which whatever stands is a column, world frame. tilt: angle by which beams
    may point higher or lower than the pattern says.
    """
    # The bits between the heights: the same in every column.
    bits = np.zeros(free.shape[2], dtype=np.uint64)
    first = max(int(np.ceil(heights[0] / voxel - ASIDE_SHARE)), low[2])
    last = min(int(np.floor(heights[1] / voxel + ASIDE_SHARE)) - 1, low[2] + ROWS - 1)
    for c in range(first, last + 1):
        at = c & (ROWS - 1)
        bits[at // WORD] |= ONE << np.uint64(at & (WORD - 1))
    around = _nearest_around(nearest, raster)
    _mark_columns(free, low, voxel, field, around, sensor, reach, short, heights, tilt, bits)


@compiled
def _mark_columns(
    free: UInt64s3,
    low: Ints,
    voxel: float,
    field: BeamField,
    around: Floats2,
    sensor: Sensor,
    reach: float,
    short: float,
    heights: Floats,
    tilt: float,
    bits: UInt64s,
) -> None:
    r, o = sensor.rotation, sensor.origin
    first_a, last_a = _ends_along(o[0], reach, voxel)
    first_b, last_b = _ends_along(o[1], reach, voxel)
    first_a, last_a = max(first_a, low[0]), min(last_a, low[0] + COLUMNS - 1)
    first_b, last_b = max(first_b, low[1]), min(last_b, low[1] + COLUMNS - 1)
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
            if along < field.least or along > field.most:
                sine = min(max(along, field.least), field.most)
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
            if _goes_beyond(x, y, sine, (distance + short) / slack, around, field):
                for word in range(len(bits)):
                    free[i, j, np.uint64(word)] |= bits[word]


@compiled
def _goes_beyond(
    x: float, y: float, sine: float, beyond: float, around: Floats2, field: BeamField
) -> bool:
    """Whether beams lie about a direction that some beam has the sine of, and all go on."""
    aside = abs(x) + abs(y)
    if not field.behind and (x < 0.0 or y < field.right * aside or y > field.left * aside):
        return False
    forward = y / (aside + TINY)
    turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
    column = (turned + 2.0) * field.per_column
    at = min(int(column), around.shape[0] - 1)
    row = int((sine - field.bottom) * field.per_row)
    if row < 0 or row >= around.shape[1]:
        return False
    j, k = np.uint64(at), np.uint64(row)
    if around[j, k] < beyond or field.lowest[j, k] == np.inf:
        return False
    return bool(field.beside[j, k] & (TO_RIGHT if column - at < 0.5 else TO_LEFT))
