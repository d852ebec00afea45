"""The march of time from the target outwards, over levels of cells: compiled loops."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.rate.route_field import Pace, time_along
from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.live.routing.field.filling_in import fill_in_rest, lean_away
from clearway.live.routing.field.route_levels import Levels, is_amid, is_covered, middle_of
from clearway.live.routing.field.wave import (
    BUCKETS,
    March,
    begin_in_cell,
    renew_time,
)

BUCKET = 0.7
"""Width of a bucket of time, in what the finest cell takes at the greatest speed."""


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
    bucket_s = BUCKET * levels.width_m / pace.fastest_mps
    m = begin_march(levels, pace, clearance_m, speed_mps, target, ends_within_m, bucket_s)
    found, bound = let_time_pass(m, vehicle, -1, slack_s, most_s)
    fill_in_rest(m, vehicle, bound if found else np.inf)
    lean_away(m, slow_mps)
    return m.time_s, found


@compiled
def begin_march(
    levels: Levels,
    pace: Pace,
    clearance_m: Floats,
    speed_mps: Floats,
    target: Floats,
    ends_within_m: float,
    bucket_s: float,
) -> March:
    """Return a march that begins at the target, as of `march`, with buckets of some width."""
    m = lay_out_march(levels, pace, clearance_m, speed_mps, target, bucket_s)
    _begin(m, ends_within_m)
    return m


@compiled
def lay_out_march(
    levels: Levels,
    pace: Pace,
    clearance_m: Floats,
    speed_mps: Floats,
    target: Floats,
    bucket_s: float,
) -> March:
    """Return a march that has not begun anywhere."""
    cells = levels.depth * levels.n * levels.n * levels.layers
    counts = np.zeros(4, dtype=np.int64)
    counts[0] = -1
    braking_m = 0.0
    if pace.acceleration_mps2 < np.inf:
        most = max(pace.fastest_mps - pace.arrives_mps, 0.0)
        braking_m = most * most / (2.0 * pace.acceleration_mps2)
    return March(
        levels,
        pace,
        target,
        braking_m,
        time_along(pace, braking_m),
        bucket_s,
        np.full(cells, np.inf),
        speed_mps,
        clearance_m,
        np.zeros(cells, dtype=np.bool_),
        np.zeros(cells, dtype=np.bool_),
        np.full(BUCKETS, -1, dtype=np.int64),
        np.empty(BUCKETS, dtype=np.int64),
        np.empty(4 * cells, dtype=np.int64),
        np.empty(4 * cells, dtype=np.int64),
        counts,
    )


@compiled
def let_time_pass(
    m: March, vehicle: Floats, own: int, slack_s: float, most_s: float
) -> tuple[bool, float]:
    """Let time march on until it has come to all places that may matter to a vehicle; return
    whether it came to the vehicle, and the time at which it ended.

    own: the vehicle's cell, or -1 for any beside it.
    """
    levels, pace = m.levels, m.pace
    n, layers = levels.n, levels.layers
    found, bound, near2 = False, most_s + slack_s, (1.6 * levels.width_m) ** 2
    upwards = pace.fastest_mps / max(pace.climb_mps, pace.sink_mps)
    highest = levels.lowest_m + (layers - 1) * levels.layer_m
    height = min(max(vehicle[2], levels.lowest_m), highest)
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
        x, y, z = middle_of(levels, level, i, j, k)
        dx, dy = vehicle[0] - x, vehicle[1] - y
        dz = (vehicle[2] - z) * upwards if layers > 1 else 0.0
        away2 = dx * dx + dy * dy
        beside = away2 <= near2 and (layers == 1 or abs(height - z) < levels.layer_m)
        if not found and (beside if own < 0 else cell == own):
            found, bound = True, min(bound, m.time_s[cell] + slack_s)
        if m.time_s[cell] + np.sqrt(away2 + dz * dz) / pace.fastest_mps <= bound:
            _spread(m, level, i, j, k)
    return found, bound


@compiled
def _begin(m: March, ends_within_m: float) -> None:
    """Let time begin at the target: in the cells about it, or the nearest that are free."""
    levels = m.levels
    n, width = levels.n, levels.width_m
    for level in range(levels.depth):
        i = int(np.floor(m.target[0] / width)) - levels.low[level, 0]
        j = int(np.floor(m.target[1] / width)) - levels.low[level, 1]
        if (0 <= i < n and 0 <= j < n) or level == levels.depth - 1:
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
            if max(abs(a - i), abs(b - j)) < far or is_covered(m.levels, level, a, b):
                continue
            for c in range(max(k - 1, 0), min(k + 2, layers)):
                cell = ((level * n + a) * n + b) * layers + c
                if m.speed_mps[cell] > 0.0:
                    begin_in_cell(m, cell, middle_of(m.levels, level, a, b, c))
                    found += 1
    return found


@compiled
def _spread(m: March, level: int, i: int, j: int, k: int) -> None:
    """Renew the times of the cells beside one that has a new one."""
    levels = m.levels
    n, layers, low = levels.n, levels.layers, levels.low
    here = ((level * n + i) * n + j) * layers + k
    since = m.time_s[here]
    if is_amid(levels, level, i, j):
        renew_time(m, here + n * layers, level, i + 1, j, k, since)
        renew_time(m, here - n * layers, level, i - 1, j, k, since)
        renew_time(m, here + layers, level, i, j + 1, k, since)
        renew_time(m, here - layers, level, i, j - 1, k, since)
    else:
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            u, v = i + a, j + b
            if u < 0 or v < 0 or u >= n or v >= n:
                if level + 1 < levels.depth:
                    p = (low[level, 0] + u) // 2 - low[level + 1, 0]
                    q = (low[level, 1] + v) // 2 - low[level + 1, 1]
                    cell = (((level + 1) * n + p) * n + q) * layers + k
                    renew_time(m, cell, level + 1, p, q, k, since)
            elif is_covered(levels, level, u, v):
                p = 2 * (low[level, 0] + u) - low[level - 1, 0] + (1 if a < 0 else 0)
                q = 2 * (low[level, 1] + v) - low[level - 1, 1] + (1 if b < 0 else 0)
                cell = (((level - 1) * n + p) * n + q) * layers + k
                renew_time(m, cell, level - 1, p, q, k, since)
                p, q = p + abs(b), q + abs(a)
                cell = (((level - 1) * n + p) * n + q) * layers + k
                renew_time(m, cell, level - 1, p, q, k, since)
            else:
                cell = ((level * n + u) * n + v) * layers + k
                renew_time(m, cell, level, u, v, k, since)
    if k > 0:
        renew_time(m, here - 1, level, i, j, k - 1, since)
    if k < layers - 1:
        renew_time(m, here + 1, level, i, j, k + 1, since)
