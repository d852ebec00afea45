"""The compiled loops that make a route field: time marches from the target outwards.

Notes
-----
Solves |grad T| F = 1 by first-order upwind differences (Sethian's fast marching) over levels of
cells, in buckets of time; a cell that improves later is looked at again, so that buckets cost no
accuracy. From cells through which no way of the vehicle's can lead, since the least time to them
and the time from them add up to too much, time marches no farther. Where the target is in sight, differences are taken from the
straight time, which makes them exact there: the wave about a point is too curved for cells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.rate.route_field import Pace, level_length, speed_along, time_along
from clearway.base.arrays import Bools, Floats, Ints, Ints2
from clearway.base.compiled import compiled

BUCKETS = 8192
"""Buckets of time at once."""
IMPROVED_S = 1e-6
"""What comes so much earlier is looked at again."""
IN_SIGHT = 1.0001
"""Times the straight time up to which the target counts as in sight."""


class Levels(NamedTuple):
    """Where cells are."""

    count: int
    n: int
    """Cells along a side of each level."""
    layers: int
    low: Ints2
    """[count, 2] number of the lowest cell of each level, even."""
    inner: Ints2
    """[count, 2] the first cell of each level that the one before covers, from its lowest on."""
    width_m: float
    lowest_m: float
    layer_m: float


class March(NamedTuple):
    """What is known of all cells, one after another, while time marches."""

    time_s: Floats
    speed_mps: Floats
    clearance_m: Floats
    in_sight: Bools
    waits: Bools
    """Whether a cell has improved since it was looked at."""
    head: Ints
    """[BUCKETS] first entry of each bucket, -1 for none."""
    following: Ints
    """[entries] the next of the same bucket, or of those that are free."""
    cell: Ints
    """[entries]"""
    counts: Ints
    """[4] a free entry or -1, entries that wait, the bucket that is looked at, and the first entry
    that was never used."""


@compiled
def march(
    levels: Levels,
    pace: Pace,
    clearance_m: Floats,
    speed_mps: Floats,
    target: Floats,
    vehicle: Floats,
    ends_within_m: float,
    slack_s: float,
    most_s: float,
) -> tuple[Floats, bool]:
    """Return the time to go [cells], and whether a way from the vehicle was found.

    clearance_m, speed_mps: [cells]; speed 0 where nothing leads. target, vehicle: [3]. A way ends
    within `ends_within_m` of the target, if something stands there. Times are found from wherever a
    way takes no more than `slack_s` longer by way of there than the vehicle's own. most_s: ways of
    the vehicle that take longer are not found; inf where nothing is known of its own.
    """
    cells = levels.count * levels.n * levels.n * levels.layers
    entries = 4 * cells
    counts = np.zeros(4, dtype=np.int64)
    counts[0] = -1
    m = March(
        np.full(cells, np.inf),
        speed_mps,
        clearance_m,
        np.zeros(cells, dtype=np.bool_),
        np.zeros(cells, dtype=np.bool_),
        np.full(BUCKETS, -1, dtype=np.int64),
        np.empty(entries, dtype=np.int64),
        np.empty(entries, dtype=np.int64),
        counts,
    )
    bucket_s = 0.7 * levels.width_m / pace.fastest_mps
    _begin(levels, pace, m, target, ends_within_m, bucket_s)
    found, bound, near2 = False, most_s + slack_s, (1.6 * levels.width_m) ** 2
    while m.counts[1] > 0:
        now = m.counts[2]
        entry = m.head[now % BUCKETS]
        if entry < 0:
            m.counts[2] += 1
            if (now + 1) * bucket_s > bound:
                break
            continue
        m.head[now % BUCKETS] = m.following[entry]
        m.following[entry] = m.counts[0]
        m.counts[0] = entry
        m.counts[1] -= 1
        cell = m.cell[entry]
        if not m.waits[cell]:
            continue
        m.waits[cell] = False
        k = cell % levels.layers
        j = (cell // levels.layers) % levels.n
        i = (cell // (levels.layers * levels.n)) % levels.n
        level = cell // (levels.layers * levels.n * levels.n)
        x, y, z = _place(levels, level, i, j, k)
        dx, dy, dz = vehicle[0] - x, vehicle[1] - y, 0.0
        if levels.layers > 1:
            dz = (vehicle[2] - z) * pace.fastest_mps / max(pace.climb_mps, pace.sink_mps)
        away2 = dx * dx + dy * dy
        if not found and away2 <= near2:
            found, bound = True, min(bound, m.time_s[cell] + slack_s)
        if m.time_s[cell] + np.sqrt(away2 + dz * dz) / pace.fastest_mps > bound:
            continue
        _spread(levels, pace, m, level, i, j, k, target, bucket_s)
    _fill_in(levels, pace, m, vehicle, bound if found else np.inf)
    return m.time_s, found


@compiled
def _place(levels: Levels, level: int, i: int, j: int, k: int) -> tuple[float, float, float]:
    width = levels.width_m * (1 << level)
    return (
        (levels.low[level, 0] + i + 0.5) * width,
        (levels.low[level, 1] + j + 0.5) * width,
        levels.lowest_m + k * levels.layer_m,
    )


@compiled
def _is_covered(levels: Levels, level: int, i: int, j: int) -> bool:
    """Whether the finer level holds a cell."""
    if level == 0:
        return False
    u, v, half = levels.inner[level, 0], levels.inner[level, 1], levels.n // 2
    return bool(u <= i < u + half and v <= j < v + half)


@compiled
def _ahead(
    levels: Levels, pace: Pace, at: tuple[float, float, float], target: Floats
) -> tuple[float, float]:
    """Seconds of the straight way to the target, and its length in level metres."""
    dz = target[2] - at[2] if levels.layers > 1 else 0.0
    far = level_length(pace, target[0] - at[0], target[1] - at[1], dz)
    return time_along(pace, far), far


@compiled
def _begin(
    levels: Levels,
    pace: Pace,
    m: March,
    target: Floats,
    ends_within_m: float,
    bucket_s: float,
) -> None:
    """Let time begin at the target: in the cells about it, or the nearest that are free."""
    n, width = levels.n, levels.width_m
    for level in range(levels.count):
        i = int(np.floor(target[0] / width)) - levels.low[level, 0]
        j = int(np.floor(target[1] / width)) - levels.low[level, 1]
        last = level == levels.count - 1
        if (0 <= i < n and 0 <= j < n) or last:
            i, j = min(max(i, 0), n - 1), min(max(j, 0), n - 1)
            k = 0
            if levels.layers > 1:
                k = int(np.floor((target[2] - levels.lowest_m) / levels.layer_m + 0.5))
                k = min(max(k, 0), levels.layers - 1)
            most = max(int(np.ceil(ends_within_m / width)), 1)
            found = 0
            for far in range(most + 1):
                found += _begin_in(levels, pace, m, target, level, i, j, k, far, bucket_s)
                if found > 0 and far > 0:
                    return
            return
        width *= 2.0


@compiled
def _begin_in(
    levels: Levels,
    pace: Pace,
    m: March,
    target: Floats,
    level: int,
    i: int,
    j: int,
    k: int,
    far: int,
    bucket_s: float,
) -> int:
    """How many cells of a ring about one are free; time begins in these."""
    found, n = 0, levels.n
    for a in range(max(i - far, 0), min(i + far + 1, n)):
        for b in range(max(j - far, 0), min(j + far + 1, n)):
            if max(abs(a - i), abs(b - j)) < far or _is_covered(levels, level, a, b):
                continue
            for c in range(max(k - 1, 0), min(k + 2, levels.layers)):
                cell = ((level * n + a) * n + b) * levels.layers + c
                if m.speed_mps[cell] > 0.0:
                    at = _place(levels, level, a, b, c)
                    seconds, _ = _ahead(levels, pace, at, target)
                    m.in_sight[cell] = True
                    _put(m, cell, seconds, bucket_s)
                    found += 1
    return found


@compiled
def _put(
    m: March,
    cell: int,
    seconds: float,
    bucket_s: float,
) -> None:
    """Note the time of a cell, and let it wait in its bucket."""
    m.time_s[cell] = seconds
    m.waits[cell] = True
    bucket = int(seconds / bucket_s)
    if m.counts[1] == 0 and m.counts[2] == 0:
        m.counts[2] = bucket
    bucket = min(max(bucket, m.counts[2]), m.counts[2] + BUCKETS - 1)
    entry = m.counts[0]
    if entry >= 0:
        m.counts[0] = m.following[entry]
    elif m.counts[3] < len(m.cell):
        entry = m.counts[3]
        m.counts[3] += 1
    else:
        return
    m.following[entry] = m.head[bucket % BUCKETS]
    m.head[bucket % BUCKETS] = entry
    m.cell[entry] = cell
    m.counts[1] += 1


@compiled
def _spread(
    levels: Levels,
    pace: Pace,
    m: March,
    level: int,
    i: int,
    j: int,
    k: int,
    target: Floats,
    bucket_s: float,
) -> None:
    """Renew the times of the cells beside one that has a new one."""
    n, low = levels.n, levels.low
    since = m.time_s[((level * n + i) * n + j) * levels.layers + k]
    for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        u, v = i + a, j + b
        if u < 0 or v < 0 or u >= n or v >= n:
            if level + 1 < levels.count:
                p = (low[level, 0] + u) // 2 - low[level + 1, 0]
                q = (low[level, 1] + v) // 2 - low[level + 1, 1]
                _renew(levels, pace, m, level + 1, p, q, k, since, target, bucket_s)
        elif _is_covered(levels, level, u, v):
            p = 2 * (low[level, 0] + u) - low[level - 1, 0] + (1 if a < 0 else 0)
            q = 2 * (low[level, 1] + v) - low[level - 1, 1] + (1 if b < 0 else 0)
            _renew(levels, pace, m, level - 1, p, q, k, since, target, bucket_s)
            p, q = p + abs(b), q + abs(a)
            _renew(levels, pace, m, level - 1, p, q, k, since, target, bucket_s)
        else:
            _renew(levels, pace, m, level, u, v, k, since, target, bucket_s)
    if k > 0:
        _renew(levels, pace, m, level, i, j, k - 1, since, target, bucket_s)
    if k < levels.layers - 1:
        _renew(levels, pace, m, level, i, j, k + 1, since, target, bucket_s)


@compiled
def _beside_level(
    levels: Levels, m: March, level: int, i: int, j: int, k: int, a: int, b: int
) -> tuple[float, float, bool]:
    """Time of what lies beside a cell, how far off, and whether the target is in sight there."""
    n, low = levels.n, levels.low
    u, v = i + a, j + b
    width = levels.width_m * (1 << level)
    if u < 0 or v < 0 or u >= n or v >= n:
        if level + 1 == levels.count:
            return np.inf, width, False
        p = (low[level, 0] + u) // 2 - low[level + 1, 0]
        q = (low[level, 1] + v) // 2 - low[level + 1, 1]
        cell = (((level + 1) * n + p) * n + q) * levels.layers + k
        time = m.time_s[cell]
        # Coarse cells lie half a cell aside: between two of them, a quarter of the way.
        step = 1 if (low[level, 1] + v) % 2 == 1 else -1
        other = cell + step * levels.layers
        inside = 0 <= q + step < n
        if b != 0:
            step = 1 if (low[level, 0] + u) % 2 == 1 else -1
            other = cell + step * levels.layers * n
            inside = 0 <= p + step < n
        if inside and m.time_s[other] < np.inf and time < np.inf:
            time = 0.75 * time + 0.25 * m.time_s[other]
        return time, 1.5 * width, m.in_sight[cell]
    if _is_covered(levels, level, u, v):
        p = 2 * (low[level, 0] + u) - low[level - 1, 0] + (1 if a < 0 else 0)
        q = 2 * (low[level, 1] + v) - low[level - 1, 1] + (1 if b < 0 else 0)
        one = (((level - 1) * n + p) * n + q) * levels.layers + k
        other = one + (levels.layers if a != 0 else levels.layers * n)
        first, second = m.time_s[one], m.time_s[other]
        sees = m.in_sight[one] and m.in_sight[other]
        if first < np.inf and second < np.inf:
            return 0.5 * (first + second), 0.75 * width, sees
        return min(first, second), 0.75 * width, False
    cell = ((level * n + u) * n + v) * levels.layers + k
    return m.time_s[cell], width, m.in_sight[cell]


@compiled
def _renew(
    levels: Levels,
    pace: Pace,
    m: March,
    level: int,
    i: int,
    j: int,
    k: int,
    since: float,
    target: Floats,
    bucket_s: float,
) -> None:
    """Give a cell the time that those beside it leave, where that is an earlier one."""
    n, layers = levels.n, levels.layers
    cell = ((level * n + i) * n + j) * layers + k
    speed = m.speed_mps[cell]
    if speed <= 0.0 or m.time_s[cell] <= since:
        return
    at = _place(levels, level, i, j, k)
    ax, hx, sx = _beside_level(levels, m, level, i, j, k, 1, 0)
    other, far, sees = _beside_level(levels, m, level, i, j, k, -1, 0)
    if other < ax:
        ax, hx, sx = other, far, sees
    ay, hy, sy = _beside_level(levels, m, level, i, j, k, 0, 1)
    other, far, sees = _beside_level(levels, m, level, i, j, k, 0, -1)
    if other < ay:
        ay, hy, sy = other, far, sees
    az, hz, sz = np.inf, 1.0, False
    if layers > 1:
        for up in (-1, 1):
            if k + up < 0 or k + up >= layers:
                continue
            there = cell + up
            # Balls about both middles that touch leave no slab between them.
            if m.clearance_m[cell] + m.clearance_m[there] < levels.layer_m:
                continue
            if m.time_s[there] < az:
                climbs = pace.climb_mps if up > 0 else pace.sink_mps
                hz = levels.layer_m * pace.fastest_mps / climbs
                az, sz = m.time_s[there], m.in_sight[there]
    straight, left = -1.0, 0.0
    if sx or sy or sz:
        straight, left = _ahead(levels, pace, at, target)
        slope = 1.0 / (max(left, 1e-9) * speed_along(pace, left))
        if sx:
            ax = max(straight - hx * abs(target[0] - at[0]) * slope, 0.0)
        if sy:
            ay = max(straight - hy * abs(target[1] - at[1]) * slope, 0.0)
        if sz:
            rise = target[2] - at[2]
            scale = pace.fastest_mps / (pace.climb_mps if rise > 0.0 else pace.sink_mps)
            az = max(straight - hz * abs(rise) * scale * slope, 0.0)
    seconds = _upwind(ax, hx, ay, hy, az, hz, speed)
    sees = False
    if straight >= 0.0:
        seconds = max(seconds, straight)
        sees = seconds <= IN_SIGHT * straight + IMPROVED_S
    if seconds < m.time_s[cell] - IMPROVED_S:
        m.in_sight[cell] = sees
        _put(m, cell, seconds, bucket_s)


@compiled
def _upwind(
    ax: float, hx: float, ay: float, hy: float, az: float, hz: float, speed: float
) -> float:
    """The time at which a wave comes to a cell, by the times beside it along each axis."""
    if ay < ax:
        ax, hx, ay, hy = ay, hy, ax, hx
    if az < ay:
        ay, hy, az, hz = az, hz, ay, hy
        if ay < ax:
            ax, hx, ay, hy = ay, hy, ax, hx
    seconds = ax + hx / speed
    if seconds <= ay:
        return seconds
    w, x = 1.0 / (hx * hx), 1.0 / (hy * hy)
    a, b, c = w + x, w * ax + x * ay, w * ax * ax + x * ay * ay - 1.0 / (speed * speed)
    root = b * b - a * c
    if root < 0.0:
        return seconds
    seconds = min(seconds, (b + np.sqrt(root)) / a)
    if seconds <= az:
        return seconds
    w = 1.0 / (hz * hz)
    a, b, c = a + w, b + w * az, c + w * az * az
    root = b * b - a * c
    if root < 0.0:
        return seconds
    return float(min(seconds, (b + np.sqrt(root)) / a))


@compiled
def _fill_in(levels: Levels, pace: Pace, m: March, vehicle: Floats, bound: float) -> None:
    """Give cells that were not looked at a time that is no less than theirs may be, and coarse
    ones that finer ones cover the mean of these."""
    n, layers = levels.n, levels.layers
    for level in range(levels.count):
        for i in range(n):
            for j in range(n):
                covered = _is_covered(levels, level, i, j)
                for k in range(layers):
                    cell = ((level * n + i) * n + j) * layers + k
                    if covered:
                        p = 2 * (levels.low[level, 0] + i) - levels.low[level - 1, 0]
                        q = 2 * (levels.low[level, 1] + j) - levels.low[level - 1, 1]
                        one = (((level - 1) * n + p) * n + q) * layers + k
                        total, count = 0.0, 0
                        for child in (one, one + layers, one + n * layers, one + (n + 1) * layers):
                            if m.time_s[child] < np.inf:
                                total += m.time_s[child]
                                count += 1
                        if count > 0:
                            m.time_s[cell] = total / count
                        continue
                    new = m.time_s[cell] == np.inf and m.speed_mps[cell] > 0.0
                    if new and bound < np.inf:
                        x, y, _ = _place(levels, level, i, j, k)
                        away = np.hypot(x - vehicle[0], y - vehicle[1])
                        m.time_s[cell] = bound + away / pace.fastest_mps
