"""Profiles rated against other aircraft: which nested volumes they lead into, and how likely.

Level and vertical profiles are held apart: one bit a second says whether a level profile may come
within a volume's radius then, one whether a climb may come within its height. Both at once is a
conflict. The probability of being inside is put together likewise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.avoidance.long_range.profiles import SECONDS, Profiles
from clearway.base.arrays import Floats, Floats2, Floats3, Ints2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.traffic.growth import TwoKinds
from clearway.traffic.volumes.volume import VolumeSet

EVERY_S = 2
"""Probabilities are taken this often."""
TURN_FADES_S = 10.0
"""Time constant with which a turn is taken to end."""
SURE = 1e-3
"""Smallest deviation, m."""


class Other(NamedTuple):
    """Another aircraft now, and how it strays."""

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""
    position_std_m: float
    height_std_m: float
    velocity_std_mps: float
    climb_std_mps: float
    growth: tuple[TwoKinds, TwoKinds]
    """Of its place per m/s of speed, and of its height."""
    turn_rps: float = 0.0
    """Turn rate that its reports show; it is taken to fade."""


class RatedProfiles(NamedTuple):
    """What flying each pair of profiles leads to."""

    tier: IntArray
    """[level, climbs] how many nested volumes are entered if all fly straight on: 0 none, 1 the
    outermost with its buffer, 2 the outermost itself, and so on inwards."""
    within_s: FloatArray
    """[level, climbs] when the deepest of those is entered; inf for none."""
    probability: FloatArray
    """[volumes, level, climbs] of being inside at the worst moment."""


def rate_profiles(ways: Profiles, others: Sequence[Other], volumes: VolumeSet) -> RatedProfiles:
    """The worst of all others for tiers; probabilities as of independent ones."""
    level, climbs = len(ways.level_m), len(ways.height_m)
    shapes = _shapes(volumes)
    tier = np.zeros((level, climbs), dtype=np.int64)
    within = np.full((level, climbs), np.inf)
    clear = np.ones((len(shapes) - 1, level, climbs))
    for other in others:
        path = _path(other.position_m, other.velocity_mps, other.turn_rps)
        _tiers(ways.level_m, ways.height_m, path, shapes, tier, within)
        speed = math.hypot(float(other.velocity_mps[0]), float(other.velocity_mps[1]))
        of_place, of_height = other.growth
        spread = _deviations(of_place, speed, other.position_std_m, other.velocity_std_mps)
        heights = _deviations(of_height, 1.0, other.height_std_m, other.climb_std_mps)
        _probabilities(ways.level_m, ways.height_m, path, shapes[1:], spread, heights, clear)
    return RatedProfiles(tier, within, 1.0 - clear)


@lru_cache(maxsize=16)
def _shapes(volumes: VolumeSet) -> FloatArray:
    """[1 + volumes, 2] radii and half heights: the outermost with its buffer, then each itself."""
    kept = volumes.volumes
    return np.array(
        [(kept[0].kept.radius_m, kept[0].kept.half_height_m)]
        + [(one.radius_m, one.half_height_m) for one in kept]
    )


AHEAD_S = np.arange(0.0, SECONDS + 1.0, EVERY_S)


@lru_cache(maxsize=32)
def _ahead(kinds: TwoKinds) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What is known of straying at the moments that are looked at."""
    return kinds.at(AHEAD_S)


def _deviations(kinds: TwoKinds, scale: float, std: float, rate_std: float) -> FloatArray:
    """[3, n] share that manoeuvres, and both deviations with what is unsure of the track."""
    share, steady, manoeuvring = _ahead(kinds)
    unsure = std**2 + (rate_std * AHEAD_S) ** 2
    found: FloatArray = np.array(
        [
            share,
            np.sqrt(unsure + (scale * steady) ** 2 + SURE**2),
            np.sqrt(unsure + (scale * manoeuvring) ** 2 + SURE**2),
        ]
    )
    return found


@compiled
def _path(place: Floats, velocity: Floats, turn_rps: float) -> Floats2:
    """[SECONDS + 1, 3] where it is taken to be: a turn that fades, then straight on."""
    path = np.empty((SECONDS + 1, 3))
    path[0] = place
    vx, vy = velocity[0], velocity[1]
    for k in range(SECONDS):
        angle = turn_rps * np.exp(-(k + 0.5) / TURN_FADES_S)
        half_c, half_s = np.cos(0.5 * angle), np.sin(0.5 * angle)
        path[k + 1, 0] = path[k, 0] + vx * half_c - vy * half_s
        path[k + 1, 1] = path[k, 1] + vx * half_s + vy * half_c
        path[k + 1, 2] = path[k, 2] + velocity[2]
        c, s = np.cos(angle), np.sin(angle)
        vx, vy = vx * c - vy * s, vx * s + vy * c
    return path


@compiled
def _tiers(
    level: Floats3,
    height: Floats2,
    path: Floats2,
    shapes: Floats2,
    tier: Ints2,
    within: Floats2,
) -> None:
    """Raise `tier`, and set `within`, where another aircraft's volumes are entered."""
    kinds = len(shapes)
    near = np.zeros((len(level), kinds), dtype=np.uint64)
    beside = np.zeros((len(height), kinds), dtype=np.uint64)
    one = np.uint64(1)
    for n in range(len(level)):
        for k in range(SECONDS):
            x, y = path[k, 0] - level[n, k, 0], path[k, 1] - level[n, k, 1]
            dx = path[k + 1, 0] - level[n, k + 1, 0] - x
            dy = path[k + 1, 1] - level[n, k + 1, 1] - y
            fast2 = dx * dx + dy * dy
            when = 0.0
            if fast2 > 0.0:
                when = min(max(-(x * dx + y * dy) / fast2, 0.0), 1.0)
            x, y = x + when * dx, y + when * dy
            apart2 = x * x + y * y
            for s in range(kinds):
                if apart2 < shapes[s, 0] * shapes[s, 0]:
                    near[n, s] |= one << np.uint64(k)
                else:
                    break
    for n in range(len(height)):
        for k in range(SECONDS):
            low = path[k, 2] - height[n, k]
            high = path[k + 1, 2] - height[n, k + 1]
            least = 0.0 if low * high < 0.0 else min(abs(low), abs(high))
            for s in range(kinds):
                if least < shapes[s, 1]:
                    beside[n, s] |= one << np.uint64(k)
                else:
                    break
    for n in range(len(level)):
        for m in range(len(height)):
            for s in range(kinds - 1, -1, -1):
                both = near[n, s] & beside[m, s]
                if both:
                    first = 0
                    while not (both >> np.uint64(first)) & one:
                        first += 1
                    if s + 1 > tier[n, m]:
                        tier[n, m], within[n, m] = s + 1, first
                    elif s + 1 == tier[n, m]:
                        within[n, m] = min(within[n, m], first)
                    break


@compiled
def _probabilities(
    level: Floats3,
    height: Floats2,
    path: Floats2,
    shapes: Floats2,
    spread: Floats2,
    heights: Floats2,
    clear: Floats3,
) -> None:
    """Multiply `clear` [volumes, level, climbs] by the chance of staying outside, at the worst
    moment."""
    moments, climbs = spread.shape[1], len(height)
    beside = np.empty((moments, climbs))
    likely, across = np.empty(moments), np.empty((2, moments))
    worst = np.empty(climbs)
    for s in range(len(shapes)):
        radius, half = shapes[s, 0], shapes[s, 1]
        for k in range(moments):
            t, share, likely[k] = EVERY_S * k, heights[0, k], 0.0
            across[0, k] = across_disc(spread[1, k], radius)
            across[1, k] = across_disc(spread[2, k], radius)
            for m in range(climbs):
                off = path[t, 2] - height[m, t]
                beside[k, m] = (1.0 - share) * in_slab(off, heights[1, k], half)
                beside[k, m] += share * in_slab(off, heights[2, k], half)
                likely[k] = beside[k, m] if beside[k, m] > likely[k] else likely[k]
        for n in range(len(level)):
            worst[:] = 0.0
            for k in range(moments):
                if likely[k] == 0.0:
                    continue
                t, share = EVERY_S * k, spread[0, k]
                x, y = path[t, 0] - level[n, t, 0], path[t, 1] - level[n, t, 1]
                apart = np.sqrt(x * x + y * y)
                near = 0.0
                if apart <= radius + 6.0 * spread[1, k]:
                    near = (1.0 - share) * (across[0, k] * in_slab(apart, spread[1, k], radius))
                if apart <= radius + 6.0 * spread[2, k]:
                    near += share * (across[1, k] * in_slab(apart, spread[2, k], radius))
                if near == 0.0:
                    continue
                for m in range(climbs):
                    inside = near * beside[k, m]
                    worst[m] = inside if inside > worst[m] else worst[m]
            for m in range(climbs):
                clear[s, n, m] *= 1.0 - worst[m]


@compiled
def across_disc(std: float, radius: float) -> float:
    """Chance that a place with a deviation per axis is within half the mean chord of a disc.

    Times `in_slab` it is that of the disc, as a rectangle of that width: within 0.04 of the truth.
    """
    return math.erf(0.25 * math.pi * radius / (std * math.sqrt(2.0)))


@compiled
def in_slab(off: float, std: float, half: float) -> float:
    """Chance that a height with a deviation, expected so far off, is within a half height."""
    scale = 1.0 / (std * math.sqrt(2.0))
    return 0.5 * (math.erf((half - off) * scale) + math.erf((half + off) * scale))
