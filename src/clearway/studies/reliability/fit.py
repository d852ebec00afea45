"""The calibrated rating's table: what share of cells rated so was free, never falling."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.studies.reliability.bins import BINS, bin_ratings

LEAST_CELLS = 200.0
"""Of a knot: neighbouring bins are put together until there are so many."""


def fit_knots(counts: FloatArray) -> FloatArray:
    """[knots, 2] rating and share that was good, both ascending; from counts [BINS, 5].

    Isotonic regression over the bins, each by its count. The ends are at 0 and 1.
    """
    from scipy.optimize import isotonic_regression

    said, share, count = _gather(counts)
    rising = np.asarray(isotonic_regression(share, weights=count, increasing=True).x)
    x = np.concatenate([[0.0], said, [1.0]])
    y = np.concatenate([rising[:1], rising, rising[-1:]])
    keep = np.concatenate([[True], np.diff(x) > 1e-9])
    if x[-2] >= 1.0 - 1e-9:
        keep[-1] = False
    return np.stack([x[keep], np.clip(y[keep], 0.0, 1.0)], axis=1)


def _gather(counts: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean rating, share that was good and count of bins that have enough of both; a rating of
    exactly 0 or 1 stays alone."""
    at_zero, at_one = bin_ratings(np.array([0.0, 1.0]))
    groups: list[FloatArray] = []
    open_group = np.zeros(5)
    for number in range(BINS):
        if number in (at_zero, at_one):
            if open_group[0]:
                groups.append(open_group)
            groups.append(counts[number].copy())
            open_group = np.zeros(5)
            continue
        open_group = open_group + counts[number]
        if open_group[0] >= LEAST_CELLS:
            groups.append(open_group)
            open_group = np.zeros(5)
    table = np.array([group for group in groups if group[0] > 0])
    return table[:, 2] / table[:, 0], table[:, 1] / table[:, 0], table[:, 0]
