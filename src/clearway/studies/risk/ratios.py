"""Rates and risk ratios of a study, weighted, with intervals for rare events.

A rate is per encounter, which is an aircraft that enters the encounter cylinder. A risk ratio is
the rate with avoidance over that without. It is the sum of two parts: unresolved cases, which are
bad with and without it, and induced ones, which are bad only with it. Each part has its interval:
unresolved ones are a share of the cases without avoidance, induced ones rare events beside them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.base.checks import collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.intervals import Interval, bound_weighted_share, poisson_sum, ratio_of, sum_of
from clearway.base.state import BoolArray
from clearway.studies.risk.outcome import RiskOutcome
from clearway.studies.risk.settings import STRAIGHT
from clearway.studies.risk.study import RiskStudy

MEASURES = {
    "collision": "collision",
    "near_collision": "near mid-air collision",
    "lost_well_clear": "loss of well clear",
    "margin_lost": "margin loss",
}
"""Fields of `Separation` that count, and what they are called."""
LARGEST_RATIOS = {"near_collision": 0.18, "lost_well_clear": 0.40}
"""Largest risk ratios of ASTM F3442 with intruders that report themselves."""


LARGEST_LIMIT = 100.0
"""A ratio of 1 is no better than straight flight: what is larger is worse."""


@dataclass(frozen=True, slots=True)
class RiskLimits:
    """Largest risk ratios that are asked for."""

    near_collision: float = LARGEST_RATIOS["near_collision"]
    lost_well_clear: float = LARGEST_RATIOS["lost_well_clear"]

    def __post_init__(self) -> None:
        problems = collect_problems(
            number_problem(name, getattr(self, name), high=LARGEST_LIMIT) for name in LARGEST_RATIOS
        )
        if problems:
            raise InputError("risk", problems)

    def of(self, measure: str) -> float | None:
        """Of a measure; None where none is asked for."""
        return getattr(self, measure) if measure in LARGEST_RATIOS else None


OUTER = {
    "collision": "near_collision",
    "near_collision": "lost_well_clear",
    "lost_well_clear": "margin_lost",
    "margin_lost": "margin_lost",
}
"""The next larger volume: what is inside of one is inside of the other."""


@dataclass(frozen=True, slots=True)
class Risk:
    """One measure of one planner."""

    rate: Interval
    """Per encounter."""
    ratio: Interval
    """To straight flight."""
    unresolved: Interval
    """Part of the ratio that is bad with and without."""
    induced: Interval
    """Part of the ratio that is bad only with avoidance."""
    cases: tuple[int, ...]
    """Numbers of the encounters that were bad."""
    induced_cases: tuple[int, ...]


def weigh_encounters(study: RiskStudy) -> FloatArray:
    """[n] of the encounters, 1 on average."""
    weights = np.array([outcome.weight for outcome in study.outcomes])
    return np.asarray(weights / weights.mean())


def compute_risk(study: RiskStudy, planner: str, measure: str) -> Risk:
    """One measure, of a planner or of straight flight, with 95 % intervals.

    An event that was not seen is taken to weigh what those of the next larger volume do, of which
    it would be one.
    """
    weights = weigh_encounters(study)
    numbers = np.array([outcome.number for outcome in study.outcomes])
    without, bad = (_flags(study, name, measure) for name in (STRAIGHT, planner))
    induced = bad & ~without
    unseen = _weight_of_one(study, planner, measure, weights)
    before = poisson_sum(weights[without], unseen)
    unresolved = bound_weighted_share(bad[without], weights[without])
    of_induced = ratio_of(poisson_sum(weights[induced], unseen), before)
    if not np.any(without):
        unresolved = Interval(np.nan, 0.0, np.inf)
    return Risk(
        rate=ratio_of(poisson_sum(weights[bad], unseen), _total(weights)),
        ratio=sum_of(unresolved, of_induced),
        unresolved=unresolved,
        induced=of_induced,
        cases=tuple(int(number) for number in numbers[bad]),
        induced_cases=tuple(int(number) for number in numbers[induced]),
    )


def _total(weights: FloatArray) -> Interval:
    """Sum of the weights, which stands for all that enters."""
    total, count = float(weights.sum()), len(weights)
    unsure = 1.0 + 1.96 * float(weights.std()) / float(weights.mean()) / count**0.5
    return Interval(total, total / unsure, total * unsure)


def mean_aside_m(study: RiskStudy, planner: str) -> float:
    """Farthest from straight flight, weighted mean over all encounters: what avoiding costs."""
    aside = np.array([outcome.of(planner).aside_m for outcome in study.outcomes])
    return float(weigh_encounters(study) @ aside / len(aside))


def decision_ms(study: RiskStudy, planner: str) -> float:
    """Median over encounters of the median of a planner's decisions; NaN where it took none."""
    took = [each.decision_ms[planner] for each in study.outcomes if planner in each.decision_ms]
    return float(np.median(took)) if took else float("nan")


def _flags(study: RiskStudy, planner: str, measure: str) -> BoolArray:
    return np.array([bool(getattr(outcome.of(planner), measure)) for outcome in study.outcomes])


def _weight_of_one(study: RiskStudy, planner: str, measure: str, weights: FloatArray) -> float:
    """Mean weight, by weight, of what came into the next larger volume; else of all."""
    near = np.zeros(len(weights), dtype=np.bool_)
    for name in (STRAIGHT, planner):
        near |= _flags(study, name, measure) | _flags(study, name, OUTER[measure])
    of = weights[near] if np.any(near) else weights
    return float((of**2).sum() / of.sum())


def effective_number(study: RiskStudy, measure: str) -> float:
    """How many encounters of equal weight those are worth that are bad without avoidance (Kish)."""
    bad = weigh_encounters(study)[_flags(study, STRAIGHT, measure)]
    return float(bad.sum() ** 2 / (bad**2).sum()) if len(bad) else 0.0


def by_layer(study: RiskStudy) -> dict[int, tuple[float, RiskStudy]]:
    """Share of the weight, and the encounters, of each altitude layer that intruders begin in."""
    weights = weigh_encounters(study)
    layers = np.array([outcome.layer for outcome in study.outcomes])
    found = {}
    for layer in np.unique(layers).tolist():
        some = tuple(outcome for outcome in study.outcomes if outcome.layer == layer)
        share = float(weights[layers == layer].sum() / weights.sum())
        found[layer] = (share, replace(study, outcomes=some))
    return found


def mean_reversals(study: RiskStudy, planner: str) -> tuple[float, float]:
    """Changes of side and of sense an encounter, mean over those that lose well clear without
    avoidance; NaN without any."""
    flown = [each.of(planner) for each in study.outcomes if each.straight.lost_well_clear]
    if not flown:
        return float("nan"), float("nan")
    sides = float(np.mean([came.side_reversals for came in flown]))
    return sides, float(np.mean([came.sense_reversals for came in flown]))


def worst_cases(study: RiskStudy, planner: str, most: int = 10) -> list[int]:
    """Numbers of the encounters that came out worst, the worst first."""

    def badness(outcome: RiskOutcome) -> tuple[int, float]:
        came = outcome.of(planner)
        return (-(came.collision + came.near_collision + came.lost_well_clear), came.nearest_m)

    bad = [each for each in study.outcomes if each.of(planner).lost_well_clear]
    return [each.number for each in sorted(bad, key=badness)[:most]]
