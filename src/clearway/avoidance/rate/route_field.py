"""The route field: the time that it takes to the target from every place around, round all that is
known to stand there.

The cost to go of a decision asks it, and ways round are found by descending it. It is made by
`live.routing`. Cells are fine about the vehicle and coarse far off: each level of a field is a
square of as many cells, twice as wide as those of the level before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats4
from clearway.base.brief import brief
from clearway.base.compiled import compiled

BESIDE = 2
"""Cells about a place none of whose corners has a way, in which one is looked for: the place itself
may be free where the middles of cells are not."""


class Pace(NamedTuple):
    """How fast a vehicle gets on where nothing stands near."""

    fastest_mps: float
    acceleration_mps2: float
    """It slows down with that before the target; inf: not at all."""
    arrives_mps: float
    """Speed that it has left at the target."""
    climb_mps: float
    sink_mps: float

    def __repr__(self) -> str:
        return brief(self)


class RouteField(NamedTuple):
    """The time to go to a target from the middles of cells, in levels and in layers of height."""

    time_s: Floats4
    """[levels, n, n, layers] inf where no way is known."""
    speed_mps: Floats4
    """[levels, n, n, layers] of the way on from there; 0 where something stands."""
    low_m: Floats2
    """[levels, 2] lowest corner of each level, the finest first."""
    width_m: float
    """Edge of the finest cells."""
    lowest_m: float
    """Height of the lowest layer."""
    layer_m: float
    """From one layer to the next."""
    target_m: Floats
    """[3]"""
    pace: Pace

    def __repr__(self) -> str:
        return brief(self)


class PlacedRoute(NamedTuple):
    """A route field, and where the level frame of a decision lies in it."""

    field: RouteField
    origin_m: Floats
    """[3] world frame."""
    yaw_rad: float

    def __repr__(self) -> str:
        return brief(self)


@compiled
def time_to_go(
    field: RouteField, x: float, y: float, z: float
) -> tuple[float, float, float, float, float]:
    """Return the seconds from a place to the target, the direction to fly to it, and the speed.

    Parameters
    ----------
    field
        Its levels hold the places that it was made for; beyond them the straight way counts.
    x, y, z
        Metres, world frame.

    Returns
    -------
    tuple
        Seconds, inf where no way is known; unit vector of the way on, zeros where there is none;
        metres per second.
    """
    levels, n, _, layers = field.time_s.shape
    k, share = 0, 0.0
    if layers > 1:
        height = (z - field.lowest_m) / field.layer_m
        k = min(max(int(np.floor(height)), 0), layers - 2)
        share = min(max(height - k, 0.0), 1.0)
    width = field.width_m
    for level in range(levels):
        u, v = (x - field.low_m[level, 0]) / width - 0.5, (y - field.low_m[level, 1]) / width - 0.5
        if u >= 0.0 and v >= 0.0 and u < n - 1.0 and v < n - 1.0:
            found = _within_level(field, level, u, v, k, share, width)
            return _with_height(field, found, z)
        width *= 2.0
    target = field.target_m
    return straight_time(field.pace, target[0] - x, target[1] - y, target[2] - z)


@compiled
def straight_time(
    pace: Pace, dx: float, dy: float, dz: float
) -> tuple[float, float, float, float, float]:
    """Return what `time_to_go` does, where nothing stands between a place and the target.

    Parameters
    ----------
    pace
    dx, dy, dz
        From the place to the target, in metres.
    """
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if length <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, pace.arrives_mps
    far = level_length(pace, dx, dy, dz)
    return (
        time_along(pace, far),
        dx / length,
        dy / length,
        dz / length,
        speed_along(pace, far),
    )


@compiled
def level_length(pace: Pace, dx: float, dy: float, dz: float) -> float:
    """Return the level way that takes as long as one by (dx, dy, dz): climbing takes longer."""
    up = dz * pace.fastest_mps / (pace.climb_mps if dz > 0.0 else pace.sink_mps)
    return float(np.sqrt(dx * dx + dy * dy + up * up))


@compiled
def speed_along(pace: Pace, left_m: float) -> float:
    """Return the speed with some metres left to the target."""
    if pace.acceleration_mps2 == np.inf:
        return pace.fastest_mps
    slowed = np.sqrt(2.0 * pace.acceleration_mps2 * left_m) + pace.arrives_mps
    return float(min(pace.fastest_mps, slowed))


@compiled
def time_along(pace: Pace, left_m: float) -> float:
    """Return the seconds for the last metres of a straight way to the target.

    The integral of 1 / (sqrt(2 a s) + c) up to where that is the greatest speed.
    """
    a, c = pace.acceleration_mps2, pace.arrives_mps
    if a == np.inf:
        return left_m / pace.fastest_mps
    most = max(pace.fastest_mps - c, 0.0)
    slowed_m = min(left_m, most * most / (2.0 * a))
    gained = np.sqrt(2.0 * a * slowed_m)
    return float((gained - c * np.log1p(gained / c)) / a + (left_m - slowed_m) / pace.fastest_mps)


@compiled
def _with_height(
    field: RouteField, found: tuple[float, float, float, float, float], z: float
) -> tuple[float, float, float, float, float]:
    """What lies beyond the layers, or beside the only one, climbs or sinks besides."""
    seconds, dx, dy, _, speed = found
    layers = field.time_s.shape[3]
    highest = field.lowest_m + (layers - 1) * field.layer_m
    rise = min(max(z, field.lowest_m), highest) - z
    if layers == 1:
        rise = field.target_m[2] - z
    if rise == 0.0 or seconds == np.inf or speed <= 0.0:
        return found
    climb = rise / (field.pace.climb_mps if rise > 0.0 else field.pace.sink_mps)
    total = np.sqrt(seconds * seconds + climb * climb)
    level, up = speed * seconds, rise
    length = np.sqrt(level * level + up * up)
    if length <= 0.0:
        return found
    return total, dx * level / length, dy * level / length, up / length, speed


@compiled
def _within_level(
    field: RouteField, level: int, u: float, v: float, k: int, share: float, width: float
) -> tuple[float, float, float, float, float]:
    """What stands between the middles of cells about a place; u, v: in cells, from the first's."""
    time, speed = field.time_s, field.speed_mps
    i, j = int(np.floor(u)), int(np.floor(v))
    p, q = u - i, v - j
    over = k + 1 if time.shape[3] > 1 else k
    t00 = (1.0 - share) * time[level, i, j, k] + share * time[level, i, j, over]
    t01 = (1.0 - share) * time[level, i, j + 1, k] + share * time[level, i, j + 1, over]
    t10 = (1.0 - share) * time[level, i + 1, j, k] + share * time[level, i + 1, j, over]
    t11 = (1.0 - share) * time[level, i + 1, j + 1, k] + share * time[level, i + 1, j + 1, over]
    if not t00 + t01 + t10 + t11 < np.inf:
        return _beside(field, level, u, v, k + share, width)
    seconds = (1.0 - p) * ((1.0 - q) * t00 + q * t01) + p * ((1.0 - q) * t10 + q * t11)
    x = ((1.0 - q) * (t10 - t00) + q * (t11 - t01)) / width
    y = ((1.0 - p) * (t01 - t00) + p * (t11 - t10)) / width
    up, fast = 0.0, 0.0
    for a, b, part in (
        (i, j, (1.0 - p) * (1.0 - q)),
        (i, j + 1, (1.0 - p) * q),
        (i + 1, j, p * (1.0 - q)),
        (i + 1, j + 1, p * q),
    ):
        below, above = time[level, a, b, k], time[level, a, b, over]
        if over > k:
            up += part * (above - below) / field.layer_m
        fast += part * ((1.0 - share) * speed[level, a, b, k] + share * speed[level, a, b, over])
    climbs = field.pace.climb_mps if up < 0.0 else field.pace.sink_mps
    up *= (climbs / field.pace.fastest_mps) ** 2
    steep = np.sqrt(x * x + y * y + up * up)
    if steep <= 0.0:
        return seconds, 0.0, 0.0, 0.0, fast
    return seconds, -x / steep, -y / steep, -up / steep, fast


@compiled
def _beside(
    field: RouteField, level: int, u: float, v: float, height: float, width: float
) -> tuple[float, float, float, float, float]:
    """The least over the middles of cells beside a place and the way to them."""
    _, n, _, layers = field.time_s.shape
    best, to_x, to_y, to_z, fast = np.inf, 0.0, 0.0, 0.0, 0.0
    i, j, k = int(np.floor(u)), int(np.floor(v)), int(np.floor(height))
    for far in range(BESIDE + 1):
        for a in range(max(i - far, 0), min(i + far + 2, n)):
            for b in range(max(j - far, 0), min(j + far + 2, n)):
                for c in range(k, min(k + 2, layers)):
                    there = field.speed_mps[level, a, b, c]
                    if not field.time_s[level, a, b, c] < np.inf or there <= 0.0:
                        continue
                    dx, dy, dz = (a - u) * width, (b - v) * width, (c - height) * field.layer_m
                    if layers == 1:
                        dz = 0.0
                    way = level_length(field.pace, dx, dy, dz)
                    seconds = field.time_s[level, a, b, c] + way / there
                    if seconds < best:
                        best, to_x, to_y, to_z, fast = seconds, dx, dy, dz, there
        if best < np.inf:
            break
    length = np.sqrt(to_x * to_x + to_y * to_y + to_z * to_z)
    if length <= 0.0:
        return best, 0.0, 0.0, 0.0, fast
    return best, to_x / length, to_y / length, to_z / length, fast
