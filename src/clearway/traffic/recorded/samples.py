"""Positions of all aircraft at the same whole seconds, interpolated between their reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.base.units import KNOT_MPS
from clearway.traffic.recorded.aircraft import Aircraft

SLOWEST_MPS = 40.0 * KNOT_MPS
"""Slower aircraft are on the ground, or hover."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Rows [n] of one aircraft at one whole second each, by second, then aircraft."""

    second: IntArray
    aircraft: IntArray
    """Index into the sequence that the samples were made of."""
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    barometric_m: FloatArray
    """NaN where unknown, like the geometric altitude and the velocity."""
    geometric_m: FloatArray
    east_mps: FloatArray
    north_mps: FloatArray
    speed_mps: FloatArray
    """Over ground, by positions where it is not reported."""

    def __len__(self) -> int:
        return len(self.second)


def sample_aircraft(aircraft: Sequence[Aircraft], slowest_mps: float = SLOWEST_MPS) -> Samples:
    """Every aircraft in flight at every whole second, over gaps of at most 12 s.

    In flight: faster than `slowest_mps` by its own report, or by its positions where it does not
    say, and not reported as on the ground.
    """
    tables = [_sample(index, one, slowest_mps) for index, one in enumerate(aircraft)]
    table = np.concatenate([np.zeros((0, 9)), *tables])
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    whole = table[:, :2].astype(np.int64)
    return Samples(whole[:, 0], whole[:, 1], *np.ascontiguousarray(table[:, 2:].T))


def _sample(index: int, one: Aircraft, slowest_mps: float) -> FloatArray:
    """Rows [n, 9] of one aircraft, in the order of the fields of Samples."""
    if len(one.time_s) < 2:
        return np.zeros((0, 9))
    segment, seconds = _whole_seconds(one)
    share = (seconds - one.time_s[segment]) / np.diff(one.time_s)[segment]

    def between(values: FloatArray) -> FloatArray:
        mixed: FloatArray = (1.0 - share) * values[segment] + share * values[segment + 1]
        # At a report itself its neighbour does not matter, even where unknown.
        mixed = np.where(share == 0.0, values[segment], mixed)
        return np.where(share == 1.0, values[segment + 1], mixed)

    east = between(one.ground_speed_mps * np.sin(one.track_rad))
    north = between(one.ground_speed_mps * np.cos(one.track_rad))
    speed = between(one.ground_speed_mps)
    speed = np.where(np.isnan(speed), one.segment_mps[segment], speed)
    grounded = one.on_ground[segment] | one.on_ground[segment + 1]
    keep = ~grounded & (speed > slowest_mps)
    rows = np.column_stack(
        [
            seconds,
            np.full(len(seconds), index),
            between(one.latitude_deg),
            between(one.longitude_deg),
            between(one.barometric_m),
            between(one.geometric_m),
            east,
            north,
            speed,
        ]
    )
    kept: FloatArray = rows[keep]
    return kept


def _whole_seconds(one: Aircraft) -> tuple[IntArray, FloatArray]:
    """Whole seconds [n], ascending, at which it is reported, and between which reports each is."""
    segments = np.flatnonzero(one.heard_of)
    first = np.ceil(one.time_s[segments])
    counts = (np.floor(one.time_s[segments + 1]) - first + 1.0).astype(np.int64)
    ends = np.cumsum(counts)
    steps = np.arange(counts.sum()) - np.repeat(ends - counts, counts)
    # A report at a whole second belongs to the segments before and after it: take one of them.
    seconds, chosen = np.unique(np.repeat(first, counts) + steps, return_index=True)
    return np.repeat(segments, counts)[chosen], seconds
