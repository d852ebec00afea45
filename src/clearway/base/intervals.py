"""How sure a rate or a mean is: intervals that hold what was not flown."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

CONFIDENCE = 0.95
RESAMPLES = 2_000


def wilson(successes: int, trials: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Wilson score interval of a share; (0, 1) without any trial."""
    from scipy.stats import binomtest

    if not trials:
        return 0.0, 1.0
    interval = binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    return float(interval.low), float(interval.high)


def exact_share(successes: int, trials: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Clopper and Pearson's exact interval of a share; (0, 1) without any trial."""
    from scipy.stats import binomtest

    if not trials:
        return 0.0, 1.0
    interval = binomtest(successes, trials).proportion_ci(confidence, method="exact")
    return float(interval.low), float(interval.high)


class Interval(NamedTuple):
    """A figure and the interval that holds it with the confidence asked for; NaN without any."""

    value: float
    low: float
    high: float


def poisson_sum(weights: npt.ArrayLike, unseen: float, confidence: float = CONFIDENCE) -> Interval:
    """Expected sum of the weights [k] of independent rare events, k of which were seen.

    unseen: weight of one more event, had it been seen. Gamma interval of Fay and Feuer (1997),
    exact for equal weights (Garwood); it never shrinks when an event is added.
    """
    from scipy.stats import gamma

    seen = np.asarray(weights, dtype=np.float64)
    tail = 0.5 * (1.0 - confidence)
    total, squares = float(seen.sum()), float((seen**2).sum())
    low = 0.0
    if total > 0.0:
        low = float(gamma.ppf(tail, total**2 / squares, scale=squares / total))
    more, more_squares = total + unseen, squares + unseen**2
    high = float(gamma.ppf(1.0 - tail, more**2 / more_squares, scale=more_squares / more))
    return Interval(total, low, high)


def bound_weighted_share(
    bad: npt.ArrayLike, weights: npt.ArrayLike, confidence: float = CONFIDENCE
) -> Interval:
    """Share of the weight of trials [n] that is bad [n], as Korn and Graubard (1998) bound it.

    Clopper and Pearson's interval for as many equal trials as the weights are worth (Kish); exact
    for equal weights, and it never shrinks when one more trial turns out bad. (0, 1) without any.
    """
    from scipy.stats import beta

    each, flags = np.asarray(weights, dtype=np.float64), np.asarray(bad, dtype=np.bool_)
    if not len(each):
        return Interval(float("nan"), 0.0, 1.0)
    trials = float(each.sum() ** 2 / (each**2).sum())
    share = float(each[flags].sum() / each.sum())
    tail, successes = 0.5 * (1.0 - confidence), share * trials
    low = float(beta.ppf(tail, successes, trials - successes + 1.0)) if successes else 0.0
    left = trials - successes
    high = float(beta.ppf(1.0 - tail, successes + 1.0, left)) if left > 0.0 else 1.0
    return Interval(share, low, high)


def ratio_of(over: Interval, under: Interval) -> Interval:
    """Ratio of two independent figures from their intervals (Donner and Zou 2012, MOVER-R).

    NaN and no bound where `under` is 0; its upper end never falls as `over` grows.
    """
    if under.value <= 0.0 or under.low <= 0.0:
        return Interval(float("nan"), 0.0, float("inf"))
    both = over.value * under.value
    lowest = over.low * (2.0 * over.value - over.low)
    most_under = under.high * (2.0 * under.value - under.high)
    highest = over.high * (2.0 * over.value - over.high)
    least_under = under.low * (2.0 * under.value - under.low)
    low = 0.0
    if most_under > 0.0:
        low = (both - np.sqrt(max(both**2 - lowest * most_under, 0.0))) / most_under
    high = (both + np.sqrt(max(both**2 - highest * least_under, 0.0))) / least_under
    return Interval(over.value / under.value, float(max(low, 0.0)), float(high))


def sum_of(first: Interval, second: Interval) -> Interval:
    """Sum of two independent figures from their intervals (Zou and Donner 2008, MOVER)."""
    value = first.value + second.value
    return Interval(
        value,
        value - float(np.hypot(first.value - first.low, second.value - second.low)),
        value + float(np.hypot(first.high - first.value, second.high - second.value)),
    )


def bootstrap_mean(
    values: npt.ArrayLike, confidence: float = CONFIDENCE, seed: int = 0
) -> tuple[float, float]:
    """Percentile bootstrap interval of the mean of values [n]; NaN of fewer than two.

    The same values in the same order give the same interval.
    """
    sample = np.asarray(values, dtype=np.float64)
    if len(sample) < 2:
        return float("nan"), float("nan")
    rng = np.random.default_rng([seed, 50])
    picked = rng.integers(len(sample), size=(RESAMPLES, len(sample)))
    means = sample[picked].mean(axis=1)
    tail = 50.0 * (1.0 - confidence)
    low, high = np.percentile(means, [tail, 100.0 - tail])
    return float(low), float(high)
