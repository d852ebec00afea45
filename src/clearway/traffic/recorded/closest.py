"""Closest pairs of a recording: where two aircraft came nearest to each other, and when."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import FloatArray, IntArray
from clearway.base.brief import brief
from clearway.base.units import FOOT_M, NAUTICAL_MILE_M
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.closest_point import ClosestPoints, JoinedTracks, closest_points
from clearway.traffic.recorded.proximity import proximity_pairs
from clearway.traffic.recorded.samples import SLOWEST_MPS, Samples, sample_aircraft

WITHIN_M = 10_000.0
MOST_BETWEEN_M = 1_200.0
"""How much nearer than at whole seconds two aircraft come between them, at most: 600 m/s each."""
EVERYBODY_MPS = -1.0
"""What is slower is left out: nobody."""
AT_ONCE = 4_000
"""Pairs whose closest points are looked for together."""
TOGETHER_M = 0.5 * NAUTICAL_MILE_M
TOGETHER_HEIGHT_M = 500.0 * FOOT_M
"""Pairs that stay this near for long fly together."""

Progress = Callable[[float, float], None]
"""What is done, and what there is to do."""


@dataclass(frozen=True, slots=True)
class ClosestPair:
    """Two aircraft at the time when the straight line between them was shortest."""

    first: Aircraft
    second: Aircraft
    time_s: float
    distance_m: float
    """Horizontal."""
    height_m: float
    """Of the second above the first."""
    height_step_m: float
    """How far the height may be off because altitudes come in steps."""
    altitude_m: float
    """In the middle of both, barometric where both report it."""
    relative_mps: float | None
    """Horizontal speed of one as seen from the other; None where one reports none."""
    latitude_deg: float
    """Of the first, likewise the longitude."""
    longitude_deg: float
    together_s: int
    """Seconds that they spend within half a nautical mile and 500 ft."""
    slow: tuple[str, ...] = ()
    """Addresses of those no faster than 40 kt then: they hover, drift, take off or land."""

    __repr__ = brief

    @property
    def slant_m(self) -> float:
        """Length of the straight line between them."""
        return float(np.hypot(self.distance_m, self.height_m))


def closest_pairs(
    aircraft: Sequence[Aircraft],
    own_address: str | None = None,
    within_m: float = WITHIN_M,
    progress: Progress | None = None,
) -> list[ClosestPair]:
    """Every pair once, at its closest; with `own_address` only its pairs.

    Positions are interpolated over gaps of at most 12 s; both aircraft must be off the ground,
    their heights known, and at some whole second within `within_m` of each other, horizontally.
    The nearest pair comes first; pairs of which one is no faster than 40 kt follow all others.
    progress: called with what is done and what there is to do.
    """
    return list(search_pairs(aircraft, own_address, within_m, progress).pairs)


class FoundPairs(NamedTuple):
    """What a search for close pairs has found."""

    pairs: tuple[ClosestPair, ...]
    without_height: tuple[tuple[str, str], ...]
    """Addresses of pairs that come within the distance, and are at no second known to be at heights
    of the same kind."""


def search_pairs(
    aircraft: Sequence[Aircraft],
    own_address: str | None = None,
    within_m: float = WITHIN_M,
    progress: Progress | None = None,
) -> FoundPairs:
    """`closest_pairs`, and those that are left out of it for their heights."""
    tell = progress or _tell_nobody
    samples = sample_aircraft(aircraft, slowest_mps=EVERYBODY_MPS)
    own = [n for n, one in enumerate(aircraft) if one.address == own_address]
    met = proximity_pairs(samples, within_m, lambda done, total: tell(0.5 * done, total))
    pair = samples.aircraft[met.first] * len(aircraft) + samples.aircraft[met.second]
    slant = np.hypot(met.horizontal_m, met.height_m)
    asked = np.ones(len(pair), dtype=np.bool_)
    if own_address is not None:
        asked = np.isin(samples.aircraft[met.first], own)
        asked |= np.isin(samples.aircraft[met.second], own)
    wanted = asked & ~np.isnan(slant)
    usable = np.flatnonzero(wanted)
    order = usable[np.lexsort((slant[usable], pair[usable]))]
    pairs, starts, counts = np.unique(pair[order], return_index=True, return_counts=True)
    together = (met.horizontal_m <= TOGETHER_M) & (np.abs(met.height_m) <= TOGETHER_HEIGHT_M)
    together &= wanted
    seconds = np.bincount(np.searchsorted(pairs, pair[together]), minlength=len(pairs))
    spans = _spans(samples.second[met.first[order]], slant[order], starts, counts)
    nearest = order[starts]
    tracks = JoinedTracks.of(aircraft)
    steps_m = [one.altitude_step_m for one in aircraft]
    found: list[ClosestPair] = []
    for low in range(0, len(pairs), AT_ONCE):
        part = slice(low, low + AT_ONCE)
        rows = nearest[part]
        seen = _Seen(met.first[rows], met.second[rows], met.horizontal_m[rows], met.height_m[rows])
        exact = closest_points(
            tracks,
            samples.aircraft[seen.first],
            samples.aircraft[seen.second],
            spans[0][part],
            spans[1][part],
        )
        found += _pairs(aircraft, steps_m, samples, seen, exact, seconds[part])
        tell(0.5 * (len(pairs) + len(found)), len(pairs))
    names = [one.address for one in aircraft]
    return FoundPairs(
        tuple(sorted(found, key=lambda one: (bool(one.slow), one.slant_m))),
        tuple(
            (names[number // len(names)], names[number % len(names)])
            for number in np.setdiff1d(pair[asked], pairs).tolist()
        ),
    )


def _tell_nobody(done: float, total: float) -> None:
    del done, total


class _Seen(NamedTuple):
    """Pairs [n] at the nearest whole second: rows of the samples, and how far apart."""

    first: IntArray
    second: IntArray
    horizontal_m: FloatArray
    height_m: FloatArray


def _spans(
    second: IntArray, slant_m: FloatArray, starts: IntArray, counts: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Spans of time [pairs] in which the closest point lies; rows by pair, the nearest first."""
    near = slant_m <= np.repeat(slant_m[starts], counts) + MOST_BETWEEN_M
    low = np.where(near, second, np.iinfo(np.int64).max)
    high = np.where(near, second, np.iinfo(np.int64).min)
    if not len(starts):
        return np.zeros(0), np.zeros(0)
    return np.minimum.reduceat(low, starts) - 1.0, np.maximum.reduceat(high, starts) + 1.0


def _pairs(
    aircraft: Sequence[Aircraft],
    steps_m: Sequence[float],
    samples: Samples,
    seen: _Seen,
    exact: ClosestPoints,
    together_s: IntArray,
) -> list[ClosestPair]:
    """Pairs at the exact time, or at the nearest whole second where that is nearer."""
    a, b = seen.first, seen.second
    barometric = samples.barometric_m[[a, b]]
    heights = np.where(
        np.isnan(barometric).any(axis=0), samples.geometric_m[[a, b]], barometric
    ).mean(axis=0)
    relative = np.hypot(
        samples.east_mps[b] - samples.east_mps[a], samples.north_mps[b] - samples.north_mps[a]
    )
    whole = ~(exact.slant_m <= np.hypot(seen.horizontal_m, seen.height_m))

    def choose_moments(at_second: FloatArray, at_point: FloatArray) -> list[float]:
        values: list[float] = np.where(whole, at_second, at_point).tolist()
        return values

    columns = zip(
        samples.aircraft[a].tolist(),
        samples.aircraft[b].tolist(),
        choose_moments(samples.second[a].astype(np.float64), exact.time_s),
        choose_moments(seen.horizontal_m, exact.horizontal_m),
        choose_moments(seen.height_m, exact.height_m),
        choose_moments(heights, exact.altitude_m),
        choose_moments(relative, exact.relative_mps),
        choose_moments(samples.latitude_deg[a], exact.latitude_deg),
        choose_moments(samples.longitude_deg[a], exact.longitude_deg),
        together_s.tolist(),
        choose_moments(samples.speed_mps[a], exact.first_mps),
        choose_moments(samples.speed_mps[b], exact.second_mps),
        strict=True,
    )
    return [
        ClosestPair(
            first=aircraft[one],
            second=aircraft[two],
            time_s=time_s,
            distance_m=distance_m,
            height_m=height_m,
            height_step_m=0.5 * (steps_m[one] + steps_m[two]),
            altitude_m=altitude_m,
            relative_mps=None if math.isnan(relative_mps) else relative_mps,
            latitude_deg=latitude_deg,
            longitude_deg=longitude_deg,
            together_s=seconds,
            slow=tuple(
                aircraft[n].address
                for n, speed in ((one, one_mps), (two, two_mps))
                if not speed > SLOWEST_MPS
            ),
        )
        for (
            one, two, time_s, distance_m, height_m, altitude_m, relative_mps, latitude_deg,
            longitude_deg, seconds, one_mps, two_mps,
        ) in columns
    ]  # fmt: skip
