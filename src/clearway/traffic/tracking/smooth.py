"""A track of one aircraft kilometres away: straight flight with noise, horizontal and vertical
apart, compiled.

The same filter as `tracks.Track` where both have the same noise; for thousands of encounters.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.traffic.surveillance.heard import HeardOf

LEVEL_MPS2 = 1.5
"""How hard traffic is taken to turn or speed up: the gain of a velocity that is reported well is
then about 0.6 at a report a second."""
CLIMB_MPS2 = 0.7
UNKNOWN_MPS = 60.0
"""Deviation of the velocity before any was measured."""
TRACK_COAST_S = 12.0
"""A track lives so long without a report."""
TURNS_RPS = np.radians(1.5)
"""Slower turns are none."""
CLIMBS_MPS = 1.0
FADES_S = 3.0
"""Time constant of what is taken for the turn rate."""


class SmoothTrack(NamedTuple):
    """What is believed of one aircraft at a time."""

    time_s: float
    mean: FloatArray
    """[6] position and velocity."""
    level: FloatArray
    """[3] variance of position, covariance, variance of velocity; of either horizontal axis."""
    height: FloatArray
    """[3] likewise."""
    turn_rps: float
    reports: int
    stated_m: float
    """Deviation of place per axis that the last report states, and of height."""
    stated_height_m: float

    @property
    def position_std_m(self) -> float:
        """Of the place, per axis. Errors of one aircraft's reports hold on from one to the next, so
        that many of them know no better than one."""
        return max(math.sqrt(float(self.level[0])), self.stated_m)

    @property
    def height_std_m(self) -> float:
        """Likewise of the height: an altimeter that is off stays off."""
        return max(math.sqrt(float(self.height[0])), self.stated_height_m)

    @property
    def turns(self) -> bool:
        return abs(self.turn_rps) > float(TURNS_RPS)

    @property
    def climbs(self) -> bool:
        return abs(float(self.mean[5])) > CLIMBS_MPS

    def at(self, time_s: float) -> SmoothTrack:
        """Predicted to a time, straight on."""
        elapsed = time_s - self.time_s
        mean = self.mean.copy()
        mean[:3] += elapsed * mean[3:]
        return self._replace(
            time_s=time_s,
            mean=mean,
            level=np.array(_grow(self.level, elapsed, LEVEL_MPS2)),
            height=np.array(_grow(self.height, elapsed, CLIMB_MPS2)),
        )


def begin_track(heard: HeardOf) -> SmoothTrack:
    """The track of a first report."""
    told = heard.velocity_mps is not None
    mean = np.zeros(6)
    mean[:3] = heard.position_m
    if heard.velocity_mps is not None:
        mean[3:] = heard.velocity_mps
    fast = heard.velocity_std_mps if told else UNKNOWN_MPS
    steep = heard.climb_std_mps if told else 5.0
    return SmoothTrack(
        heard.time_s,
        mean,
        np.array([heard.position_std_m**2, 0.0, fast**2]),
        np.array([heard.height_std_m**2, 0.0, steep**2]),
        0.0,
        1,
        heard.position_std_m,
        heard.height_std_m,
    )


def follow_report(track: SmoothTrack | None, heard: HeardOf) -> SmoothTrack:
    """The track after its next report; late ones are left out, a long silence begins anew."""
    if track is None or heard.time_s - track.time_s > TRACK_COAST_S:
        return begin_track(heard)
    elapsed = heard.time_s - track.time_s
    if elapsed <= 0.0:
        return track
    told = heard.velocity_mps is not None
    velocity = heard.velocity_mps if heard.velocity_mps is not None else _NONE_MPS
    mean, level, height = np.empty(6), np.empty(3), np.empty(3)
    rate_rps = _follow(
        track.mean, track.level, track.height, track.turn_rps, elapsed, heard.position_m,
        velocity, told, heard.position_std_m, heard.height_std_m, heard.velocity_std_mps,
        heard.climb_std_mps, mean, level, height,
    )  # fmt: skip
    return SmoothTrack(
        heard.time_s, mean, level, height, rate_rps, track.reports + 1,
        heard.position_std_m, heard.height_std_m,
    )  # fmt: skip


_NONE_MPS = np.zeros(3)


@compiled
def _follow(
    before: Floats,
    before_level: Floats,
    before_height: Floats,
    turn_rps: float,
    elapsed: float,
    told_m: Floats,
    told_mps: Floats,
    with_rate: bool,
    place_std: float,
    height_std: float,
    rate_std: float,
    climb_std: float,
    mean: Floats,
    level: Floats,
    height: Floats,
) -> float:
    """Set mean, level and height to those after a report; the turn rate."""
    for axis in range(3):
        upright = axis == 2
        if upright:
            p, c, r = _grow(before_height, elapsed, CLIMB_MPS2)
        else:
            p, c, r = _grow(before_level, elapsed, LEVEL_MPS2)
        std, fast = (height_std, climb_std) if upright else (place_std, rate_std)
        place, rate = before[axis] + elapsed * before[axis + 3], before[axis + 3]
        off, noise = told_m[axis] - place, std**2
        gain, swing = p / (p + noise), c / (p + noise)
        place, rate = place + gain * off, rate + swing * off
        p, c, r = (1.0 - gain) * p, (1.0 - gain) * c, r - swing * c
        if with_rate:
            off, noise = told_mps[axis] - rate, fast**2
            gain, swing = r / (r + noise), c / (r + noise)
            place, rate = place + swing * off, rate + gain * off
            p, c, r = p - swing * c, (1.0 - gain) * c, (1.0 - gain) * r
        mean[axis], mean[axis + 3] = place, rate
        if upright:
            height[0], height[1], height[2] = p, c, r
        else:
            level[0], level[1], level[2] = p, c, r
    cross = before[3] * mean[4] - before[4] * mean[3]
    along = before[3] * mean[3] + before[4] * mean[4]
    turned = np.arctan2(cross, along) / elapsed
    keep = np.exp(-elapsed / FADES_S)
    rate_rps: float = keep * turn_rps + (1.0 - keep) * turned
    return rate_rps


@compiled
def _grow(spread: Floats, elapsed: float, push: float) -> tuple[float, float, float]:
    place, both, rate = spread[0], spread[1], spread[2]
    return (
        place + 2.0 * elapsed * both + elapsed**2 * rate + 0.25 * push**2 * elapsed**4,
        both + elapsed * rate + 0.5 * push**2 * elapsed**3,
        rate + push**2 * elapsed**2,
    )
