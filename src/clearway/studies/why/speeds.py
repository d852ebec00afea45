"""Velocities along a recorded way."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.poses.pose_track import LONGEST_POSE_GAP_S, PoseTrack

SPAN_S = 0.2
"""Over which velocities are taken at least: positions of shorter times are mostly noise."""
LONGEST_SPAN_S = 1.0
SIGMAS = 20.0
"""Standard deviations of a position that a vehicle flies in a span: the noise of a speed is then a
fourteenth of it."""
MEDIAN_BEND = 0.6745 * 6.0**0.5
"""Median of the second difference of normal noise, in its standard deviations."""


def velocity_at(track: PoseTrack, time_s: float) -> FloatArray | None:
    """[3] velocity over the span before a time; None in gaps."""
    end, begin = track.at(time_s), track.at(time_s - SPAN_S)
    if end is None or begin is None:
        return None
    return np.asarray((end.position_m - begin.position_m) / SPAN_S)


def track_speeds(track: PoseTrack, axes: int = 3, span_s: float = SPAN_S) -> FloatArray:
    """[n] speeds along the first axes between `span_times`; none of a track of one pose."""
    times = span_times(track, span_s)
    if len(times) < 2:
        return np.zeros(1)
    places = np.column_stack(
        [np.interp(times, track.time_s, track.position_m[:, axis]) for axis in range(axes)]
    )
    speeds: FloatArray = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(times)
    return speeds


def span_times(track: PoseTrack, span_s: float) -> FloatArray:
    """[n] times a span apart from the first pose on, without those deep within gaps.

    Where a clock jumps by years, a gap would take more memory than there is.
    """
    begin_s, end_s = track.time_s[0], track.time_s[-1]
    ahead = np.arange(np.ceil(LONGEST_POSE_GAP_S / span_s) + 1.0)
    numbers = np.floor((track.time_s - begin_s) / span_s)[:, None] + ahead
    times = begin_s + span_s * np.unique(numbers)
    return np.asarray(times[times < end_s])


def choose_span_s(track: PoseTrack, speed_mps: float) -> float:
    """The shortest time over which the noise of positions is little beside a speed."""
    if len(track.time_s) < 3:
        return SPAN_S
    bends = np.abs(np.diff(track.position_m, n=2, axis=0))
    sigma_m = float(np.median(bends)) / MEDIAN_BEND
    return float(np.clip(SIGMAS * sigma_m / max(speed_mps, 1e-9), SPAN_S, LONGEST_SPAN_S))
