"""All pairs of aircraft at the same second that are near each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.samples import Samples


@dataclass(frozen=True, slots=True, eq=False)
class ProximityPairs:
    """Rows [n] of two aircraft at one second."""

    first: IntArray
    """Row of the samples; its aircraft has the lower index."""
    second: IntArray
    horizontal_m: FloatArray
    height_m: FloatArray
    """How far the second is above the first, both barometric, else both geometric, else NaN."""


def proximity_pairs(samples: Samples, within_m: float) -> ProximityPairs:
    """Pairs of samples of one second no further apart than `within_m`, horizontally."""
    found = [np.zeros((0, 4))]
    step = 1
    while True:
        # Rows are by second, so partners of a row are those that follow it while the second lasts.
        first = np.flatnonzero(samples.second[step:] == samples.second[:-step])
        if not len(first):
            break
        second = first + step
        east, north = planar_offset_m(
            samples.latitude_deg[first],
            samples.longitude_deg[first],
            samples.latitude_deg[second],
            samples.longitude_deg[second],
        )
        distance = np.hypot(east, north)
        near = distance <= within_m
        first, second = first[near], second[near]
        height = _height_m(samples, first, second)
        found.append(np.column_stack([first, second, distance[near], height]))
        step += 1
    table = np.concatenate(found)
    rows = table[:, :2].astype(np.int64)
    return ProximityPairs(rows[:, 0], rows[:, 1], table[:, 2].copy(), table[:, 3].copy())


def _height_m(samples: Samples, first: IntArray, second: IntArray) -> FloatArray:
    barometric = samples.barometric_m[second] - samples.barometric_m[first]
    geometric = samples.geometric_m[second] - samples.geometric_m[first]
    return np.where(np.isnan(barometric), geometric, barometric)
