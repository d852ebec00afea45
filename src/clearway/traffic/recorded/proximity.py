"""All pairs of aircraft at the same second that are near each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.traffic.recorded.geodesy import planar_offset_m, surface_points
from clearway.traffic.recorded.samples import Samples

FEW = 48
"""Aircraft of one second among whom all pairs are looked at; more are sought by a tree."""


@dataclass(frozen=True, slots=True, eq=False)
class ProximityPairs:
    """Rows [n] of two aircraft at one second."""

    first: IntArray
    """Row of the samples; its aircraft has the lower index."""
    second: IntArray
    horizontal_m: FloatArray
    height_m: FloatArray
    """How far the second is above the first, both barometric, else both geometric, else NaN."""


def proximity_pairs(
    samples: Samples, within_m: float, progress: Callable[[float, float], None] | None = None
) -> ProximityPairs:
    """Pairs of samples of one second no further apart than `within_m`, horizontally.

    progress: called with what is done and what there is to do.
    """
    starts = np.flatnonzero(np.diff(samples.second, prepend=np.iinfo(np.int64).min))
    counts = np.diff(np.append(starts, len(samples)))
    few = np.flatnonzero(np.repeat(counts <= FEW, counts))
    found = [np.zeros((0, 4)), *_among_few(samples, few, within_m)]
    places = surface_points(samples.latitude_deg, samples.longitude_deg)
    for low, count in zip(starts[counts > FEW], counts[counts > FEW], strict=True):
        # Straight lines through the Earth are shorter than the way over it, but for roundings.
        tree = cKDTree(places[low : low + count])
        pairs = tree.query_pairs(within_m * (1.0 + 1e-3) + 1.0, output_type="ndarray") + low
        found.append(_near(samples, pairs.min(axis=1), pairs.max(axis=1), within_m))
        if progress is not None:
            progress(float(low + count), float(len(samples)))
    table = np.concatenate(found)
    table = table[np.lexsort((table[:, 0], table[:, 1] - table[:, 0]))]
    rows = table[:, :2].astype(np.int64)
    return ProximityPairs(rows[:, 0], rows[:, 1], table[:, 2].copy(), table[:, 3].copy())


def _among_few(samples: Samples, rows: IntArray, within_m: float) -> Iterator[FloatArray]:
    """Pairs among rows of seconds with few aircraft: all of a row and the next but n, n by n."""
    second = samples.second[rows]
    for step in range(1, FEW):
        # Rows are by second, so partners of a row are those that follow it while the second lasts.
        first = np.flatnonzero(second[step:] == second[:-step])
        if not len(first):
            return
        yield _near(samples, rows[first], rows[first + step], within_m)


def _near(samples: Samples, first: IntArray, second: IntArray, within_m: float) -> FloatArray:
    """Those [n, 4] of pairs of rows that are near: both rows, horizontal distance, height."""
    east, north = planar_offset_m(
        samples.latitude_deg[first],
        samples.longitude_deg[first],
        samples.latitude_deg[second],
        samples.longitude_deg[second],
    )
    distance = np.hypot(east, north)
    near = distance <= within_m
    first, second = first[near], second[near]
    return np.column_stack([first, second, distance[near], _height_m(samples, first, second)])


def _height_m(samples: Samples, first: IntArray, second: IntArray) -> FloatArray:
    barometric = samples.barometric_m[second] - samples.barometric_m[first]
    geometric = samples.geometric_m[second] - samples.geometric_m[first]
    return np.where(np.isnan(barometric), geometric, barometric)
