"""How far a sensor is to be believed: precision and trust, and rules by which several combine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.base.variants import Variants


@dataclass(frozen=True, slots=True)
class Standing:
    """Precision and trust of one sensor, each in (0, 1]; raises ClearwayError otherwise."""

    precision: float = 1.0
    """Share of its hits that lie in the cell that they are reported for."""
    trust: float = 1.0
    """How far its word counts at the start; contradiction by others lowers it in flight."""

    def __post_init__(self) -> None:
        for name in ("precision", "trust"):
            if not 0.0 < getattr(self, name) <= 1.0:
                raise ClearwayError(
                    f"sensor: {name} must be above 0 and at most 1, got {getattr(self, name)}"
                )

    @property
    def weight(self) -> float:
        return self.precision * self.trust


FULL = Standing()

CombineRule = Callable[
    [FloatArray, FloatArray, BoolArray, FloatArray], tuple[FloatArray, FloatArray]
]
"""(P_OD [sensors, cells], P_V [sensors, cells], looks [sensors, cells], weights [sensors]) ->
P_OD [cells], P_V [cells]."""


def conjunction(
    probability: FloatArray, visibility: FloatArray, looks: BoolArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(5.38): free only if it is free for all, whatever their weights; the best view counts."""
    del looks, weight
    return 1.0 - np.prod(1.0 - probability, axis=0), visibility.max(axis=0)


def weight_by_views(
    probability: FloatArray, visibility: FloatArray, looks: BoolArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(5.38) with every factor to the power of its weight; views in proportion to weight.

    Weights are relative to the heaviest sensor that looks into the cell, so that a cell that one
    sensor alone looks into is rated by what that one says.
    """
    heaviest = np.max(np.where(looks, weight[:, None], 0.0), axis=0)
    share = np.where(looks, weight[:, None] / np.maximum(heaviest, 1e-12), 0.0)
    free = np.prod((1.0 - probability) ** share, axis=0)
    return 1.0 - free, (share * visibility).max(axis=0)


COMBINE_RULES: Variants[CombineRule] = Variants(
    "sensor fusion rule", {"conjunction": conjunction, "weighted": weight_by_views}
)
"""How the evidence of several sensors becomes one; settings take the name."""


def combine_rule_named(name: str) -> CombineRule:
    """The rule of that name; raises ClearwayError listing the valid ones."""
    return COMBINE_RULES.find(name)
