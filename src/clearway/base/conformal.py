"""Bounds that hold with a stated share, whatever errors are distributed like: conformal prediction.

A score is by how much a prediction was too good. Of exchangeable scores the next one is no greater
than a quantile of the others with the share stated (Vovk et al. 2005). Where scores drift, the
level at which the quantile is taken is learned (Gibbs and Candes 2021).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

SHARE = 0.95
"""Of bounds that hold."""
MISSES = round(1.0 - SHARE, 12)
"""Of bounds that fail."""
STEP = 0.01
"""By which one bound that fails changes the level, as a share of 1."""
LEVELS = (0.002, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05)
"""Shares of bounds that fail, of which a table has the quantile."""


def conformal_quantile(scores: npt.ArrayLike, level: float) -> float:
    """Return the score that the next one exceeds with a chance of at most `level`.

    The ceil((n + 1)(1 - level))-th smallest of n scores; inf where n is too small for the level.

    >>> conformal_quantile(range(1, 20), 0.05), conformal_quantile(range(1, 19), 0.05)
    (19.0, inf)
    """
    ordered = np.sort(np.asarray(scores, dtype=np.float64).ravel())
    rank = math.ceil((len(ordered) + 1) * (1.0 - level) - 1e-9)
    if rank > len(ordered):
        return math.inf
    return float(ordered[rank - 1]) if rank > 0 else -math.inf


def quantile_table(scores: npt.ArrayLike) -> tuple[float, ...]:
    """Return the quantiles of scores at all LEVELS."""
    return tuple(conformal_quantile(scores, level) for level in LEVELS)


def quantile_at(table: Sequence[float], level: float) -> float:
    """Return the quantile of a table at a level, that of the next lower one in it; inf below all.

    >>> quantile_at([6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0], 0.04), quantile_at([0.0] * 7, -0.01)
    (1.0, inf)
    """
    found = math.inf
    for known, quantile in zip(LEVELS, table, strict=True):
        if known > level + 1e-12:
            break
        found = quantile
    return found


def level_after(level: float, *, missed: bool) -> float:
    """Return the level at which the next quantile is taken, after a bound that failed or held.

    It never rises above 1 - SHARE: what learns promises less, not more. Over T bounds the share
    that fails exceeds 1 - SHARE by (1 + STEP) / (T * STEP) at most, whatever the scores are, as
    long as a level of 0 or less is answered by a bound that always holds.

    >>> level_after(0.05, missed=True), level_after(0.05, missed=False)
    (0.0405, 0.05)
    """
    change = STEP * (MISSES - (1.0 if missed else 0.0))
    return min(round(level + change, 12), MISSES)
