"""The compiled loops that make a route field: time marches from the target outwards.

Notes
-----
Solves |grad T| F = 1 by first-order upwind differences (Sethian's fast marching) over levels of
cells, in buckets of time; a cell that improves later is looked at again, so that buckets cost no
accuracy. From cells through which no way of the vehicle's can lead, since the least time to them
and the time from them add up to too much, time marches no farther. Where the target is in sight,
differences are taken from the straight time, which makes them exact there: the wave about a point
is too curved for cells.
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

    levels: Levels
    pace: Pace
    target: Floats
    braking_m: float
    """From there on the vehicle brakes for the target."""
    braking_s: float
    bucket_s: float
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
    slow_mps: float,
) -> tuple[Floats, bool]:
    """Return the time to go [cells], and whether a way from the vehicle was found.

    clearance_m, speed_mps: [cells]; speed 0 where nothing leads. target, vehicle: [3]. A way ends
    within `ends_within_m` of the target, if something stands there. Times are found from wherever a
    way takes no more than `slack_s` longer by way of there than the vehicle's own. most_s: ways of
    the vehicle that take longer are not found; inf where nothing is known of its own. slow_mps:
    how fast what lies too near to something is left.
    """
    n, layers = levels.n, levels.layers
    cells = levels.count * n * n * layers
    counts = np.zeros(4, dtype=np.int64)
    counts[0] = -1
    braking_m = 0.0
    if pace.acceleration_mps2 < np.inf:
        most = max(pace.fastest_mps - pace.arrives_mps, 0.0)
        braking_m = most * most / (2.0 * pace.acceleration_mps2)
    m = March(
        levels,
        pace,
        target,
        braking_m,
        time_along(pace, braking_m),
        0.7 * levels.width_m / pace.fastest_mps,
        np.full(cells, np.inf),
        speed_mps,
        clearance_m,
        np.zeros(cells, dtype=np.bool_),
        np.zeros(cells, dtype=np.bool_),
        np.full(BUCKETS, -1, dtype=np.int64),
        np.empty(4 * cells, dtype=np.int64),
        np.empty(4 * cells, dtype=np.int64),
        counts,
    )
    _begin(m, ends_within_m)
    found, bound, near2 = False, most_s + slack_s, (1.6 * levels.width_m) ** 2
    upwards = pace.fastest_mps / max(pace.climb_mps, pace.sink_mps)
    while m.counts[1] > 0:
        now = m.counts[2]
        entry = m.head[now & (BUCKETS - 1)]
        if entry < 0:
            m.counts[2] += 1
            if (now + 1) * m.bucket_s > bound:
                break
            continue
        m.head[now & (BUCKETS - 1)] = m.following[entry]
        m.following[entry] = m.counts[0]
        m.counts[0] = entry
        m.counts[1] -= 1
        cell = m.cell[entry]
        if not m.waits[cell]:
            continue
        m.waits[cell] = False
        k = cell % layers
        j = (cell // layers) % n
        i = (cell // (layers * n)) % n
        level = cell // (layers * n * n)
        x, y, z = _place(levels, level, i, j, k)
        dx, dy = vehicle[0] - x, vehicle[1] - y
        dz = (vehicle[2] - z) * upwards if layers > 1 else 0.0
        away2 = dx * dx + dy * dy
        if not found and away2 <= near2:
            found, bound = True, min(bound, m.time_s[cell] + slack_s)
        if m.time_s[cell] + np.sqrt(away2 + dz * dz) / pace.fastest_mps <= bound:
            _spread(m, level, i, j, k)
    _fill_in(m, vehicle, bound if found else np.inf)
    _lean_away(m, slow_mps)
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
def _is_amid(levels: Levels, level: int, i: int, j: int) -> bool:
    """Whether all cells beside one are of its own level."""
    n = levels.n
    if i < 1 or j < 1 or i >= n - 1 or j >= n - 1:
        return False
    if level == 0:
        return True
    u, v, half = levels.inner[level, 0], levels.inner[level, 1], n // 2
    return bool(i < u - 1 or j < v - 1 or i > u + half or j > v + half)


@compiled
def _straight(m: March, at: tuple[float, float, float]) -> tuple[float, float]:
    """Seconds of the straight way to the target, and its length in level metres."""
    dz = m.target[2] - at[2] if m.levels.layers > 1 else 0.0
    far = level_length(m.pace, m.target[0] - at[0], m.target[1] - at[1], dz)
    if far >= m.braking_m:
        return m.braking_s + (far - m.braking_m) / m.pace.fastest_mps, far
    return time_along(m.pace, far), far


@compiled
def _begin(m: March, ends_within_m: float) -> None:
    """Let time begin at the target: in the cells about it, or the nearest that are free."""
    levels = m.levels
    n, width = levels.n, levels.width_m
    for level in range(levels.count):
        i = int(np.floor(m.target[0] / width)) - levels.low[level, 0]
        j = int(np.floor(m.target[1] / width)) - levels.low[level, 1]
        if (0 <= i < n and 0 <= j < n) or level == levels.count - 1:
            i, j = min(max(i, 0), n - 1), min(max(j, 0), n - 1)
            k = 0
            if levels.layers > 1:
                k = int(np.floor((m.target[2] - levels.lowest_m) / levels.layer_m + 0.5))
                k = min(max(k, 0), levels.layers - 1)
            most = max(int(np.ceil(ends_within_m / width)), 1)
            found = 0
            for far in range(most + 1):
                found += _begin_in(m, level, i, j, k, far)
                if found > 0 and far > 0:
                    break
            return
        width *= 2.0


@compiled
def _begin_in(m: March, level: int, i: int, j: int, k: int, far: int) -> int:
    """How many cells of a ring about one are free; time begins in these."""
    found, n, layers = 0, m.levels.n, m.levels.layers
    for a in range(max(i - far, 0), min(i + far + 1, n)):
        for b in range(max(j - far, 0), min(j + far + 1, n)):
            if max(abs(a - i), abs(b - j)) < far or _is_covered(m.levels, level, a, b):
                continue
            for c in range(max(k - 1, 0), min(k + 2, layers)):
                cell = ((level * n + a) * n + b) * layers + c
                if m.speed_mps[cell] > 0.0:
                    seconds, _ = _straight(m, _place(m.levels, level, a, b, c))
                    m.in_sight[cell] = True
                    if found == 0 and m.counts[1] == 0:
                        m.counts[2] = int(seconds / m.bucket_s)
                    _put(m, cell, seconds)
                    found += 1
    return found


@compiled
def _put(m: March, cell: int, seconds: float) -> None:
    """Note the time of a cell, and let it wait in its bucket."""
    m.time_s[cell] = seconds
    m.waits[cell] = True
    bucket = int(seconds / m.bucket_s)
    bucket = min(max(bucket, m.counts[2]), m.counts[2] + BUCKETS - 1)
    entry = m.counts[0]
    if entry >= 0:
        m.counts[0] = m.following[entry]
    elif m.counts[3] < len(m.cell):
        entry = m.counts[3]
        m.counts[3] += 1
    else:
        return
    m.following[entry] = m.head[bucket & (BUCKETS - 1)]
    m.head[bucket & (BUCKETS - 1)] = entry
    m.cell[entry] = cell
    m.counts[1] += 1


@compiled
def _spread(m: March, level: int, i: int, j: int, k: int) -> None:
    """Renew the times of the cells beside one that has a new one."""
    levels = m.levels
    n, layers, low = levels.n, levels.layers, levels.low
    here = ((level * n + i) * n + j) * layers + k
    since = m.time_s[here]
    if _is_amid(levels, level, i, j):
        _renew(m, here + n * layers, level, i + 1, j, k, since)
        _renew(m, here - n * layers, level, i - 1, j, k, since)
        _renew(m, here + layers, level, i, j + 1, k, since)
        _renew(m, here - layers, level, i, j - 1, k, since)
    else:
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            u, v = i + a, j + b
            if u < 0 or v < 0 or u >= n or v >= n:
                if level + 1 < levels.count:
                    p = (low[level, 0] + u) // 2 - low[level + 1, 0]
                    q = (low[level, 1] + v) // 2 - low[level + 1, 1]
                    cell = (((level + 1) * n + p) * n + q) * layers + k
                    _renew(m, cell, level + 1, p, q, k, since)
            elif _is_covered(levels, level, u, v):
                p = 2 * (low[level, 0] + u) - low[level - 1, 0] + (1 if a < 0 else 0)
                q = 2 * (low[level, 1] + v) - low[level - 1, 1] + (1 if b < 0 else 0)
                cell = (((level - 1) * n + p) * n + q) * layers + k
                _renew(m, cell, level - 1, p, q, k, since)
                p, q = p + abs(b), q + abs(a)
                cell = (((level - 1) * n + p) * n + q) * layers + k
                _renew(m, cell, level - 1, p, q, k, since)
            else:
                cell = ((level * n + u) * n + v) * layers + k
                _renew(m, cell, level, u, v, k, since)
    if k > 0:
        _renew(m, here - 1, level, i, j, k - 1, since)
    if k < layers - 1:
        _renew(m, here + 1, level, i, j, k + 1, since)


@compiled
def _beside_level(
    m: March, level: int, i: int, j: int, k: int, a: int, b: int
) -> tuple[float, float, bool]:
    """Time of what lies beside a cell, how far off, and whether the target is in sight there."""
    levels = m.levels
    n, layers, low = levels.n, levels.layers, levels.low
    u, v = i + a, j + b
    width = levels.width_m * (1 << level)
    if u < 0 or v < 0 or u >= n or v >= n:
        if level + 1 == levels.count:
            return np.inf, width, False
        p = (low[level, 0] + u) // 2 - low[level + 1, 0]
        q = (low[level, 1] + v) // 2 - low[level + 1, 1]
        cell = (((level + 1) * n + p) * n + q) * layers + k
        time = m.time_s[cell]
        # Coarse cells lie half a cell aside: between two of them, a quarter of the way.
        step = 1 if (low[level, 1] + v) % 2 == 1 else -1
        other = cell + step * layers
        inside = 0 <= q + step < n
        if b != 0:
            step = 1 if (low[level, 0] + u) % 2 == 1 else -1
            other = cell + step * layers * n
            inside = 0 <= p + step < n
        if inside and m.time_s[other] < np.inf and time < np.inf:
            time = 0.75 * time + 0.25 * m.time_s[other]
        return time, 1.5 * width, m.in_sight[cell]
    if _is_covered(levels, level, u, v):
        p = 2 * (low[level, 0] + u) - low[level - 1, 0] + (1 if a < 0 else 0)
        q = 2 * (low[level, 1] + v) - low[level - 1, 1] + (1 if b < 0 else 0)
        one = (((level - 1) * n + p) * n + q) * layers + k
        other = one + (layers if a != 0 else layers * n)
        first, second = m.time_s[one], m.time_s[other]
        if first < np.inf and second < np.inf:
            sees = m.in_sight[one] and m.in_sight[other]
            return 0.5 * (first + second), 0.75 * width, sees
        return min(first, second), 0.75 * width, False
    cell = ((level * n + u) * n + v) * layers + k
    return m.time_s[cell], width, m.in_sight[cell]


@compiled
def _renew(m: March, cell: int, level: int, i: int, j: int, k: int, since: float) -> None:
    """Give a cell the time that those beside it leave, where that is an earlier one."""
    speed = m.speed_mps[cell]
    # No way is shorter than the straight one.
    if speed <= 0.0 or m.time_s[cell] <= since or m.in_sight[cell]:
        return
    levels, pace = m.levels, m.pace
    layers, row = levels.layers, levels.layers * levels.n
    if _is_amid(levels, level, i, j):
        hx = hy = levels.width_m * (1 << level)
        there = cell - row if m.time_s[cell - row] < m.time_s[cell + row] else cell + row
        ax, sx = m.time_s[there], m.in_sight[there]
        there = (
            cell - layers if m.time_s[cell - layers] < m.time_s[cell + layers] else cell + layers
        )
        ay, sy = m.time_s[there], m.in_sight[there]
    else:
        ax, hx, sx = _beside_level(m, level, i, j, k, 1, 0)
        other, far, sees = _beside_level(m, level, i, j, k, -1, 0)
        if other < ax:
            ax, hx, sx = other, far, sees
        ay, hy, sy = _beside_level(m, level, i, j, k, 0, 1)
        other, far, sees = _beside_level(m, level, i, j, k, 0, -1)
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
    straight = -1.0
    if sx or sy or sz:
        at = _place(levels, level, i, j, k)
        straight, left = _straight(m, at)
        slope = 1.0 / (max(left, 1e-9) * speed_along(pace, left))
        if sx:
            ax = max(straight - hx * abs(m.target[0] - at[0]) * slope, 0.0)
        if sy:
            ay = max(straight - hy * abs(m.target[1] - at[1]) * slope, 0.0)
        if sz:
            rise = m.target[2] - at[2]
            scale = pace.fastest_mps / (pace.climb_mps if rise > 0.0 else pace.sink_mps)
            az = max(straight - hz * abs(rise) * scale * slope, 0.0)
    seconds = _upwind(ax, hx, ay, hy, az, hz, speed)
    sees = False
    if straight >= 0.0:
        seconds = max(seconds, straight)
        sees = seconds <= IN_SIGHT * straight + IMPROVED_S
    if seconds < m.time_s[cell] - IMPROVED_S:
        m.in_sight[cell] = sees
        _put(m, cell, seconds)


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
def _fill_in(m: March, vehicle: Floats, bound: float) -> None:
    """Give cells that were not looked at a time that is no less than theirs may be, and coarse
    ones that finer ones cover the mean of these."""
    levels = m.levels
    n, layers = levels.n, levels.layers
    for level in range(levels.count):
        for i in range(n):
            for j in range(n):
                cell = ((level * n + i) * n + j) * layers
                if _is_covered(levels, level, i, j):
                    p = 2 * (levels.low[level, 0] + i) - levels.low[level - 1, 0]
                    q = 2 * (levels.low[level, 1] + j) - levels.low[level - 1, 1]
                    one = (((level - 1) * n + p) * n + q) * layers
                    for k in range(layers):
                        total, count = 0.0, 0
                        for a in (one, one + layers, one + n * layers, one + (n + 1) * layers):
                            if m.time_s[a + k] < np.inf:
                                total += m.time_s[a + k]
                                count += 1
                        if count > 0:
                            m.time_s[cell + k] = total / count
                elif bound < np.inf:
                    for k in range(layers):
                        if m.time_s[cell + k] == np.inf and m.speed_mps[cell + k] > 0.0:
                            x, y, _ = _place(levels, level, i, j, k)
                            away = np.hypot(x - vehicle[0], y - vehicle[1])
                            m.time_s[cell + k] = bound + away / m.pace.fastest_mps


@compiled
def _lean_away(m: March, slow_mps: float) -> None:
    """Give cells beside those that have a way the latest time of these and the way out: between
    the middles of cells, times then lead away from what stands."""
    levels = m.levels
    n, layers = levels.n, levels.layers
    row = n * layers
    for level in range(levels.count):
        out_s = levels.width_m * (1 << level) / slow_mps
        for i in range(1, n - 1):
            for j in range(1, n - 1):
                for k in range(layers):
                    cell = ((level * n + i) * n + j) * layers + k
                    if m.speed_mps[cell] > 0.0 or m.time_s[cell] < np.inf:
                        continue
                    latest = -1.0
                    for there in (cell - row, cell + row, cell - layers, cell + layers):
                        if m.speed_mps[there] > 0.0 and m.time_s[there] < np.inf:
                            latest = max(latest, m.time_s[there])
                    if latest < 0.0:
                        for there in (
                            cell - row - layers,
                            cell - row + layers,
                            cell + row - layers,
                            cell + row + layers,
                        ):
                            if m.speed_mps[there] > 0.0 and m.time_s[there] < np.inf:
                                latest = max(latest, m.time_s[there])
                    if latest >= 0.0:
                        m.time_s[cell] = latest + out_s
