"""What the vehicle may fly in the next minute: courses at two speeds, and climbs, apart."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats3
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.vehicle.performance import Performance

SECONDS = 64
"""Looked ahead: a bit for each."""
COURSES = 25
CLIMBS = 14
LATER_S = (10.0, 20.0)
"""When climbs and descents that begin later begin."""


class Motion(NamedTuple):
    """Own motion now, level frame of the world."""

    position_m: FloatArray
    """[3]"""
    course_rad: float
    speed_mps: float
    climb_mps: float


class Wanted(NamedTuple):
    """What would be flown without traffic."""

    course_rad: float
    speed_mps: float
    height_m: float


class Profiles(NamedTuple):
    """Ways to fly, from now on."""

    course_rad: FloatArray
    """[level] absolute; the first is what is wanted."""
    speed_mps: FloatArray
    """[level]"""
    climb_mps: FloatArray
    """[climbs] at first; the first of all leads to the height that is wanted."""
    begins_s: FloatArray
    """[climbs] when the climb begins."""
    level_m: FloatArray
    """[level, SECONDS + 1, 2]"""
    height_m: FloatArray
    """[climbs, SECONDS + 1]"""


def profiles(
    motion: Motion,
    wanted: Wanted,
    performance: Performance,
    floor_m: float = -math.inf,
    ceiling_m: float = math.inf,
    *,
    only_wanted: bool = False,
) -> Profiles:
    """The profiles of a vehicle, none of which leaves floor or ceiling that it is within.

    only_wanted: the first of each alone.
    """
    speed, first_climb, begins = _offer(wanted.speed_mps, performance)
    both = np.empty((2, COURSES))
    both[:, :-1] = wanted.course_rad + _AROUND_RAD
    both[:, -1] = motion.course_rad
    course, climb = both.ravel(), first_climb.copy()
    if only_wanted:
        course, speed, climb, begins = course[:1], speed[:1], climb[:1], begins[:1]
    off = wanted.height_m - float(motion.position_m[2])
    climb[0] = min(max(off, -performance.sink_mps), performance.climb_mps)
    level = _level_ways(
        motion.position_m[0],
        motion.position_m[1],
        motion.course_rad,
        motion.speed_mps,
        course,
        speed,
        performance.turn_mps2,
        performance.acceleration_mps2,
        performance.reaction_s + performance.turn_onset_s,
    )
    height = _height_ways(
        motion.position_m[2],
        motion.climb_mps,
        climb,
        begins,
        wanted.height_m,
        performance.reaction_s + performance.climb_onset_s,
        floor_m,
        ceiling_m,
    )
    return Profiles(course, speed, climb, begins, level, height)


_AROUND_RAD = np.concatenate([[0.0], 2.0 * np.pi * np.arange(1, COURSES - 1) / (COURSES - 1)])


@lru_cache(maxsize=16)
def _offer(speed_mps: float, performance: Performance) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speeds [level], climbs and when these begin [climbs]: the same at every decision."""
    rates = np.array([1.0, 0.75, 0.5, 0.25])
    climb = np.concatenate(
        [
            [0.0, 0.0],
            rates * performance.climb_mps,
            -rates * performance.sink_mps,
            [performance.climb_mps, performance.climb_mps],
            [-performance.sink_mps, -performance.sink_mps],
        ]
    )
    begins = np.concatenate([np.zeros(2 + 2 * len(rates)), LATER_S, LATER_S])
    return np.repeat([speed_mps, _slow(speed_mps, performance)], COURSES), climb, begins


def _slow(speed_mps: float, performance: Performance) -> float:
    """Slow enough to let others pass, and fast enough to go somewhere."""
    return max(performance.slowest_mps, 0.5 * speed_mps)


@compiled
def _level_ways(
    x0: float,
    y0: float,
    course0: float,
    speed0: float,
    course: Floats,
    speed: Floats,
    across: float,
    along: float,
    delay: float,
) -> Floats3:
    """[n, SECONDS + 1, 2] straight on until the delay is over, then a turn the short way round."""
    ways = np.empty((len(course), SECONDS + 1, 2))
    step = 0.5
    for n in range(len(course)):
        x, y, now, v = x0, y0, course0, speed0
        left = (course[n] - course0 + np.pi) % (2.0 * np.pi) - np.pi
        cos, sin = np.cos(now), np.sin(now)
        ways[n, 0, 0], ways[n, 0, 1] = x, y
        for k in range(1, 2 * SECONDS + 1):
            if k * step > delay:
                most = across / max(v, 1.0) * step
                turn = min(max(left, -most), most)
                v += min(max(speed[n] - v, -along * step), along * step)
                if turn != 0.0:
                    left -= turn
                    x += v * step * np.cos(now + 0.5 * turn)
                    y += v * step * np.sin(now + 0.5 * turn)
                    now += turn
                    if left == 0.0:
                        cos, sin = np.cos(now), np.sin(now)
                    if k % 2 == 0:
                        ways[n, k // 2, 0], ways[n, k // 2, 1] = x, y
                    continue
            x += v * step * cos
            y += v * step * sin
            if k % 2 == 0:
                ways[n, k // 2, 0], ways[n, k // 2, 1] = x, y
    return ways


@compiled
def _height_ways(
    z0: float,
    climb0: float,
    climb: Floats,
    begins: Floats,
    wanted: float,
    delay: float,
    floor: float,
    ceiling: float,
) -> Floats2:
    """[n, SECONDS + 1]; the first stops at the height wanted, all at floor and ceiling."""
    ways = np.empty((len(climb), SECONDS + 1))
    low, high = min(floor, z0), max(ceiling, z0)
    for n in range(len(climb)):
        z = z0
        ways[n, 0] = z
        for k in range(1, SECONDS + 1):
            late = delay + begins[n]
            # Of this second, how long the climb before it lasts yet.
            before = min(max(late - (k - 1), 0.0), 1.0)
            held = climb0 if begins[n] == 0.0 or k <= delay else 0.0
            move = before * held + (1.0 - before) * climb[n]
            if n == 0 and (wanted - z) * (wanted - z - move) <= 0.0 and k > delay:
                move = wanted - z
            z = min(max(z + move, low), high)
            ways[n, k] = z
    return ways
