"""A track of one aircraft kilometres away: straight flight with noise, horizontal and vertical
apart, compiled.

The same filter as `tracks.Track` where both have the same noise; for thousands of encounters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.traffic.surveillance.heard import HeardOf

LEVEL_MPS2 = 1.5
"""How hard traffic is taken to turn or speed up: the gain of a velocity that is told well is then
about 0.6 at a report a second."""
CLIMB_MPS2 = 0.7
UNKNOWN_MPS = 60.0
"""Deviation of the velocity before any was measured."""
COAST_S = 12.0
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
            level=_grown(self.level, elapsed, LEVEL_MPS2),
            height=_grown(self.height, elapsed, CLIMB_MPS2),
        )


def begun(heard: HeardOf) -> SmoothTrack:
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
    )


def followed(track: SmoothTrack | None, heard: HeardOf) -> SmoothTrack:
    """The track after its next report; late ones are left out, a long silence begins anew."""
    if track is None or heard.time_s - track.time_s > COAST_S:
        return begun(heard)
    elapsed = heard.time_s - track.time_s
    if elapsed <= 0.0:
        return track
    there = track.at(heard.time_s)
    mean, level, height = there.mean.copy(), there.level.copy(), there.height.copy()
    told = heard.velocity_mps is not None
    velocity = heard.velocity_mps if heard.velocity_mps is not None else np.zeros(3)
    for axis in range(3):
        upright = axis == 2
        std = heard.height_std_m if upright else heard.position_std_m
        rate = heard.climb_std_mps if upright else heard.velocity_std_mps
        spread = height if upright else level
        mean[axis], mean[axis + 3], after = _updated(
            mean[axis], mean[axis + 3], spread, heard.position_m[axis], std,
            velocity[axis], rate, told,
        )  # fmt: skip
        if axis == 1:
            level = after
        elif upright:
            height = after
    before, now = track.mean[3:5], mean[3:5]
    cross = float(before[0] * now[1] - before[1] * now[0])
    turned = float(np.arctan2(cross, float(before @ now))) / elapsed
    keep = float(np.exp(-elapsed / FADES_S))
    rate_rps = keep * track.turn_rps + (1.0 - keep) * turned
    return SmoothTrack(heard.time_s, mean, level, height, rate_rps, track.reports + 1)


@compiled
def _grown(spread: FloatArray, elapsed: float, push: float) -> FloatArray:
    place, both, rate = spread
    grown = np.empty(3)
    grown[0] = place + 2.0 * elapsed * both + elapsed**2 * rate + 0.25 * push**2 * elapsed**4
    grown[1] = both + elapsed * rate + 0.5 * push**2 * elapsed**3
    grown[2] = rate + push**2 * elapsed**2
    return grown


@compiled
def _updated(
    place: float,
    rate: float,
    spread: FloatArray,
    told_place: float,
    place_std: float,
    told_rate: float,
    rate_std: float,
    with_rate: bool,
) -> tuple[float, float, FloatArray]:
    """Place, rate and spread of one axis after a report of it."""
    p, c, r = spread
    after = np.empty(3)
    off, noise = told_place - place, place_std**2
    gain, swing = p / (p + noise), c / (p + noise)
    place, rate = place + gain * off, rate + swing * off
    p, c, r = (1.0 - gain) * p, (1.0 - gain) * c, r - swing * c
    if with_rate:
        off, noise = told_rate - rate, rate_std**2
        gain, swing = r / (r + noise), c / (r + noise)
        place, rate = place + swing * off, rate + gain * off
        p, c, r = p - swing * c, (1.0 - gain) * c, (1.0 - gain) * r
    after[0], after[1], after[2] = p, c, r
    return place, rate, after
