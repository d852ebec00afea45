"""Voxels about the vehicle that have seen ones all round them: a search that goes on for long looks
places up in them first, of which most lie too near to unobserved space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.escape.beginnings import FAILS, UNDECIDED, Begun
from clearway.avoidance.escape.legs import EscapeTerms
from clearway.base.arrays import Floats, Floats2, Int8s, Ints, UInt64s2, UInt64s3
from clearway.base.compiled import compiled
from clearway.reach.escapes.ways import Ways
from clearway.sensors.observed.free_voxels import ONE, WORD, is_marked
from clearway.sensors.observed.seen_space import SeenSpace

ACROSS = 128
"""Columns along both level axes, a power of two."""
MOST = 2
"""Voxels that are looked at on either side."""
OFTEN = 600
"""So many loops are looked at at one decision before this is worth filling in."""
FILLED = -1
NONE = -1
ALONG = float(np.sqrt(1.5**2 + 2.0 * 0.5**2))
ALL = 1.5 * float(np.sqrt(3.0))
"""Voxels from any place to the farthest middle of those beside its own voxel along the axes, and of
all about it; to the middles of those within two along the axes it is no farther."""
STEP_SPARE = 1e-3
"""Of a voxel, by which rounding may take a ball for a smaller one."""


class WideSpace(NamedTuple):
    """Which voxels were seen, alone, and with all that lie within one or two steps of them along
    the axes."""

    seen: UInt64s3
    """[MOST + 1, ACROSS, ACROSS] a word for each column, from the lowest one on: WORD voxels."""
    between: UInt64s3
    """[2, ACROSS, ACROSS] to work with."""
    low: Ints
    """[3] number of the lowest voxel along each axis."""
    looked: Ints
    """[1] loops looked at up to now; FILLED once the voxels are."""


def wide_space() -> WideSpace:
    """Room for them: nobody has touched it."""
    seen = np.empty((MOST + 1, ACROSS, ACROSS), dtype=np.uint64)
    between = np.empty((2, ACROSS, ACROSS), dtype=np.uint64)
    return WideSpace(seen, between, np.zeros(3, np.int64), np.zeros(1, np.int64))


@compiled
def steps_within(wide: WideSpace, radius: float, terms: EscapeTerms) -> int:
    """Voxels on either side whose middles a ball of a radius holds wherever it lies.

    NONE where nothing can be looked up: nothing is filled in, a map is declared complete and tells
    more than was seen, or views do.
    """
    window = terms.seen.window
    if wide.looked[0] != FILLED or window[8] <= window[11] or window[14] > 0.0:
        return NONE
    across = radius * window[3] - STEP_SPARE
    return 0 if across < ALONG else (1 if across < ALL else MOST)


@compiled
def first_wide(
    escape: int,
    ways: Ways,
    places: Floats2,
    begun: Begun,
    wind: Floats,
    met: Int8s,
    cleared: Int8s,
    clear: Int8s,
    seen: Int8s,
    radius: float,
    steps: int,
    wide: WideSpace,
    space: SeenSpace,
) -> int:
    """The first from an escape on that has not failed, and of which all about its loop's places and
    the end of its beginning may have been seen, within a radius; their number if there is none.

    Of these places some may not have been seen, as many as `begun` says.

    All in one loop: where thousands are passed over, each call of another would take longer than
    what it does. steps: of the radius. Where beginnings lead is known up to the last.
    """
    begins, loops, loop_at, parent = ways.begins, ways.loop, ways.loop_at, ways.parent
    placed, tips, voxels, level = begun.placed, begun.tips.places, wide.seen, np.uint64(steps)
    free, window = space.free, space.window
    missing, most = begun.missing, begun.most_missing
    per_m, escapes, one = window[3], np.uint64(len(ways.begins)), np.uint64(1)
    low_x, low_y, low_z = float(wide.low[0]), float(wide.low[1]), float(wide.low[2])
    east_mps, north_mps, up_mps = wind[0], wind[1], wind[2]
    start_x, start_y, start_z = placed[0, 0], placed[0, 1], placed[0, 2]
    start_cos, start_sin = placed[0, 3], placed[0, 4]
    # Whatever lies in the ball declared free is, whoever has seen it.
    from_x = window[4] * per_m - low_x
    from_y = window[5] * per_m - low_y
    from_z = window[6] * per_m - low_z
    beside = window[7] * per_m + np.sqrt(3.0) * (radius * per_m + 2.0) if window[7] > 0.0 else 0.0
    beside2, e = beside * beside, np.uint64(escape)
    while e < escapes:
        begin = np.uint64(begins[e])
        if seen[begin] == UNDECIDED and seen[parent[begin]] == FAILS:
            seen[begin] = FAILS
        if seen[begin] == FAILS or clear[begin] == FAILS:
            while e < escapes and np.uint64(begins[e]) == begin:
                e += one
            continue
        ahead, left, when = tips[begin, 0], tips[begin, 1], tips[begin, 5]
        cosine, sine = tips[begin, 3], tips[begin, 4]
        placed[begin, 0] = start_x + start_cos * ahead - start_sin * left + east_mps * when
        placed[begin, 1] = start_y + start_sin * ahead + start_cos * left + north_mps * when
        placed[begin, 2] = start_z + tips[begin, 2] + up_mps * when
        placed[begin, 3] = start_cos * cosine - start_sin * sine
        placed[begin, 4] = start_sin * cosine + start_cos * sine
        x = placed[begin, 0] * per_m - low_x
        y = placed[begin, 1] * per_m - low_y
        z = placed[begin, 2] * per_m - low_z
        if seen[begin] == UNDECIDED:
            is_missing = _is_missing(x, y, z, level, voxels, wide, free, window)
            if is_missing:
                dx, dy, dz = x - from_x, y - from_y, z - from_z
                is_missing = dx * dx + dy * dy + dz * dz > beside2
            missing[begin] = missing[parent[begin]] + (1 if is_missing else 0)
            if missing[begin] > most:
                seen[begin] = FAILS
                continue  # To its other escapes.
        cosine, sine = per_m * placed[begin, 3], per_m * placed[begin, 4]
        while e < escapes and np.uint64(begins[e]) == begin:
            if met[e] != FAILS and cleared[e] != FAILS:
                spare, loop = most - missing[begin], np.uint32(loops[e])
                for at in range(loop_at[loop], loop_at[loop + np.uint32(1)]):
                    n = np.uint64(at)
                    ahead, left, when = places[n, 0], places[n, 1], per_m * places[n, 3]
                    a = x + cosine * ahead - sine * left + east_mps * when
                    b = y + sine * ahead + cosine * left + north_mps * when
                    c = z + per_m * places[n, 2] + up_mps * when
                    if _is_missing(a, b, c, level, voxels, wide, free, window):
                        dx, dy, dz = a - from_x, b - from_y, c - from_z
                        if dx * dx + dy * dy + dz * dz > beside2:
                            spare -= 1
                            if spare < 0:
                                break
                if spare >= 0:
                    return int(np.int64(e))
            e += one
    return int(np.int64(escapes))


@compiled
def _is_missing(
    a: float,
    b: float,
    c: float,
    level: np.uint64,
    seen: UInt64s3,
    wide: WideSpace,
    free: UInt64s3,
    window: Floats,
) -> bool:
    """Whether a place, in voxels from the lowest one, has a voxel beside it that was not seen; of
    places farther off than is filled in, whether their own was not."""
    if min(a, b, c) < 0.0 or max(a, b) >= ACROSS or c >= WORD:
        return _was_not_seen(a, b, c, wide.low, free, window)
    bit = np.uint64(np.uint32(c))
    return bool(not (seen[level, np.uint32(a), np.uint32(b)] >> bit) & ONE)


@compiled
def _was_not_seen(a: float, b: float, c: float, low: Ints, free: UInt64s3, window: Floats) -> bool:
    """Whether the voxel of a place was not seen, or lies beyond the window."""
    i, j, k = int(np.floor(a)) + low[0], int(np.floor(b)) + low[1], int(np.floor(c)) + low[2]
    columns, rows = free.shape[0], WORD * free.shape[2]
    if not (0 <= i - window[0] < columns and 0 <= j - window[1] < columns):
        return True
    return not (0 <= k - window[2] < rows and is_marked(free, i, j, k))


@compiled
def look_at(wide: WideSpace, loops: int, terms: EscapeTerms) -> bool:
    """Count loops that are looked at; whether that was once too often, and all is filled in now."""
    free = terms.seen.free
    if wide.looked[0] == FILLED or free.shape[0] < ACROSS or free.shape[2] < 2:
        return False
    if terms.seen.window[14] > 0.0:
        return False
    wide.looked[0] += loops
    if wide.looked[0] <= OFTEN:
        return False
    fill_in_wide(wide, terms)
    return True


@compiled
def fill_in_wide(wide: WideSpace, terms: EscapeTerms) -> None:
    """Note what was seen about the vehicle; beside what lies farther off all counts as seen."""
    wide.looked[0] = FILLED
    free, window, low = terms.seen.free, terms.seen.window, wide.low
    columns, words = free.shape[0], free.shape[2]
    for axis in range(3):
        across, most = (ACROSS, columns) if axis < 2 else (WORD, WORD * words)
        lowest = int(window[axis])
        here = int(np.floor(terms.origin_m[axis] * window[3])) - across // 2
        low[axis] = min(max(here, lowest), lowest + most - across)
    low_a, low_b = low[0], low[1]
    # A word from within two, one above the other.
    under, bit = np.uint64((low[2] // WORD) & (words - 1)), np.uint64(low[2] & (WORD - 1))
    over, rest = np.uint64((low[2] // WORD + 1) & (words - 1)), np.uint64(WORD - 1) - bit
    alone, one, two = wide.seen[0], wide.seen[1], wide.seen[2]
    between, cube = wide.between[0], wide.between[1]
    # Of one step those along the axes; of two all within one step, and those along the axes.
    for i in range(ACROSS):
        a = np.uint64((low_a + i) & (columns - 1))
        for j in range(ACROSS):
            b = np.uint64((low_b + j) & (columns - 1))
            alone[i, j] = (free[a, b, under] >> bit) | ((free[a, b, over] << rest) << ONE)
    _narrow_upwards(alone, one)
    _narrow_sideways(one, between)
    _narrow_along(between, cube)
    _narrow_upwards(one, two)
    _keep_both(cube, two)
    _narrow_sideways(alone, between)
    _keep_both(between, one)
    _narrow_sideways(between, cube)
    _keep_both(cube, two)
    _narrow_along(alone, between)
    _keep_both(between, one)
    _narrow_along(between, cube)
    _keep_both(cube, two)


@compiled
def _keep_both(other: UInt64s2, into: UInt64s2) -> None:
    """Of voxels, those that are in another set too: [ACROSS, ACROSS]."""
    for i in range(ACROSS):
        for j in range(ACROSS):
            into[i, j] &= other[i, j]


@compiled
def _narrow_upwards(before: UInt64s2, into: UInt64s2) -> None:
    """Of voxels, those with neighbours above and below: [ACROSS, ACROSS]."""
    highest = ONE << np.uint64(WORD - 1)
    for i in range(ACROSS):
        for j in range(ACROSS):
            here = before[i, j]
            into[i, j] = here & ((here << ONE) | ONE) & ((here >> ONE) | highest)


@compiled
def _narrow_sideways(before: UInt64s2, into: UInt64s2) -> None:
    """Those with neighbours in the columns beside."""
    last = ACROSS - 1
    for i in range(ACROSS):
        into[i, 0] = before[i, 0] & before[i, 1]
        for j in range(1, last):
            into[i, j] = before[i, j - 1] & before[i, j] & before[i, j + 1]
        into[i, last] = before[i, last - 1] & before[i, last]


@compiled
def _narrow_along(before: UInt64s2, into: UInt64s2) -> None:
    """Those with neighbours in the rows of columns beside."""
    last = ACROSS - 1
    for j in range(ACROSS):
        into[0, j] = before[0, j] & before[1, j]
    for i in range(1, last):
        for j in range(ACROSS):
            into[i, j] = before[i - 1, j] & before[i, j] & before[i + 1, j]
    for j in range(ACROSS):
        into[last, j] = before[last - 1, j] & before[last, j]
