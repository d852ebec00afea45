"""Where two aircraft came nearest, at the exact time: between reports both fly straight."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import BoolArray, FloatArray, IntArray
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.samples import SLOWEST_MPS

LEAST_PIECE_S = 1e-6
"""Shorter pieces of two tracks are none."""


class ClosestPoint(NamedTuple):
    """Two aircraft where the straight line between them was shortest."""

    time_s: float
    horizontal_m: float
    height_m: float
    """Of the second above the first."""
    latitude_deg: float
    """Of the first, likewise the longitude."""
    longitude_deg: float
    altitude_m: float
    """In the middle of both, barometric where both report it."""
    relative_mps: float | None
    """Horizontal speed of one as seen from the other; None where one reports none."""

    @property
    def slant_m(self) -> float:
        """Length of the straight line between them."""
        return float(np.hypot(self.horizontal_m, self.height_m))


def closest_point(
    first: Aircraft, second: Aircraft, from_s: float, to_s: float
) -> ClosestPoint | None:
    """The closest point of two tracks within a time; None where they are never in flight together.

    Exact for tracks that are straight between reports (of each, over gaps of at most 12 s).
    """
    start, end = _pieces(first, second, from_s, to_s)
    one, two = _segments(first, start, end), _segments(second, start, end)
    flying = _in_flight(first, one, start, end) & _in_flight(second, two, start, end)
    start, end, one, two = start[flying], end[flying], one[flying], two[flying]
    before, after = _apart(first, second, one, two, start), _apart(first, second, one, two, end)
    way = after - before
    square = np.einsum("ij,ij->i", way, way)
    toward = -np.einsum("ij,ij->i", before, way)
    share = np.clip(np.divide(toward, square, out=np.zeros_like(square), where=square > 0), 0, 1)
    slant = np.linalg.norm(before + share[:, None] * way, axis=1)
    if not len(slant) or np.isnan(slant).all():
        return None
    nearest = np.array([np.nanargmin(slant)])
    time_s = (start + share * (end - start))[nearest]
    return _told(first, second, one[nearest], two[nearest], time_s)


def _pieces(
    first: Aircraft, second: Aircraft, from_s: float, to_s: float
) -> tuple[FloatArray, FloatArray]:
    """Starts and ends of the times between which neither reports."""
    cuts = [np.array([from_s, to_s])]
    for one in (first, second):
        low, high = np.searchsorted(one.time_s, (from_s, to_s))
        cuts.append(one.time_s[low:high])
    times = np.unique(np.concatenate(cuts))
    long = np.diff(times) > LEAST_PIECE_S
    return times[:-1][long], times[1:][long]


def _segments(one: Aircraft, start: FloatArray, end: FloatArray) -> IntArray:
    """Reports before each piece; -1 where it is not heard of before and after."""
    at = np.searchsorted(one.time_s, 0.5 * (start + end)) - 1
    return np.where(at < len(one.time_s) - 1, at, -1)


def _in_flight(one: Aircraft, at: IntArray, start: FloatArray, end: FloatArray) -> BoolArray:
    """Whether it is heard of, off the ground, and no slower than what counts as flying."""
    if len(one.time_s) < 2:
        return np.zeros(len(at), dtype=np.bool_)
    grounded = one.on_ground[at] | one.on_ground[at + 1]
    speed = _between(one, one.ground_speed_mps, at, 0.5 * (start + end))
    speed = np.where(np.isnan(speed), one.segment_mps[at], speed)
    flying: BoolArray = (at >= 0) & one.heard_of[at] & ~grounded & (speed > SLOWEST_MPS)
    return flying


def _between(one: Aircraft, values: FloatArray, at: IntArray, time_s: FloatArray) -> FloatArray:
    """Values at times within the segments that begin with reports `at`."""
    length = one.time_s[at + 1] - one.time_s[at]
    share = np.clip((time_s - one.time_s[at]) / length, 0.0, 1.0)
    mixed = (1.0 - share) * values[at] + share * values[at + 1]
    # At a report itself its neighbour does not matter, even where unknown.
    mixed = np.where(share == 0.0, values[at], mixed)
    return np.where(share == 1.0, values[at + 1], mixed)


def _apart(
    first: Aircraft, second: Aircraft, one: IntArray, two: IntArray, time_s: FloatArray
) -> FloatArray:
    """[n, 3] east, north and up of the second from the first, up NaN where it is not known."""
    east, north = planar_offset_m(
        _between(first, first.latitude_deg, one, time_s),
        _between(first, first.longitude_deg, one, time_s),
        _between(second, second.latitude_deg, two, time_s),
        _between(second, second.longitude_deg, two, time_s),
    )
    low, high = _altitudes(first, second, one, two, time_s)
    return np.stack([east, north, high - low], axis=-1)


def _altitudes(
    first: Aircraft, second: Aircraft, one: IntArray, two: IntArray, time_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Of both: barometric where both report it, else geometric, else NaN."""
    low = _between(first, first.barometric_m, one, time_s)
    high = _between(second, second.barometric_m, two, time_s)
    unknown = np.isnan(low) | np.isnan(high)
    return (
        np.where(unknown, _between(first, first.geometric_m, one, time_s), low),
        np.where(unknown, _between(second, second.geometric_m, two, time_s), high),
    )


def _told(
    first: Aircraft, second: Aircraft, one: IntArray, two: IntArray, time_s: FloatArray
) -> ClosestPoint:
    """All that is said of one moment; arrays of one."""
    east, north, up = _apart(first, second, one, two, time_s)[0]
    low, high = _altitudes(first, second, one, two, time_s)
    across = [
        _between(plane, plane.ground_speed_mps * turn(plane.track_rad), at, time_s)[0]
        for plane, at in ((first, one), (second, two))
        for turn in (np.sin, np.cos)
    ]
    relative = float(np.hypot(across[2] - across[0], across[3] - across[1]))
    return ClosestPoint(
        time_s=float(time_s[0]),
        horizontal_m=float(np.hypot(east, north)),
        height_m=float(up),
        latitude_deg=float(_between(first, first.latitude_deg, one, time_s)[0]),
        longitude_deg=float(_between(first, first.longitude_deg, one, time_s)[0]),
        altitude_m=float(0.5 * (low[0] + high[0])),
        relative_mps=None if np.isnan(relative) else relative,
    )
