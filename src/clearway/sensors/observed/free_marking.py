"""Marking what a range view shows: voxels in which something may be free."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Int16s, Ints, UInt64s3
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import TINY
from clearway.sensors.observed.free_voxels import EVERY, HALF_DIAGONAL, ONE, WORD, bits_from
from clearway.sensors.observed.range_views import NONE, RangeViews, may_show, pixel_at
from clearway.sensors.observed.view_shape import (
    AROUND,
    COS_GUARD,
    FARTHEST,
    IMAGE_COLUMNS,
    IMAGE_ROWS,
)

COLUMNS = 256
ROWS = 128
"""Voxels of the window along each horizontal axis, and along the vertical: powers of two."""
ROLL_WITHIN = 8
"""The window follows once the vehicle is off its middle by this part of its width."""
WITHIN = 0.5 - 1.0 / ROLL_WITHIN
"""Part of the window's width that is always there on either side of the vehicle."""
NEAR_GUARD = 0.9
"""Share of the guard that is near: rows and columns of an image are not all of one width."""
SIDE = 4
"""Voxels along each side of a block: one that is marked, or out of sight, is passed over as one."""


@compiled
def mark(
    free: UInt64s3, low: Ints, voxel: float, reach: float, views: RangeViews, slot: int
) -> None:
    """Mark the voxels past whose middle all beams of a view go; others were seen before."""
    about, pose, block = nearest_about(views, slot), views.pose[slot], SIDE * voxel
    around = HALF_DIAGONAL * block
    first_a, last_a = _blocks_along(pose[9], reach, block)
    first_b, last_b = _blocks_along(pose[10], reach, block)
    first_c, last_c = _blocks_along(pose[11], min(reach, WITHIN * ROWS * voxel), block)
    # A sensor off the vehicle's middle sees beyond the window: a bit there is one at its other end.
    first_a, last_a = max(first_a, -(-low[0] // SIDE)), min(last_a, (low[0] + COLUMNS) // SIDE - 1)
    first_b, last_b = max(first_b, -(-low[1] // SIDE)), min(last_b, (low[1] + COLUMNS) // SIDE - 1)
    first_c, last_c = max(first_c, -(-low[2] // SIDE)), min(last_c, (low[2] + ROWS) // SIDE - 1)
    for a in range(first_a, last_a + 1):
        x = (a + 0.5) * block
        for b in range(first_b, last_b + 1):
            y = (b + 0.5) * block
            if np.sqrt((x - pose[9]) ** 2 + (y - pose[10]) ** 2) - around > reach:
                continue
            for c in range(first_c, last_c + 1):
                z = (c + 0.5) * block
                if not _is_block_marked(free, a, b, c) and may_show(views, slot, x, y, z, around):
                    _mark_voxels_of(free, voxel, (a, b, c), views, slot, about)


@compiled
def _blocks_along(origin: float, far: float, block: float) -> tuple[int, int]:
    """First and last block within a distance along an axis."""
    return int(np.floor((origin - far) / block)), int(np.floor((origin + far) / block))


@compiled
def _is_block_marked(free: UInt64s3, a: int, b: int, c: int) -> bool:
    at = (SIDE * c) & (ROWS - 1)
    word, bits, every = np.uint64(at // WORD), bits_from(at, SIDE), EVERY
    for i in range(SIDE * a, SIDE * a + SIDE):
        for j in range(SIDE * b, SIDE * b + SIDE):
            every &= free[np.uint64(i & (COLUMNS - 1)), np.uint64(j & (COLUMNS - 1)), word]
    return bool((every & bits) == bits)


@compiled
def _mark_voxels_of(
    free: UInt64s3,
    voxel: float,
    block: tuple[int, int, int],
    views: RangeViews,
    slot: int,
    about: Int16s,
) -> None:
    """Mark those of a block past whose middle all beams go."""
    c0 = SIDE * block[2]
    at = c0 & (ROWS - 1)
    word = np.uint64(at // WORD)
    for a in range(SIDE * block[0], SIDE * block[0] + SIDE):
        for b in range(SIDE * block[1], SIDE * block[1] + SIDE):
            i, j = np.uint64(a & (COLUMNS - 1)), np.uint64(b & (COLUMNS - 1))
            marked = free[i, j, word]
            for n in range(SIDE):
                bit = ONE << np.uint64((at & (WORD - 1)) + n)
                x, y, z = (a + 0.5) * voxel, (b + 0.5) * voxel, (c0 + n + 0.5) * voxel
                if marked & bit == 0 and go_by(views, slot, about, x, y, z):
                    marked |= bit
            free[i, j, word] = marked


@compiled
def nearest_about(views: RangeViews, slot: int) -> Int16s:
    """How far all beams about each pixel of a view go on: what shows any ball there asks as many.

    Between beams lie pixels that none looks through, and a return may get lost: one pixel alone
    would tell that what stands behind a wall was seen.
    """
    kind = np.uint64(views.kind[slot])
    numbers, toward = views.numbers[kind], views.directions[kind]
    rows, columns = int(numbers[IMAGE_ROWS]), int(numbers[IMAGE_COLUMNS])
    start, whole = slot * (len(views.pixels) // len(views.kind)), columns == int(numbers[AROUND])
    per_column, cos_near = numbers[AROUND] / (2.0 * np.pi), numbers[COS_GUARD]
    cos_near = np.cos(NEAR_GUARD * np.arccos(cos_near))
    image = np.empty(rows * columns, dtype=np.int16)
    for n in range(rows * columns):
        far = views.pixels[np.uint64(start + n)]
        image[n] = far if far >= 0 else -1 - far
    about = np.full(rows * columns, FARTHEST, dtype=np.int16)
    for i in range(rows):
        sine, cosine = toward[2 * columns + i], toward[2 * columns + rows + i]
        for k in range(rows):
            level = cosine * toward[2 * columns + rows + k]
            turned = (cos_near - sine * toward[2 * columns + k]) / (level + TINY)
            if turned > 1.0:
                continue
            beside = int(np.arccos(max(turned, -1.0)) * per_column)
            beside = min(beside, (columns - 1) // 2 if whole else columns - 1)
            for shift in range(-beside, beside + 1):
                _keep_nearer(about, i * columns, image, k * columns, columns, shift)
                if whole and shift != 0:
                    across = shift - columns if shift > 0 else shift + columns
                    _keep_nearer(about, i * columns, image, k * columns, columns, across)
    for n in range(rows * columns):
        if views.pixels[np.uint64(start + n)] < 0:
            about[n] = -1
    return about


@compiled
def _keep_nearer(into: Int16s, at: int, image: Int16s, beside: int, columns: int, by: int) -> None:
    """Take what is less in a row so many columns to the side, as far as there are any."""
    for j in range(max(-by, 0), columns - max(by, 0)):
        here, there = np.uint64(at + j), np.uint64(beside + by + j)
        into[here] = min(into[here], image[there])


@compiled
def go_by(views: RangeViews, slot: int, about: Int16s, x: float, y: float, z: float) -> bool:
    """Whether all beams about a place go on beyond it; about: `nearest_about`."""
    v = np.uint64(slot)
    pose = views.pose
    dx, dy, dz = x - pose[v, 9], y - pose[v, 10], z - pose[v, 11]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    if distance > views.limits[v, 1] or distance < views.limits[v, 0]:
        return False
    a = pose[v, 0] * dx + pose[v, 3] * dy + pose[v, 6] * dz
    b = pose[v, 1] * dx + pose[v, 4] * dy + pose[v, 7] * dz
    c = pose[v, 2] * dx + pose[v, 5] * dy + pose[v, 8] * dz
    at = pixel_at(views.numbers[np.uint64(views.kind[v])], (a, b, c), distance + TINY)
    return at != NONE and bool(about[at] >= 100.0 * distance)
