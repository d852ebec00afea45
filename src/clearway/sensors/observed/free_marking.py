"""Marking what a sweep saw: the voxels whose middle lies between beams that all go on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2, Ints, UInt8s2, UInt64s3
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import TINY
from clearway.sensors.beams.raster import BeamRaster
from clearway.sensors.observed.seen_space import ONE, WORD, bits_from
from clearway.sensors.passing.passed_points import Sensor

COLUMNS, ROWS = 256, 128
"""Voxels of the window along each horizontal axis, and along the vertical: powers of two."""
ROLL_WITHIN = 8
"""The window follows once the vehicle is off its middle by this part of its width."""
WITHIN = 0.5 - 1.0 / ROLL_WITHIN
"""Part of the window's width that is always there on either side of the vehicle."""
TO_RIGHT, TO_LEFT = np.uint8(1), np.uint8(2)
ASIDE_SHARE = 1e-6
"""Share of the reach by which a column lies aside at least of what beams see, to be passed over."""


class BeamField(NamedTuple):
    """Where beams of a pattern lie about a direction, in the bins of its raster."""

    lowest: Floats2
    """[columns, rows] sine below which nobody looks in a bin: -inf where there are beams below it
    as well, and inf where there are none in it."""
    highest: Floats2
    """[columns, rows] likewise above which."""
    beside: UInt8s2
    """[columns, rows] TO_RIGHT, TO_LEFT or both: whether beams lie in the columns beside."""
    per_column: float
    """As of the raster."""
    per_row: float
    bottom: float
    least: float
    """Sine of the lowest beam of all."""
    most: float
    """Sine of the highest."""
    behind: bool
    """Whether any beam looks behind."""
    right: float
    """Of those that look ahead, y over |x| + |y| at the edge of the rightmost bin."""
    left: float


@compiled
def field_of(raster: BeamRaster) -> BeamField:
    """Of all beams of a raster."""
    lowest, highest = np.full(raster.low.shape, np.inf), np.full(raster.low.shape, -np.inf)
    beside = np.zeros(raster.low.shape, dtype=np.uint8)
    least, most, behind, right, left = np.inf, -np.inf, False, np.inf, -np.inf
    columns, rows = raster.low.shape
    for j in range(columns):
        for k in range(rows):
            if raster.low[j, k] < np.inf:
                least, most = min(least, raster.low[j, k]), max(most, raster.high[j, k])
                behind = behind or abs((j + 0.5) / raster.per_column - 2.0) > 1.0
                right = min(right, j / raster.per_column - 2.0 - 1e-9)
                left = max(left, (j + 1) / raster.per_column - 2.0 + 1e-9)
                # Beyond the outermost beams of the pattern nobody looks.
                outer = k == 0 or raster.low[j, k - 1] == np.inf
                lowest[j, k] = raster.low[j, k] if outer else -np.inf
                outer = k + 1 == rows or raster.low[j, k + 1] == np.inf
                highest[j, k] = raster.high[j, k] if outer else np.inf
            if _has_beams(raster, (j - 1) % columns, k):
                beside[j, k] |= TO_RIGHT
            if _has_beams(raster, (j + 1) % columns, k):
                beside[j, k] |= TO_LEFT
    per_column, per_row, bottom = raster.per_column, raster.per_row, raster.bottom
    bins = (lowest, highest, beside, per_column, per_row, bottom)
    return BeamField(*bins, least, most, behind, right, left)


@compiled
def _has_beams(raster: BeamRaster, column: int, row: int) -> bool:
    """Whether there are beams in a column at about a row."""
    for k in range(max(row - 1, 0), min(row + 2, raster.low.shape[1])):
        if raster.low[column, k] < np.inf:
            return True
    return False


@compiled
def _nearest_around(nearest: Floats2, raster: BeamRaster) -> Floats2:
    """[columns, rows] range of the nearest return in a bin and in those around it, as many columns
    as lie within one bin's width there."""
    by_rows, around = nearest.copy(), np.empty(nearest.shape)
    windows = np.empty(nearest.shape[1], dtype=np.int64)
    _take_nearest(nearest, raster.bottom, raster.per_row, by_rows, windows, around)
    return around


@compiled
def _take_nearest(
    nearest: Floats2,
    bottom: float,
    per_row: float,
    by_rows: Floats2,
    windows: Ints,
    around: Floats2,
) -> None:
    """Fill in `_nearest_around`, by the nearest of three rows and by columns to either side."""
    columns, rows = nearest.shape
    widest = 0
    for j in range(columns):
        for k in range(1, rows):
            by_rows[j, k] = min(nearest[j, k], nearest[j, k - 1])
        for k in range(rows - 1):
            by_rows[j, k] = min(by_rows[j, k], nearest[j, k + 1])
    for k in range(rows):
        sine = min(1.0, abs(bottom + (k + 0.5) / per_row))
        cosine = np.sqrt(1.0 - sine * sine)
        windows[k] = 8 if cosine * 8.0 < 1.0 else int(np.ceil(1.0 / cosine))
        widest = max(widest, windows[k])
    for j in range(columns):
        for k in range(rows):
            around[j, k] = by_rows[j, k]
        for shift in range(-widest, widest + 1):
            beside = (j + shift) % columns
            for k in range(rows):
                near = by_rows[beside, k] if abs(shift) <= windows[k] else np.inf
                around[j, k] = min(around[j, k], near)


@compiled
def mark(
    free: UInt64s3,
    low: Ints,
    voxel: float,
    raster: BeamRaster,
    field: BeamField,
    nearest: Floats2,
    sensor: Sensor,
    reach: float,
    short: float,
) -> None:
    """Mark the voxels that a sweep saw: those whose middle lies between beams that all go on.

    Between neighbouring beams a voxel counts as crossed: what hides there is thinner than beams
    are apart. What was seen before is passed over.
    """
    _mark_passed(free, low, voxel, field, _nearest_around(nearest, raster), sensor, reach, short)


@compiled
def _mark_passed(
    free: UInt64s3,
    low: Ints,
    voxel: float,
    field: BeamField,
    around: Floats2,
    sensor: Sensor,
    reach: float,
    short: float,
) -> None:
    r, o = sensor.rotation, sensor.origin
    ox, oy, oz = o[0], o[1], o[2]
    first_a, last_a = _ends_along(ox, reach, voxel)
    first_b, last_b = _ends_along(oy, reach, voxel)
    first_c, last_c = _ends_along(oz, min(reach, (WITHIN * ROWS - 1.0) * voxel), voxel)
    # A sensor off the vehicle's middle sees beyond the window: a bit there is one at its other end.
    first_a, last_a = max(first_a, low[0]), min(last_a, low[0] + COLUMNS - 1)
    first_b, last_b = max(first_b, low[1]), min(last_b, low[1] + COLUMNS - 1)
    first_c, last_c = max(first_c, low[2]), min(last_c, low[2] + ROWS - 1)
    near2, far2 = sensor.min_range**2, reach * reach
    lowest, highest, behind = field.least, field.most, field.behind
    right, left = field.right, field.left
    below, above = _slopes(lowest, highest, r[2, 2])
    r00, r01, r02 = r[0, 0], r[0, 1], r[0, 2]
    r10, r11, r12 = r[1, 0], r[1, 1], r[1, 2]
    r20, r21, r22 = r[2, 0], r[2, 1], r[2, 2]
    # Of a plane through the outermost beams to a side, y over x and how that changes with height.
    to_left, to_right = abs(left) < 1.0 and not behind, abs(right) < 1.0 and not behind
    aside_left = left / (1.0 - abs(left)) if to_left else 0.0
    aside_right = right / (1.0 - abs(right)) if to_right else 0.0
    slope_left, slope_right = aside_left * r20 - r21, r21 - aside_right * r20
    # Columns that lie beyond it by so much do so at any height.
    beyond_x = -(abs(r20) + ASIDE_SHARE) * reach
    beyond_left = -(abs(slope_left) + ASIDE_SHARE) * reach
    beyond_right = -(abs(slope_right) + ASIDE_SHARE) * reach
    for a in range(first_a, last_a + 1):
        dx = (a + 0.5) * voxel - ox
        for b in range(first_b, last_b + 1):
            dy = (b + 0.5) * voxel - oy
            level2 = dx * dx + dy * dy
            if level2 > far2:
                continue
            x0, z0 = r00 * dx + r10 * dy, r02 * dx + r12 * dy
            y0 = r01 * dx + r11 * dy
            if not behind and x0 < beyond_x:
                continue
            if to_left and aside_left * x0 - y0 < beyond_left:
                continue
            if to_right and y0 - aside_right * x0 < beyond_right:
                continue
            level, tall = np.sqrt(level2), np.sqrt(far2 - level2)
            bottom = max(-tall, below * level) if below > -np.inf else -tall
            top = min(tall, above * level) if above < np.inf else tall
            if not behind:  # Ahead, and between the outermost beams to either side.
                bottom, top = _above_zero(bottom, top, x0, r20, reach)
                if to_left:
                    value = aside_left * x0 - y0
                    bottom, top = _above_zero(bottom, top, value, slope_left, reach)
                if to_right:
                    value = y0 - aside_right * x0
                    bottom, top = _above_zero(bottom, top, value, slope_right, reach)
                if top < bottom - 2.0 * voxel:
                    continue
            # One voxel more on either side than need be: what decides is asked of each of them.
            c0 = max(first_c, int(np.floor((oz + bottom) / voxel)) - 1)
            c1 = min(last_c, int(np.floor((oz + top) / voxel)) + 1)
            i, j = np.uint64(a & (COLUMNS - 1)), np.uint64(b & (COLUMNS - 1))
            c = c0
            while c <= c1:
                first = c & (ROWS - 1)
                count = min(c1 - c + 1, WORD - (first & (WORD - 1)))
                word, fresh = np.uint64(first // WORD), np.uint64(0)
                missing = bits_from(first, count) & ~free[i, j, word]
                for n in range(count):
                    if missing == 0:
                        break
                    bit = ONE << np.uint64((first & (WORD - 1)) + n)
                    if missing & bit == 0:
                        continue
                    missing ^= bit
                    dz = (c + n + 0.5) * voxel - oz
                    x, squared = x0 + r20 * dz, level2 + dz * dz
                    if squared > far2 or squared < near2 or (x < 0.0 and not behind):
                        continue
                    z, distance = z0 + r22 * dz, np.sqrt(squared)
                    if z < lowest * distance or z > highest * distance:
                        continue
                    y = y0 + r21 * dz
                    aside = abs(x) + abs(y)
                    if not behind and (y < right * aside or y > left * aside):
                        continue
                    if _goes_on(x, y, z, distance, short, around, field):
                        fresh |= bit
                free[i, j, word] |= fresh
                c += count


@compiled
def _ends_along(origin: float, far: float, voxel: float) -> tuple[int, int]:
    """First and last voxel within a distance along an axis."""
    return int(np.floor((origin - far) / voxel)), int(np.floor((origin + far) / voxel))


@compiled
def _above_zero(
    bottom: float, top: float, value: float, slope: float, reach: float
) -> tuple[float, float]:
    """The part of an interval in which `value` + `slope` times the place is not below 0; where it
    is so nowhere, one that ends before it begins."""
    if slope > 1e-9:
        return max(bottom, -value / slope), top
    if slope < -1e-9:
        return bottom, min(top, -value / slope)
    return (bottom, top) if value >= -1e-6 * reach else (bottom, -np.inf)


@compiled
def _slopes(lowest: float, highest: float, upright: float) -> tuple[float, float]:
    """Least and greatest height over level distance that beams reach, from the sines of the lowest
    and highest one and the cosine of the sensor's tilt; infinite where some look straight up."""
    tilt = np.arccos(min(1.0, max(-1.0, upright))) + 1e-6
    low = np.arcsin(min(1.0, max(-1.0, lowest))) - tilt
    high = np.arcsin(min(1.0, max(-1.0, highest))) + tilt
    steep = 0.5 * np.pi - 1e-3
    below = -np.inf if low <= -steep else np.tan(min(low, steep))
    above = np.inf if high >= steep else np.tan(max(high, -steep))
    return below, above


@compiled
def _goes_on(
    x: float,
    y: float,
    z: float,
    distance: float,
    short: float,
    around: Floats2,
    field: BeamField,
) -> bool:
    """Whether beams lie about a direction, and all of them go on beyond a distance."""
    sine = z / (distance + TINY)
    row = (sine - field.bottom) * field.per_row
    if row < 0.0 or row >= around.shape[1]:
        return False
    forward = y / (abs(x) + abs(y) + TINY)
    turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
    column = (turned + 2.0) * field.per_column
    at = min(int(column), around.shape[0] - 1)
    j, k = np.uint64(at), np.uint64(int(row))
    if around[j, k] < distance + short or sine < field.lowest[j, k] or sine > field.highest[j, k]:
        return False
    return bool(field.beside[j, k] & (TO_RIGHT if column - at < 0.5 else TO_LEFT))
