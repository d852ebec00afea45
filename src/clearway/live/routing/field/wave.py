"""How time comes from cell to cell: the compiled loops of a march over cells.

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
from clearway.base.arrays import Bools, Floats, Ints
from clearway.base.compiled import compiled
from clearway.live.routing.field.route_levels import Levels, is_amid, is_covered, middle_of

BUCKETS = 8192
"""Buckets of time at once."""
IMPROVED_S = 1e-6
"""What comes so much earlier is looked at again."""
IN_SIGHT = 1.0001
"""Times the straight time up to which the target counts as in sight."""


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
    """[BUCKETS] first entry of each bucket, -1 for none: the first in comes out first, since a cell
    that is spread from too early is so again and again."""
    tail: Ints
    """[BUCKETS] last entry of each bucket that has any."""
    following: Ints
    """[entries] the next of the same bucket, or of those that are free."""
    cell: Ints
    """[entries]"""
    counts: Ints
    """[4] a free entry or -1, entries that wait, the bucket that is looked at, and the first entry
    that was never used."""


@compiled
def straight_to_target(m: March, at: tuple[float, float, float]) -> tuple[float, float]:
    """Seconds of the straight way to the target, and its length in level metres."""
    dz = m.target[2] - at[2] if m.levels.layers > 1 else 0.0
    far = level_length(m.pace, m.target[0] - at[0], m.target[1] - at[1], dz)
    if far >= m.braking_m:
        return m.braking_s + (far - m.braking_m) / m.pace.fastest_mps, far
    return time_along(m.pace, far), far


@compiled
def put_in_bucket(m: March, cell: int, seconds: float) -> None:
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
    slot = bucket & (BUCKETS - 1)
    if m.head[slot] < 0:
        m.head[slot] = entry
    else:
        m.following[m.tail[slot]] = entry
    m.tail[slot], m.following[entry] = entry, -1
    m.cell[entry] = cell
    m.counts[1] += 1


@compiled
def begin_in_cell(m: March, cell: int, at: tuple[float, float, float]) -> None:
    """Let time begin in a cell about a place, from which the target is in sight."""
    seconds, _ = straight_to_target(m, at)
    m.in_sight[cell] = True
    if m.counts[1] == 0:
        m.counts[2] = int(seconds / m.bucket_s)
    put_in_bucket(m, cell, seconds)


@compiled
def renew_time(m: March, cell: int, level: int, i: int, j: int, k: int, since: float) -> None:
    """Give a cell the time that those beside it leave, where that is an earlier one."""
    speed = m.speed_mps[cell]
    # No way is shorter than the straight one.
    if speed <= 0.0 or m.time_s[cell] <= since or m.in_sight[cell]:
        return
    levels, pace = m.levels, m.pace
    layers, row = levels.layers, levels.layers * levels.n
    if is_amid(levels, level, i, j):
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
        between = np.hypot(levels.layer_m, levels.width_m)
        for up in (-1, 1):
            if k + up < 0 or k + up >= layers:
                continue
            there = cell + up
            # Balls about both middles that overlap leave no slab between them.
            if m.clearance_m[cell] + m.clearance_m[there] < between:
                continue
            if m.time_s[there] < az:
                climbs = pace.climb_mps if up > 0 else pace.sink_mps
                hz = levels.layer_m * pace.fastest_mps / climbs
                az, sz = m.time_s[there], m.in_sight[there]
    straight = -1.0
    if sx or sy or sz:
        at = middle_of(levels, level, i, j, k)
        straight, left = straight_to_target(m, at)
        slope = 1.0 / (max(left, 1e-9) * speed_along(pace, left))
        x, y = abs(m.target[0] - at[0]), abs(m.target[1] - at[1])
        # Less than a cell off the target's own row nothing nearer to it lies beside.
        if sx or x < hx:
            ax = max(straight - hx * x * slope, 0.0)
        if sy or y < hy:
            ay = max(straight - hy * y * slope, 0.0)
        if layers > 1:
            rise = m.target[2] - at[2]
            scale = pace.fastest_mps / (pace.climb_mps if rise > 0.0 else pace.sink_mps)
            if sz or abs(rise) < levels.layer_m:
                hz = levels.layer_m * scale
                az = max(straight - hz * abs(rise) * scale * slope, 0.0)
    seconds = _upwind(ax, hx, ay, hy, az, hz, speed)
    sees = False
    if straight >= 0.0:
        seconds = max(seconds, straight)
        sees = seconds <= IN_SIGHT * straight + IMPROVED_S
    if seconds < m.time_s[cell] - IMPROVED_S:
        m.in_sight[cell] = sees
        put_in_bucket(m, cell, seconds)


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
        if level + 1 == levels.depth:
            return np.inf, width, False
        p = (low[level, 0] + u) // 2 - low[level + 1, 0]
        q = (low[level, 1] + v) // 2 - low[level + 1, 1]
        cell = (((level + 1) * n + p) * n + q) * layers + k
        time = m.time_s[cell]
        # Coarse cells lie half a cell to the side: between two of them, a quarter of the way.
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
    if is_covered(levels, level, u, v):
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
        return float(seconds)
    w, x = 1.0 / (hx * hx), 1.0 / (hy * hy)
    a, b, c = w + x, w * ax + x * ay, w * ax * ax + x * ay * ay - 1.0 / (speed * speed)
    root = b * b - a * c
    if root < 0.0:
        return float(seconds)
    seconds = min(seconds, (b + np.sqrt(root)) / a)
    if seconds <= az:
        return float(seconds)
    w = 1.0 / (hz * hz)
    a, b, c = a + w, b + w * az, c + w * az * az
    root = b * b - a * c
    if root < 0.0:
        return float(seconds)
    return float(min(seconds, (b + np.sqrt(root)) / a))
