"""Range views: what single scans show to be free, asked ball by ball.

A scan becomes an image of how far its beams go on, with a pyramid of minima above it. A ball is
free if in some view every beam about it goes on beyond it.

Notes
-----
The gap is the greatest angle from a direction that is looked at to the nearest beam. Let a thing
reach into the ball at a place p, and be at least as wide as the gap spans there on either side.
It then holds a ball that touches p and spans the gap, in the middle of which some beam lies within
the gap: so within two gaps of p, the guard. If that beam goes on beyond the thing, it met it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Int16s, Ints
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import TINY
from clearway.sensors.observed.view_shape import (
    AROUND,
    BOTTOM,
    COS_GAP,
    COS_GUARD,
    COS_HALF,
    FIRST,
    IMAGE_COLUMNS,
    IMAGE_ROWS,
    LEFT_X,
    LEFT_Y,
    NUMBERS,
    PER_ROW,
    RIGHT_X,
    RIGHT_Y,
    SIN_GAP,
    SIN_GUARD,
    SIN_HALF,
    column_at,
)

LEVELS = 6
"""Of the pyramid: an entry of the highest one is the least of 32 times 32 pixels."""
NONE = -1
"""No view."""


class RangeViews(NamedTuple):
    """Views in slots, and those of them that are asked."""

    pixels: Int16s
    """[slots * stride] pyramids, one after the other: centimetres, see `ViewShape.clear`."""
    pose: Floats2
    """[slots, 12] rotation of the world from the sensor, row by row, and place of the sensor."""
    limits: Floats2
    """[slots, 2] nearest and farthest distance (m) at which a view shows anything."""
    kind: Ints
    """[slots] which shape."""
    numbers: Floats2
    """[shapes, NUMBERS] of `ViewShape`."""
    directions: Floats2
    """[shapes, n] of `ViewShape`; shorter ones end with zeros."""
    asked: Ints
    """[views] slots, the newest first."""
    last: Ints
    """[1] the slot that showed a ball last: asked first."""


NO_VIEWS = RangeViews(
    np.zeros(1, np.int16),
    np.zeros((1, 12)),
    np.zeros((1, 2)),
    np.zeros(1, np.int64),
    np.zeros((1, NUMBERS)),
    np.zeros((1, 1)),
    np.zeros(0, np.int64),
    np.zeros(1, np.int64),
)


class Aim(NamedTuple):
    """A ball as one view sees it."""

    level_x: float
    """Level direction of its middle, of length 1."""
    level_y: float
    sine: float
    """Of its elevation."""
    cosine: float
    distance: float
    radius: float
    cover: float
    """Cosine of the angle within which pixels must be looked at, half a pixel more than need be."""
    beams: float
    """Cosine of the angle within which beams must go on, likewise."""
    need: int
    """How far, in centimetres."""
    own: float
    """Radius of a ball about the sensor that counts as free."""


@compiled
def pyramid_size(rows: int, columns: int) -> int:
    """Entries of a pyramid."""
    size = 0
    for level in range(LEVELS):
        size += entries_along(rows, level) * entries_along(columns, level)
    return size


@compiled
def entries_along(pixels: int, level: int) -> int:
    """Entries of a level along an axis."""
    return (pixels + (1 << level) - 1) >> level


@compiled
def raise_pyramid(image: Int16s, rows: int, columns: int) -> None:
    """Fill in the levels above an image [rows * columns]: each entry the least of four below."""
    below, at = 0, rows * columns
    for level in range(1, LEVELS):
        high, wide = entries_along(rows, level - 1), entries_along(columns, level - 1)
        for i in range(entries_along(rows, level)):
            under = below + 2 * i * wide
            over = under + wide if 2 * i + 1 < high else under
            half = wide // 2
            for j in range(half):
                first = np.uint64(under + 2 * j)
                second = np.uint64(over + 2 * j)
                one = np.uint64(1)
                image[np.uint64(at + j)] = min(
                    min(image[first], image[first + one]), min(image[second], image[second + one])
                )
            if wide % 2:
                image[at + half] = min(image[under + wide - 1], image[over + wide - 1])
            at += half + wide % 2
        below += high * wide


@compiled
def first_showing(
    views: RangeViews, window: Floats, x: float, y: float, z: float, radius: float
) -> int:
    """The slot of a view that shows a ball in the world to be free; NONE without any.

    window: of a `SeenSpace`.
    """
    if len(views.asked) == 0:
        return NONE
    last: int = views.last[0]
    if last != NONE and shows_ball(views, last, window, x, y, z, radius):
        return last
    for slot in views.asked:
        if slot != last and shows_ball(views, slot, window, x, y, z, radius):
            views.last[0] = slot
            return int(slot)
    return NONE


@compiled
def shows_ball(
    views: RangeViews, slot: int, window: Floats, x: float, y: float, z: float, radius: float
) -> bool:
    """Whether one view shows a ball in the world to be free."""
    v = np.uint64(slot)
    pose, numbers = views.pose, views.numbers
    dx, dy, dz = x - pose[v, 9], y - pose[v, 10], z - pose[v, 11]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    kind = np.uint64(views.kind[v])
    need = (distance + radius) / (1.0 - numbers[kind, SIN_GAP])
    if need > views.limits[v, 1] or distance <= radius:
        return False
    own = 0.0
    if window[7] > 0.0:
        ox, oy, oz = pose[v, 9] - window[4], pose[v, 10] - window[5], pose[v, 11] - window[6]
        own = window[7] - np.sqrt(ox * ox + oy * oy + oz * oz)
    if distance - radius < views.limits[v, 0] and own < views.limits[v, 0]:
        return False
    a = pose[v, 0] * dx + pose[v, 3] * dy + pose[v, 6] * dz
    b = pose[v, 1] * dx + pose[v, 4] * dy + pose[v, 7] * dz
    c = pose[v, 2] * dx + pose[v, 5] * dy + pose[v, 8] * dz
    if own <= 0.0 and _is_hidden(views, slot, (a, b, c), distance, 100.0 * need):
        return False  # Most are told by the one pixel that their middle lies in.
    # The ball's angular radius, and with the gap and the guard about it.
    sine_r = radius / distance
    cosine_r = np.sqrt(1.0 - sine_r * sine_r)
    sin_gap, cos_gap = numbers[kind, SIN_GAP], numbers[kind, COS_GAP]
    sin_guard, cos_guard = numbers[kind, SIN_GUARD], numbers[kind, COS_GUARD]
    sin_cover, cos_cover = (
        sine_r * cos_gap + cosine_r * sin_gap,
        cosine_r * cos_gap - sine_r * sin_gap,
    )
    sin_beams = sine_r * cos_guard + cosine_r * sin_guard
    cos_beams = cosine_r * cos_guard - sine_r * sin_guard
    sin_half, cos_half = numbers[kind, SIN_HALF], numbers[kind, COS_HALF]
    beams = cos_beams * cos_half - sin_beams * sin_half
    if beams <= 0.0:
        return False
    sine = c / distance
    level = np.sqrt(a * a + b * b)
    cosine = level / distance
    aim = Aim(
        a / (level + TINY),
        b / (level + TINY),
        sine,
        cosine,
        distance,
        radius,
        cos_cover * cos_half - sin_cover * sin_half,
        beams,
        int(100.0 * need) + 1,
        own,
    )
    return _is_shown(views, slot, aim, (sin_cover, cos_cover), (sin_beams, cos_beams))


@compiled
def may_show(views: RangeViews, slot: int, x: float, y: float, z: float, radius: float) -> bool:
    """Whether any of a ball may lie within the limits of a view and its image."""
    v = np.uint64(slot)
    pose, numbers = views.pose, views.numbers[np.uint64(views.kind[v])]
    dx, dy, dz = x - pose[v, 9], y - pose[v, 10], z - pose[v, 11]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    if distance - radius > views.limits[v, 1]:
        return False
    a = pose[v, 0] * dx + pose[v, 3] * dy + pose[v, 6] * dz
    b = pose[v, 1] * dx + pose[v, 4] * dy + pose[v, 7] * dz
    c = pose[v, 2] * dx + pose[v, 5] * dy + pose[v, 8] * dz
    # How far off the cones through the lowest and highest row, and the planes through the sides.
    low = max(numbers[BOTTOM], -1.0)
    high = min(numbers[BOTTOM] + numbers[IMAGE_ROWS] / numbers[PER_ROW], 1.0)
    level = np.sqrt(a * a + b * b)
    if c * np.sqrt(1.0 - high * high) - level * high > radius:
        return False
    if level * low - c * np.sqrt(1.0 - low * low) > radius:
        return False
    if numbers[IMAGE_COLUMNS] == numbers[AROUND]:
        return True
    right = numbers[RIGHT_X] * b - numbers[RIGHT_Y] * a
    left = numbers[LEFT_Y] * a - numbers[LEFT_X] * b
    wide = numbers[RIGHT_X] * numbers[LEFT_Y] - numbers[RIGHT_Y] * numbers[LEFT_X] < 0.0
    return bool((max(right, left) if wide else min(right, left)) > -radius)


@compiled
def pixel_at(numbers: Floats, to: tuple[float, float, float], distance: float) -> int:
    """The pixel of a direction of the sensor's frame; NONE where the image has none."""
    row = int(np.floor((to[2] / distance - numbers[BOTTOM]) * numbers[PER_ROW]))
    if row < 0 or row >= int(numbers[IMAGE_ROWS]):
        return NONE
    column = int(column_at(to[0], to[1], numbers[AROUND])) - int(numbers[FIRST])
    columns = int(numbers[IMAGE_COLUMNS])
    return NONE if column < 0 or column >= columns else row * columns + column


@compiled
def _is_hidden(
    views: RangeViews, slot: int, to: tuple[float, float, float], distance: float, need: float
) -> bool:
    """Whether the one pixel of a direction of the sensor's frame is none of the image, or ends
    sooner than need be."""
    at = pixel_at(views.numbers[np.uint64(views.kind[slot])], to, distance)
    stride = len(views.pixels) // len(views.kind)
    return at == NONE or bool(views.pixels[np.uint64(slot * stride + at)] < need)


@compiled
def _exit(aim: Aim, cosine: float) -> float:
    """How far off a ball ends at most, in directions at least so far off its middle's: by the
    cosine of that angle."""
    sine2 = 1.0 - cosine * cosine
    left = aim.radius * aim.radius - aim.distance * aim.distance * sine2
    return float(aim.distance * cosine + np.sqrt(max(left, 0.0)))


@compiled
def _is_shown(
    views: RangeViews,
    slot: int,
    aim: Aim,
    cover: tuple[float, float],
    beams: tuple[float, float],
) -> bool:
    """Whether all pixels about a ball go on; sine and cosine of its radius with the gap about it,
    within which pixels must be looked at, and with the guard, within which beams must go on."""
    kind = np.uint64(views.kind[slot])
    numbers = views.numbers[kind]
    rows, columns, around = int(numbers[IMAGE_ROWS]), int(numbers[IMAGE_COLUMNS]), numbers[AROUND]
    bottom, per_row, first = numbers[BOTTOM], numbers[PER_ROW], int(numbers[FIRST])
    sine, cosine = aim.sine, aim.cosine
    # Rows: the part of the ball beyond the lowest and highest may lie in what counts as free.
    lowest = sine * cover[1] - cosine * cover[0] if -sine < cover[1] else -1.0
    highest = sine * cover[1] + cosine * cover[0] if sine < cover[1] else 1.0
    top = bottom + rows / per_row
    if lowest < bottom and not _is_own_beyond(aim, bottom, sine > bottom, numbers):
        return False
    if highest > top and not _is_own_beyond(aim, top, sine < top, numbers):
        return False
    lowest = sine * beams[1] - cosine * beams[0] if -sine < beams[1] else -1.0
    highest = sine * beams[1] + cosine * beams[0] if sine < beams[1] else 1.0
    k0 = max(int(np.floor((lowest - bottom) * per_row)), 0)
    k1 = min(int(np.floor((highest - bottom) * per_row)), rows - 1)
    # Columns.
    whole = columns == int(around)
    if cosine <= beams[0]:  # Straight up or down is within.
        if not whole:
            return False
        return _all_go_on(views, slot, aim, (k0, k1, 0, columns - 1))
    if not whole:
        aside = _aside(aim, numbers)
        off = np.sqrt(max(1.0 - max(aside, 0.0) ** 2, 0.0))
        if aside < cover[0] and not _is_own(aim, off, numbers[COS_GAP], numbers[SIN_GAP]):
            return False
    half_sine = beams[0] / cosine
    half_cosine = np.sqrt(max(1.0 - half_sine * half_sine, 0.0))
    x, y = aim.level_x, aim.level_y
    j0 = int(column_at(x * half_cosine + y * half_sine, y * half_cosine - x * half_sine, around))
    j1 = int(column_at(x * half_cosine - y * half_sine, y * half_cosine + x * half_sine, around))
    j0, j1 = j0 - first, j1 - first
    if not whole:
        if j1 < j0:  # One end lies behind, where the image has ended.
            j0, j1 = (0, j1) if y < 0.0 else (j0, columns - 1)
        return _all_go_on(views, slot, aim, (k0, k1, max(j0, 0), min(j1, columns - 1)))
    if j0 <= j1:
        return _all_go_on(views, slot, aim, (k0, k1, j0, j1))
    if not _all_go_on(views, slot, aim, (k0, k1, j0, columns - 1)):
        return False
    return _all_go_on(views, slot, aim, (k0, k1, 0, j1))


@compiled
def _is_own_beyond(aim: Aim, edge: float, inside: bool, numbers: Floats) -> bool:
    """Whether what lies of a ball beyond a row, by its sine, counts as free."""
    off = 1.0
    if inside:
        off = min(aim.sine * edge + aim.cosine * np.sqrt(max(1.0 - edge * edge, 0.0)), 1.0)
    return _is_own(aim, off, numbers[COS_GAP], numbers[SIN_GAP])


@compiled
def _is_own(aim: Aim, off: float, cos_about: float, sin_about: float) -> bool:
    """Whether what lies of a ball in directions off its middle's, by the cosine of that angle or by
    so much less, counts as free."""
    if aim.own <= 0.0:
        return False
    sine = np.sqrt(max(1.0 - off * off, 0.0))
    turned = sine * cos_about - off * sin_about
    return _exit(aim, off * cos_about + sine * sin_about if turned > 0.0 else 1.0) <= aim.own


@compiled
def _aside(aim: Aim, numbers: Floats) -> float:
    """Sine of the angle by which a ball's middle lies within an image's sides; negative beyond."""
    right = numbers[RIGHT_X] * aim.level_y - numbers[RIGHT_Y] * aim.level_x
    left = numbers[LEFT_Y] * aim.level_x - numbers[LEFT_X] * aim.level_y
    # Sides more than half a circle apart: within is what lies within either of them.
    wide = numbers[RIGHT_X] * numbers[LEFT_Y] - numbers[RIGHT_Y] * numbers[LEFT_X] < 0.0
    return float((max(right, left) if wide else min(right, left)) * aim.cosine)


@compiled
def _all_go_on(views: RangeViews, slot: int, aim: Aim, box: tuple[int, int, int, int]) -> bool:
    """Whether all pixels of some rows and columns, as far as they lie about a ball, go on."""
    k0, k1, j0, j1 = box
    kind = np.uint64(views.kind[slot])
    rows, columns = int(views.numbers[kind, IMAGE_ROWS]), int(views.numbers[kind, IMAGE_COLUMNS])
    stride = len(views.pixels) // len(views.kind)
    at, need, k, j = slot * stride, aim.need, (k0 + k1) // 2, (j0 + j1) // 2
    # Most balls that are hidden are so at their middle or at one of their ends.
    for row, column in ((k, j), (k0, j), (k1, j), (k, j0), (k, j1)):
        if views.pixels[np.uint64(at + row * columns + column)] < need and not _pixels_go_on(
            views, slot, aim, (row, row), (column, column)
        ):
            return False
    narrow, level = min(k1 - k0, j1 - j0) + 1, 0
    high, wide = rows, columns
    while level < LEVELS - 1 and (4 << level) <= narrow:
        at += high * wide
        level += 1
        high, wide = entries_along(rows, level), entries_along(columns, level)
    for i in range(k0 >> level, (k1 >> level) + 1):
        for j in range(j0 >> level, (j1 >> level) + 1):
            if views.pixels[np.uint64(at + i * wide + j)] >= need:
                continue
            size = 1 << level
            one = max(k0, i * size), min(k1, (i + 1) * size - 1)
            two = max(j0, j * size), min(j1, (j + 1) * size - 1)
            if not _pixels_go_on(views, slot, aim, one, two):
                return False
    return True


@compiled
def _pixels_go_on(
    views: RangeViews, slot: int, aim: Aim, across: tuple[int, int], along: tuple[int, int]
) -> bool:
    """The same of single pixels: those in the corners of the box are not about the ball."""
    kind = np.uint64(views.kind[slot])
    rows, columns = int(views.numbers[kind, IMAGE_ROWS]), int(views.numbers[kind, IMAGE_COLUMNS])
    stride, toward = len(views.pixels) // len(views.kind), views.directions[kind]
    # A pixel's half, and the gap: as near the ball's middle as something seen in it may touch.
    numbers = views.numbers[kind]
    cos_about = numbers[COS_HALF] * numbers[COS_GAP] - numbers[SIN_HALF] * numbers[SIN_GAP]
    sin_about = numbers[SIN_HALF] * numbers[COS_GAP] + numbers[COS_HALF] * numbers[SIN_GAP]
    for i in range(across[0], across[1] + 1):
        row_sine, row_cosine = toward[2 * columns + i], toward[2 * columns + rows + i]
        for j in range(along[0], along[1] + 1):
            far = int(views.pixels[np.uint64(slot * stride + i * columns + j)])
            if far >= aim.need:
                continue
            level = aim.level_x * toward[j] + aim.level_y * toward[columns + j]
            off = aim.sine * row_sine + aim.cosine * row_cosine * level
            if off < aim.beams:
                continue
            if far >= 0 or -1 - far < aim.need:
                return False
            if off >= aim.cover and not _is_own(aim, min(off, 1.0), cos_about, sin_about):
                return False
    return True
