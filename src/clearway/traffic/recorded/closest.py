"""Closest pairs of a recording: where two aircraft came nearest to each other, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.units import FOOT_M, NAUTICAL_MILE_M
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.closest_point import ClosestPoint, closest_point
from clearway.traffic.recorded.proximity import proximity_pairs
from clearway.traffic.recorded.samples import Samples, sample

WITHIN_M = 10_000.0
MOST_BETWEEN_M = 1_200.0
"""How much nearer than at whole seconds two aircraft come between them, at most: 600 m/s each."""
TOGETHER_M, TOGETHER_HEIGHT_M = 0.5 * NAUTICAL_MILE_M, 500.0 * FOOT_M
"""Pairs that stay this near for long fly together."""


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

    __repr__ = brief

    @property
    def slant_m(self) -> float:
        """Length of the straight line between them."""
        return float(np.hypot(self.distance_m, self.height_m))


def closest_pairs(
    aircraft: Sequence[Aircraft], own_address: str | None = None, within_m: float = WITHIN_M
) -> list[ClosestPair]:
    """Every pair once, at its closest, nearest pair first; with `own_address` only its pairs.

    Positions are interpolated over gaps of at most 12 s; both aircraft must be in flight (above
    40 kt), their heights known, and at some whole second within `within_m` of each other,
    horizontally.
    """
    samples = sample(aircraft)
    met = proximity_pairs(samples, within_m)
    pair = samples.aircraft[met.first] * len(aircraft) + samples.aircraft[met.second]
    slant = np.hypot(met.horizontal_m, met.height_m)
    usable = np.flatnonzero(~np.isnan(slant))
    order = usable[np.lexsort((slant[usable], pair[usable]))]
    pairs, starts = np.unique(pair[order], return_index=True)
    together = (met.horizontal_m <= TOGETHER_M) & (np.abs(met.height_m) <= TOGETHER_HEIGHT_M)
    seconds = np.bincount(np.searchsorted(pairs, pair[together]), minlength=len(pairs))
    best = slant[order[starts]]
    found = []
    for number, (row, nearest_m) in enumerate(zip(order[starts], best, strict=True)):
        mine = order[starts[number] : starts[number + 1] if number + 1 < len(starts) else None]
        near = met.first[mine[slant[mine] <= nearest_m + MOST_BETWEEN_M]]
        span = (float(samples.second[near].min()) - 1.0, float(samples.second[near].max()) + 1.0)
        found.append(
            _pair(
                aircraft,
                samples,
                (met.first[row], met.second[row]),
                (float(met.horizontal_m[row]), float(met.height_m[row])),
                int(seconds[number]),
                span,
            )
        )
    if own_address is not None:
        found = [one for one in found if own_address in (one.first.address, one.second.address)]
    return sorted(found, key=lambda one: one.slant_m)


def _pair(
    aircraft: Sequence[Aircraft],
    samples: Samples,
    rows: tuple[np.int64, np.int64],
    apart_m: tuple[float, float],
    together_s: int,
    span_s: tuple[float, float],
) -> ClosestPair:
    """Of their rows at the nearest whole second, and the exact time within a span around it."""
    a, b = rows
    first, second = aircraft[samples.aircraft[a]], aircraft[samples.aircraft[b]]
    altitudes = samples.barometric_m[[a, b]]
    if np.isnan(altitudes).any():
        altitudes = samples.geometric_m[[a, b]]
    relative = np.hypot(
        samples.east_mps[b] - samples.east_mps[a], samples.north_mps[b] - samples.north_mps[a]
    )
    at_second = ClosestPoint(
        time_s=float(samples.second[a]),
        horizontal_m=apart_m[0],
        height_m=apart_m[1],
        latitude_deg=float(samples.latitude_deg[a]),
        longitude_deg=float(samples.longitude_deg[a]),
        altitude_m=float(altitudes.mean()),
        relative_mps=None if np.isnan(relative) else float(relative),
    )
    exact = closest_point(first, second, *span_s)
    point = at_second if exact is None or exact.slant_m > at_second.slant_m else exact
    return ClosestPair(
        first=first,
        second=second,
        time_s=point.time_s,
        distance_m=point.horizontal_m,
        height_m=point.height_m,
        height_step_m=0.5 * (first.altitude_step_m + second.altitude_step_m),
        altitude_m=point.altitude_m,
        relative_mps=point.relative_mps,
        latitude_deg=point.latitude_deg,
        longitude_deg=point.longitude_deg,
        together_s=together_s,
    )
