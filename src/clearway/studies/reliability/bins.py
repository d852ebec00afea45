"""Ratings against what was there, counted in bins: a flight's counts, and those of many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.intervals import CONFIDENCE
from clearway.base.state import BoolArray, IntArray

EDGES = np.concatenate([[0.0], np.linspace(0.0, 1.0, 51)[1:-1], [1.0]])
"""Of the bins; a rating of exactly 0 or 1 has one of its own, before and after these."""
BINS = len(EDGES) + 1
COARSE = np.concatenate([[0], np.repeat(np.arange(1, 11), 5), [11]])
"""[BINS] the bin of a diagram that each bin is part of: 0, tenths, 1."""


def bin_ratings(rating: FloatArray) -> IntArray:
    """[n] bin of each rating in [0, 1]."""
    return np.where(
        rating <= 0.0, 0, np.where(rating >= 1.0, BINS - 1, np.searchsorted(EDGES, rating, "right"))
    )


def count_moments(rating: FloatArray, good: BoolArray) -> FloatArray:
    """[BINS, 5] of a flight's moments: how many, how many good, sums of the rating, of its square
    and of the rating of what was good."""
    at = bin_ratings(rating)
    ones = np.ones(len(rating))
    sums = (ones, good, rating, rating**2, rating * good)
    return np.stack([np.bincount(at, weights=one, minlength=BINS) for one in sums], axis=1)


class DiagramBin(NamedTuple):
    """A bin of a diagram."""

    said: float
    """Mean rating."""
    came: float
    """Share that was good."""
    low: float
    """Of its interval."""
    high: float
    number: int
    flights: int


class Reliability(NamedTuple):
    """How far a rating can be believed."""

    points: tuple[DiagramBin, ...]
    number: int
    flights: int
    came: float
    """Share that was good, of all."""
    brier: float
    """Mean squared difference of rating and what was there; 0 is best."""
    skill: float
    """Share of the Brier score that is saved beside saying the same share of everything."""
    error: float
    """Expected calibration error: mean distance of a bin's rating from its share."""
    interval: tuple[float, float]
    """Of the Brier score, by flights."""


def reliability(flights: FloatArray) -> Reliability:
    """Of the counts [flights, BINS, 5]; intervals take flights for independent, not cells."""
    coarse = _coarse(flights)
    points = tuple(_point(coarse[:, k]) for k in range(coarse.shape[1]) if coarse[:, k, 0].sum())
    total = coarse.sum(axis=(0, 1))
    n, good = total[0], total[1]
    squares = coarse[:, :, 3] - 2.0 * coarse[:, :, 4] + coarse[:, :, 1]
    brier, came = float(squares.sum() / n), float(good / n)
    plain = came * (1.0 - came)
    return Reliability(
        points, int(n), int(np.count_nonzero(coarse[:, :, 0].sum(axis=1))), came, brier,
        1.0 - brier / plain if plain else 0.0, calibration_error(flights),
        _mean_by_flight(squares.sum(axis=1), coarse[:, :, 0].sum(axis=1)),
    )  # fmt: skip


def _coarse(flights: FloatArray) -> FloatArray:
    """[flights, bins of a diagram, 5] from counts [flights, BINS, 5]."""
    coarse = np.zeros((len(flights), COARSE[-1] + 1, 5))
    for fine, to in enumerate(COARSE):
        coarse[:, to] += flights[:, fine]
    return coarse


def calibration_error(flights: FloatArray) -> float:
    """Mean distance of a bin's rating from its share, from counts [flights, BINS, 5]."""
    total = _coarse(flights).sum(axis=0)
    return float(np.abs(total[:, 2] - total[:, 1]).sum() / total[:, 0].sum())


def _point(flights: FloatArray) -> DiagramBin:
    """A bin of many flights [flights, 5]."""
    there = flights[flights[:, 0] > 0]
    share, low, high = share_by_flights(there[:, 1], there[:, 0])
    n, said = there[:, 0].sum(), there[:, 2].sum()
    return DiagramBin(float(said / n), share, low, high, int(n), len(there))


def share_by_flights(good: FloatArray, number: FloatArray) -> tuple[float, float, float]:
    """Share of moments that were good, and its interval, from counts [flights] of each flight.

    Flights are independent, moments of one are not: the interval is Clopper and Pearson's at the
    effective sample size.
    """
    n = number.sum()
    share = good.sum() / n
    off = good - share * number
    variance = (off @ off) / n**2
    worth = share * (1.0 - share) / variance if variance > 0.0 else float(len(number))
    worth = min(max(worth, 1.0), n)
    return float(share), *clopper_pearson(share * worth, worth)


def clopper_pearson(
    good: float, trials: float, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Interval of a share of trials that need be no whole number (Korn and Graubard 1998)."""
    from scipy.stats import beta

    tail = 0.5 * (1.0 - confidence)
    bad = trials - good
    low = float(beta.ppf(tail, good, bad + 1.0)) if good > 1e-9 else 0.0
    high = float(beta.ppf(1.0 - tail, good + 1.0, bad)) if bad > 1e-9 else 1.0
    return low, high


def _mean_by_flight(sums: FloatArray, counts: FloatArray) -> tuple[float, float]:
    """95 % about a ratio of sums, flights being what was drawn."""
    mean = sums.sum() / counts.sum()
    off = sums - mean * counts
    half = 1.96 * float(np.sqrt(off @ off)) / float(counts.sum())
    return float(mean - half), float(mean + half)


def stack_bins(flights: Sequence[FloatArray]) -> FloatArray:
    """[flights, BINS, 5]."""
    return np.stack(list(flights)) if flights else np.zeros((0, BINS, 5))
