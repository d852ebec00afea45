"""Where two aircraft came nearest, at the exact time: between reports both fly straight.

All pairs at once: arrays over pairs, and over the pieces of time between their reports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.arrays import BoolArray, FloatArray, IntArray
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.geodesy import planar_offset_m

LEAST_PIECE_S = 1e-6
"""Shorter pieces of two tracks are none."""


@dataclass(frozen=True, slots=True, eq=False)
class JoinedTracks:
    """The reports of all aircraft behind each other; arrays [n] over reports."""

    starts: IntArray
    """[aircraft + 1] first report of each."""
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    barometric_m: FloatArray
    geometric_m: FloatArray
    speed_mps: FloatArray
    east_mps: FloatArray
    north_mps: FloatArray
    segment_mps: FloatArray
    """To the next report; NaN at the last one."""
    is_flown: BoolArray
    """Whether it flies, off the ground, to the next report, without a silence."""

    @classmethod
    def of(cls, aircraft: Sequence[Aircraft]) -> JoinedTracks:
        """Of aircraft in their order."""

        def join(name: str) -> FloatArray:
            return np.concatenate([np.zeros(0), *(getattr(one, name) for one in aircraft)])

        counts = [len(one.time_s) for one in aircraft]
        speed, track = join("ground_speed_mps"), join("track_rad")
        segments = [np.append(one.segment_mps, np.nan) for one in aircraft]
        flown = [
            np.append(one.heard_of & ~(one.on_ground[:-1] | one.on_ground[1:]), False)
            for one in aircraft
        ]
        return cls(
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            join("time_s"),
            join("latitude_deg"),
            join("longitude_deg"),
            join("barometric_m"),
            join("geometric_m"),
            speed,
            speed * np.sin(track),
            speed * np.cos(track),
            np.concatenate([np.zeros(0), *segments]),
            np.concatenate([np.zeros(0, dtype=np.bool_), *flown]),
        )

    def between(self, values: FloatArray, at: IntArray, time_s: FloatArray) -> FloatArray:
        """[m] of values [n], at times within the segments that begin with reports `at`."""
        length = self.time_s[at + 1] - self.time_s[at]
        share = np.clip((time_s - self.time_s[at]) / length, 0.0, 1.0)
        mixed = (1.0 - share) * values[at] + share * values[at + 1]
        # At a report itself its neighbour does not matter, even where unknown.
        mixed = np.where(share == 0.0, values[at], mixed)
        return np.where(share == 1.0, values[at + 1], mixed)

    def speed_at(self, at: IntArray, time_s: FloatArray) -> FloatArray:
        """[m] over ground as reported, or by positions where it is not."""
        speed = self.between(self.speed_mps, at, time_s)
        return np.where(np.isnan(speed), self.segment_mps[at], speed)

    def heights(
        self, one: IntArray, two: IntArray, time_s: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """[m] of both: barometric where both report it, else geometric, else NaN."""
        low = self.between(self.barometric_m, one, time_s)
        high = self.between(self.barometric_m, two, time_s)
        unknown = np.isnan(low) | np.isnan(high)
        return (
            np.where(unknown, self.between(self.geometric_m, one, time_s), low),
            np.where(unknown, self.between(self.geometric_m, two, time_s), high),
        )

    def apart(self, one: IntArray, two: IntArray, time_s: FloatArray) -> FloatArray:
        """[m, 3] east, north and up of the second from the first; up is NaN where unknown."""
        east, north = planar_offset_m(
            self.between(self.latitude_deg, one, time_s),
            self.between(self.longitude_deg, one, time_s),
            self.between(self.latitude_deg, two, time_s),
            self.between(self.longitude_deg, two, time_s),
        )
        low, high = self.heights(one, two, time_s)
        return np.stack([east, north, high - low], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class ClosestPoints:
    """Pairs [n] where the straight line between them was shortest; NaN where they never fly."""

    time_s: FloatArray
    horizontal_m: FloatArray
    height_m: FloatArray
    """Of the second above the first."""
    latitude_deg: FloatArray
    """Of the first, likewise the longitude."""
    longitude_deg: FloatArray
    altitude_m: FloatArray
    """In the middle of both, barometric where both report it."""
    relative_mps: FloatArray
    """Horizontal speed of one as seen from the other; NaN where one reports none."""
    first_mps: FloatArray
    """Speed of the first over ground, and of the second."""
    second_mps: FloatArray

    @property
    def slant_m(self) -> FloatArray:
        """[n] lengths of the straight lines."""
        return np.hypot(self.horizontal_m, self.height_m)


def closest_points(
    tracks: JoinedTracks, first: IntArray, second: IntArray, from_s: FloatArray, to_s: FloatArray
) -> ClosestPoints:
    """The closest points of pairs [n] of aircraft within spans of time.

    Exact for tracks that are straight between reports, over gaps of at most 12 s.
    """
    pair, start, end, one, two = _pieces(tracks, first, second, from_s, to_s)
    flying = tracks.is_flown[one] & tracks.is_flown[two]
    pair, one, two = pair[flying], one[flying], two[flying]
    start, end = start[flying], end[flying]
    before, after = tracks.apart(one, two, start), tracks.apart(one, two, end)
    way = after - before
    square = np.einsum("ij,ij->i", way, way)
    toward = -np.einsum("ij,ij->i", before, way)
    share = np.clip(np.divide(toward, square, out=np.zeros_like(square), where=square > 0), 0, 1)
    slant = np.linalg.norm(before + share[:, None] * way, axis=1)
    known = np.flatnonzero(~np.isnan(slant))
    order = known[np.lexsort((slant[known], pair[known]))]
    pairs, rows = np.unique(pair[order], return_index=True)
    nearest = order[rows]
    time_s = (start + share * (end - start))[nearest]
    values = _list_columns(tracks, one[nearest], two[nearest], time_s)
    found = np.full((len(values), len(first)), np.nan)
    found[:, pairs] = values
    return ClosestPoints(*found)


def _pieces(
    tracks: JoinedTracks, first: IntArray, second: IntArray, from_s: FloatArray, to_s: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray, IntArray, IntArray]:
    """Pieces of time in which neither of a pair reports: pair, start, end, last reports of both."""
    count = np.arange(len(first))
    events = [(count, from_s, 0 * count, 0 * count), (count, to_s, 0 * count, 0 * count)]
    lows = []
    for side, indices in enumerate((first, second)):
        low, high = np.zeros(len(first), dtype=np.int64), np.zeros(len(first), dtype=np.int64)
        for n, index in enumerate(indices):
            times = tracks.time_s[tracks.starts[index] : tracks.starts[index + 1]]
            low[n], high[n] = tracks.starts[index] + np.searchsorted(times, (from_s[n], to_s[n]))
        lows.append(low)
        pair = np.repeat(count, high - low)
        within = np.arange(len(pair)) - np.repeat(np.cumsum(high - low) - (high - low), high - low)
        ones = np.ones(len(pair), dtype=np.int64)
        events.append((pair, tracks.time_s[low[pair] + within], ones * (side == 0), ones * side))
    pair, time_s, of_first, of_second = (np.concatenate(each) for each in zip(*events, strict=True))
    order = np.lexsort((time_s, pair))
    pair, time_s = pair[order], time_s[order]
    at = []
    for low, indices, counted in zip(lows, (first, second), (of_first, of_second), strict=True):
        passed = np.cumsum(counted[order])
        begun = np.searchsorted(pair, count)
        passed = passed - (passed[begun] - counted[order][begun])[pair]
        last = low[pair] + passed - 1
        # Nothing is reported before the first report, and after the last one.
        own = last >= tracks.starts[indices][pair]
        at.append(np.where(own, last, tracks.starts[indices + 1][pair] - 1))
    long = (pair[1:] == pair[:-1]) & (np.diff(time_s) > LEAST_PIECE_S)
    return (
        pair[:-1][long], time_s[:-1][long], time_s[1:][long], at[0][:-1][long], at[1][:-1][long],
    )  # fmt: skip


def _list_columns(
    tracks: JoinedTracks, one: IntArray, two: IntArray, time_s: FloatArray
) -> list[FloatArray]:
    """All that is stated of moments [n], in the order of the fields of ClosestPoints."""
    apart = tracks.apart(one, two, time_s)
    low, high = tracks.heights(one, two, time_s)
    east, north = (
        tracks.between(values, two, time_s) - tracks.between(values, one, time_s)
        for values in (tracks.east_mps, tracks.north_mps)
    )
    return [
        time_s,
        np.hypot(apart[:, 0], apart[:, 1]),
        apart[:, 2],
        tracks.between(tracks.latitude_deg, one, time_s),
        tracks.between(tracks.longitude_deg, one, time_s),
        0.5 * (low + high),
        np.hypot(east, north),
        tracks.speed_at(one, time_s),
        tracks.speed_at(two, time_s),
    ]
