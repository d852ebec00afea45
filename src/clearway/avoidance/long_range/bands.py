"""Bands: which headings, climbs and speeds lead into whose volumes, one thing changed at a time.

A heading is turned to at the vehicle's rate the short way round, a climb or a speed is taken up
after its onset; then all fly straight on. Where nothing of a kind is free, the largest share of the
volume that something keeps is looked for: those are the recovery bands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import BoolArray, IntArray
from clearway.traffic.intruder import Intruder
from clearway.traffic.volumes.interval import find_shared_interval
from clearway.traffic.volumes.volume import AirVolume, AlertLevel, VolumeSet
from clearway.vehicle.performance import Performance

HEADINGS = 72
_HEADINGS_RAD = wrap_angle(2.0 * np.pi * np.arange(HEADINGS) / HEADINGS)
_ASCENDING = np.argsort(_HEADINGS_RAD)
CLIMBS = 31
SPEEDS = 21
RECOVERY_SHARES = tuple(np.linspace(0.9, 0.1, 9).tolist())
"""Of what lies between the outermost volume and the innermost; the largest free share counts."""


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """One quantity's values, and what each leads to."""

    values: FloatArray
    """[n] ascending: headings in radians from the own course, left positive; else m/s."""
    levels: IntArray
    """[n] the worst alert that flying at the value would keep or bring."""
    recovery: BoolArray
    """[n] which values regain, where none is free."""

    @property
    def saturated(self) -> bool:
        """Whether every value leads to a corrective alert or worse."""
        return bool((self.levels >= AlertLevel.CORRECTIVE).all())

    def as_runs(self) -> list[dict[str, Any]]:
        """Runs of values alike, ends included, for machines."""
        runs: list[dict[str, Any]] = []
        for value, level, recovers in zip(self.values, self.levels, self.recovery, strict=True):
            name = "recovery" if recovers else AlertLevel(int(level)).name.lower()
            end = round(float(value), 2)
            if runs and runs[-1]["level"] == name:
                runs[-1]["to"] = end
            else:
                runs.append({"from": end, "to": end, "level": name})
        return runs


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """What the vehicle may do now."""

    heading: Band
    climb: Band
    speed: Band
    course_rad: float
    """Own course in the world frame, from x (east) to the left: what headings count from."""

    @property
    def compass(self) -> Band:
        """The band of headings in degrees clockwise from north (y of the world), [0, 360)."""
        clockwise = 90.0 - np.degrees(self.course_rad + self.heading.values)
        degrees = np.mod(np.round(clockwise, 6), 360.0)
        order = np.argsort(degrees)
        return Band(degrees[order], self.heading.levels[order], self.heading.recovery[order])

    @property
    def saturated(self) -> bool:
        """Whether no single change of course, climb or speed stays outside of the volumes."""
        return self.heading.saturated and self.climb.saturated and self.speed.saturated

    def as_dict(self) -> dict[str, Any]:
        """For machines: degrees clockwise from north, and m/s.

        The run of headings that goes on over north ends at the last value below 360 and begins
        again at the first one.
        """
        return {
            "heading_deg": self.compass.as_runs(),
            "climb_mps": self.climb.as_runs(),
            "speed_mps": self.speed.as_runs(),
            "saturated": self.saturated,
        }


def bands(
    volumes: VolumeSet,
    performance: Performance,
    own_m: FloatArray,
    own_mps: FloatArray,
    intruders: Sequence[Intruder],
    time_s: float,
) -> Bands:
    """Bands for an own position [3] and velocity [3] in the intruders' frame, at a time.

    Buffers of the volumes are kept.
    """
    there = [intruder.at(time_s) for intruder in intruders]
    apart = np.array([one.position_m for one in there]).reshape(-1, 3) - own_m
    flies = np.array([one.velocity_mps for one in there]).reshape(-1, 3)
    able = _able(performance, own_mps)
    shapes, level = _rules(volumes)
    speed = math.hypot(float(own_mps[0]), float(own_mps[1]))
    headings = _HEADINGS_RAD
    climbs = np.linspace(-performance.sink_mps, performance.climb_mps, CLIMBS)
    slowest, fastest = min(performance.slowest_mps, speed), max(performance.fastest_mps, speed)
    speeds = np.linspace(slowest, fastest, SPEEDS)
    found = _levels(apart, flies, own_mps, able, shapes, level, headings, climbs, speeds)
    values = (headings[_ASCENDING], climbs, speeds)
    by_heading = found[0][_ASCENDING]
    made = [
        Band(each, levels, np.zeros(len(each), dtype=np.bool_))
        for each, levels in zip(values, (by_heading, found[1], found[2]), strict=True)
    ]
    if any(band.saturated for band in made):
        made = _with_recovery(made, volumes, apart, flies, own_mps, able)
    course_rad = math.atan2(float(own_mps[1]), float(own_mps[0]))
    return Bands(made[0], made[1], made[2], course_rad)


@lru_cache(maxsize=16)
def _rules(volumes: VolumeSet) -> tuple[FloatArray, IntArray]:
    """Shapes [rules, 5] and levels [rules], the worst first."""
    worst_first = sorted(volumes.rules, key=lambda rule: -rule.level)
    shapes = np.array([_shape(rule.volume.kept, rule.within_s) for rule in worst_first])
    levels = np.array([int(rule.level) for rule in worst_first], dtype=np.int64)
    return shapes.reshape(-1, 5), levels


def _shape(volume: AirVolume, within_s: float) -> tuple[float, ...]:
    return (volume.radius_m, volume.half_height_m, volume.tau_s, volume.growth_mps, within_s)


def _able(performance: Performance, own_mps: FloatArray) -> FloatArray:
    """What the compiled loops need: turn rate, delays of turn and climb, acceleration."""
    speed = max(math.hypot(float(own_mps[0]), float(own_mps[1])), performance.slowest_mps, 1e-3)
    return np.array(
        [
            performance.turn_rps(speed),
            performance.reaction_s + performance.turn_onset_s,
            performance.reaction_s + performance.climb_onset_s,
            performance.acceleration_mps2,
        ]
    )


def _with_recovery(
    made: list[Band],
    volumes: VolumeSet,
    apart: FloatArray,
    flies: FloatArray,
    own_mps: FloatArray,
    able: FloatArray,
) -> list[Band]:
    """The saturated bands with what keeps most of the outermost volume."""
    outer, inner = volumes.outermost.kept, volumes.innermost
    within_s = volumes.look_ahead_s
    needed = [band.saturated for band in made]
    found = list(made)
    one = np.array([1], dtype=np.int64)
    for share in RECOVERY_SHARES:
        between = AirVolume(
            "between",
            inner.radius_m + share * (outer.radius_m - inner.radius_m),
            inner.half_height_m + share * (outer.half_height_m - inner.half_height_m),
        )
        shape = np.array([_shape(between, within_s)])
        levels = _levels(
            apart, flies, own_mps, able, shape, one, _HEADINGS_RAD, made[1].values, made[2].values
        )
        each = (levels[0][_ASCENDING], levels[1], levels[2])
        for n in range(3):
            free = each[n] == 0
            if needed[n] and free.any():
                found[n] = Band(made[n].values, made[n].levels, free)
                needed[n] = False
        if not any(needed):
            break
    return found


@compiled
def _levels(
    apart: Floats2,
    flies: Floats2,
    own: Floats,
    able: Floats,
    shapes: Floats2,
    level: Ints,
    headings: Floats,
    climbs: Floats,
    speeds: Floats,
) -> tuple[Ints, Ints, Ints]:
    """Levels of headings, climbs and speeds: the first of the shapes, the worst first, that is
    entered. apart, flies: [intruders, 3] from the vehicle; shapes: [rules, 5]."""
    turn, turn_after, climb_after, gain = able
    speed, course = np.hypot(own[0], own[1]), np.arctan2(own[1], own[0])
    of_heading = np.zeros(len(headings), dtype=np.int64)
    of_climb = np.zeros(len(climbs), dtype=np.int64)
    of_speed = np.zeros(len(speeds), dtype=np.int64)
    half = len(headings) // 2
    step = 2.0 * np.pi / len(headings)
    step_s = step / turn
    for k in range(len(apart)):
        for r in range(len(shapes)):
            radius, height, tau, growth, within = shapes[r]
            # Straight on until the turn begins, then arcs in chords, each heading a tail of them.
            for way in (1, -1):
                x, y, z = apart[k, 0], apart[k, 1], apart[k, 2]
                vx, vy, vz = flies[k, 0] - own[0], flies[k, 1] - own[1], flies[k, 2] - own[2]
                entered = _enters(x, y, z, vx, vy, vz, radius, height, tau, growth, turn_after)
                x, y, z = x + turn_after * vx, y + turn_after * vy, z + turn_after * vz
                passed = turn_after
                for n in range(half + 1):
                    if n > 0:
                        between = course + way * (n - 0.5) * step
                        vx = flies[k, 0] - speed * np.cos(between)
                        vy = flies[k, 1] - speed * np.sin(between)
                        if passed < within and not entered:
                            entered = _enters(
                                x, y, z, vx, vy, vz, radius, height, tau, growth, step_s
                            )
                        x, y, z = x + step_s * vx, y + step_s * vy, z + step_s * vz
                        passed += step_s
                    ahead = course + way * n * step
                    at = (way * n) % len(headings)
                    if of_heading[at] >= level[r]:
                        continue
                    if entered:
                        of_heading[at] = level[r]
                        continue
                    vx = flies[k, 0] - speed * np.cos(ahead)
                    vy = flies[k, 1] - speed * np.sin(ahead)
                    left = within - passed
                    if left > 0.0 and _enters(
                        x, y, z, vx, vy, vz, radius, height, tau, growth, left
                    ):
                        of_heading[at] = level[r]
            x, y, z = apart[k, 0], apart[k, 1], apart[k, 2]
            vx, vy, vz = flies[k, 0] - own[0], flies[k, 1] - own[1], flies[k, 2] - own[2]
            entered = _enters(x, y, z, vx, vy, vz, radius, height, tau, growth, climb_after)
            for n in range(len(climbs)):
                if of_climb[n] >= level[r]:
                    continue
                t = climb_after
                if entered or _enters(
                    x + t * vx, y + t * vy, z + t * vz, vx, vy, flies[k, 2] - climbs[n],
                    radius, height, tau, growth, within - t,
                ):  # fmt: skip
                    of_climb[n] = level[r]
            for n in range(len(speeds)):
                if of_speed[n] >= level[r]:
                    continue
                # The mean speed until the new one is reached, and then that.
                t = abs(speeds[n] - speed) / gain + turn_after
                mean = 0.5 * (speeds[n] + speed)
                wx, wy = flies[k, 0] - mean * np.cos(course), flies[k, 1] - mean * np.sin(course)
                until = min(t, within)
                if _enters(x, y, z, wx, wy, vz, radius, height, tau, growth, until):
                    of_speed[n] = level[r]
                    continue
                if t < within and _enters(
                    x + t * wx, y + t * wy, z + t * vz,
                    flies[k, 0] - speeds[n] * np.cos(course),
                    flies[k, 1] - speeds[n] * np.sin(course),
                    vz, radius, height, tau, growth, within - t,
                ):  # fmt: skip
                    of_speed[n] = level[r]
    return of_heading, of_climb, of_speed


@compiled
def _enters(
    x: float,
    y: float,
    z: float,
    vx: float,
    vy: float,
    vz: float,
    radius: float,
    height: float,
    tau: float,
    growth: float,
    within: float,
) -> bool:
    begins, ends = find_shared_interval(x, y, z, vx, vy, vz, radius, height, tau, growth, within)
    return begins <= ends
