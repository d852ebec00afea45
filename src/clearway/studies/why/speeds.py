"""Velocities along a recorded way."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.poses.pose_track import PoseTrack

SPAN_S = 0.2
"""Over which velocities are taken at least: positions of shorter times are mostly noise."""


def velocity_at(track: PoseTrack, time_s: float) -> FloatArray | None:
    """[3] velocity over the span before a time; None in gaps."""
    end, begin = track.at(time_s), track.at(time_s - SPAN_S)
    if end is None or begin is None:
        return None
    return np.asarray((end.position_m - begin.position_m) / SPAN_S)


def track_speeds(track: PoseTrack) -> FloatArray:
    """[n] speeds between poses about a span apart; none of a track of one pose."""
    times = np.arange(track.time_s[0], track.time_s[-1], SPAN_S)
    if len(times) < 2:
        return np.zeros(1)
    places = np.column_stack(
        [np.interp(times, track.time_s, track.position_m[:, axis]) for axis in range(3)]
    )
    speeds: FloatArray = np.linalg.norm(np.diff(places, axis=0), axis=1) / SPAN_S
    return speeds
