"""Rates and risk ratios of a study, weighted, with bootstrap intervals.

A rate is per encounter, which is an aircraft that enters the encounter cylinder. A risk ratio is
the rate with avoidance over that without. It is the sum of two parts: unresolved cases, which are
bad with and without it, and induced ones, which are bad only with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.intervals import CONFIDENCE, RESAMPLES
from clearway.base.state import IntArray
from clearway.studies.risk.flight import STRAIGHT
from clearway.studies.risk.study import RiskStudy

MEASURES = {
    "collision": "collision",
    "near_collision": "near mid-air collision",
    "lost_well_clear": "loss of well clear",
    "margin_lost": "margin loss",
}
"""Fields of `Separation` that count, and what they are called."""
BLOCK = 100
"""Resamples at a time."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure with its interval; NaN where nothing can be said."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Risk:
    """One measure of one planner."""

    rate: Estimate
    """Per encounter."""
    ratio: Estimate
    """To straight flight."""
    unresolved: Estimate
    """Part of the ratio that is bad with and without."""
    induced: Estimate
    """Part of the ratio that is bad only with avoidance."""
    cases: tuple[int, ...]
    """Numbers of the encounters that were bad."""
    induced_cases: tuple[int, ...]


def weights_of(study: RiskStudy) -> FloatArray:
    """[n] of the encounters, 1 on average."""
    weights = np.array([outcome.weight for outcome in study.outcomes])
    return np.asarray(weights / weights.mean())


def risk(study: RiskStudy, planner: str, measure: str) -> Risk:
    """One measure, of a planner or of straight flight; intervals by resampling encounters."""
    weights = weights_of(study)
    numbers = np.array([outcome.number for outcome in study.outcomes])
    without, bad = (_flags(study, name, measure) for name in (STRAIGHT, planner))
    parts = {
        "all": weights,
        "without": weights * without,
        "bad": weights * bad,
        "unresolved": weights * (without & bad),
        "induced": weights * (~without & bad),
    }
    sums = {name: float(part.sum()) for name, part in parts.items()}
    drawn = _resampled(np.stack(list(parts.values())), study.seed)
    again = dict(zip(parts, drawn, strict=True))

    def estimate(over: str, under: str) -> Estimate:
        if sums[under] <= 0.0:
            return Estimate(np.nan, np.nan, np.nan)
        value = sums[over] / sums[under]
        if sums[over] == 0.0:
            return Estimate(0.0, 0.0, _none_seen(parts[under]))
        usable = again[under] > 0.0
        shares = again[over][usable] / again[under][usable]
        low, high = np.quantile(shares, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE])
        return Estimate(value, float(low), float(high))

    return Risk(
        rate=estimate("bad", "all"),
        ratio=estimate("bad", "without"),
        unresolved=estimate("unresolved", "without"),
        induced=estimate("induced", "without"),
        cases=tuple(int(number) for number in numbers[bad]),
        induced_cases=tuple(int(number) for number in numbers[bad & ~without]),
    )


def mean_aside_m(study: RiskStudy, planner: str) -> float:
    """Farthest from straight flight, weighted mean over all encounters: what avoiding costs."""
    aside = np.array([outcome.of(planner).aside_m for outcome in study.outcomes])
    return float(weights_of(study) @ aside / len(aside))


def _flags(
    study: RiskStudy, planner: str, measure: str
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.array([bool(getattr(outcome.of(planner), measure)) for outcome in study.outcomes])


def _none_seen(weighted: FloatArray) -> float:
    """Upper end where nothing was seen, by the number of equal trials that the weights are worth.

    That is Clopper and Pearson's: resampling what never happened would say that it never will.
    """
    trials = weighted.sum() ** 2 / (weighted**2).sum()
    return float(1.0 - (0.5 - 0.5 * CONFIDENCE) ** (1.0 / trials))


def _resampled(parts: FloatArray, seed: int) -> FloatArray:
    """[parts, resamples] sums of parts [parts, n] over encounters drawn with replacement."""
    count = parts.shape[1]
    rng = np.random.default_rng([seed, 72])
    sums = [parts @ _picks(count, rng).T for _ in range(RESAMPLES // BLOCK)]
    return np.concatenate(sums, axis=1)


def _picks(count: int, rng: np.random.Generator) -> IntArray:
    """[block, n] how often each encounter is drawn."""
    drawn = rng.integers(count, size=(BLOCK, count))
    drawn += count * np.arange(BLOCK)[:, None]
    return np.bincount(drawn.ravel(), minlength=BLOCK * count).reshape(BLOCK, count)
