"""What avoidance costs where none was needed: needless manoeuvres, and longer paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.intervals import Interval, bound_weighted_share
from clearway.studies.risk.ratios import weigh_encounters
from clearway.studies.risk.study import RiskStudy


@dataclass(frozen=True, slots=True)
class Nuisance:
    """Manoeuvres of one planner; a needless one is where straight flight keeps well clear."""

    of_clear: Interval
    """Share of the encounters that straight flight keeps well clear in which it manoeuvres."""
    of_manoeuvres: Interval
    """Share of the encounters in which it manoeuvres that straight flight keeps well clear."""
    extra_path_m: float
    """Mean over encounters in which it manoeuvres; NaN without any."""
    extra_path_each_m: float
    """Mean over all that enter."""


def compute_nuisance(study: RiskStudy, planner: str) -> Nuisance:
    """Compute how often a planner manoeuvres without need, and how much longer its paths are."""
    weights = weigh_encounters(study)
    clear = np.array([not each.straight.lost_well_clear for each in study.outcomes])
    moved = np.array([each.of(planner).manoeuvred for each in study.outcomes])
    extra = np.array([each.of(planner).extra_path_m for each in study.outcomes])
    return Nuisance(
        of_clear=bound_weighted_share(moved[clear], weights[clear]),
        of_manoeuvres=bound_weighted_share(clear[moved], weights[moved]),
        extra_path_m=_mean(extra[moved], weights[moved]),
        extra_path_each_m=_mean(extra, weights),
    )


def _mean(values: FloatArray, weights: FloatArray) -> float:
    return float(values @ weights / weights.sum()) if len(values) else float("nan")
