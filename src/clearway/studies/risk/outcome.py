"""What came of one encounter, without avoidance and with each planner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from clearway.studies.risk.flight import Separation
from clearway.studies.risk.settings import STRAIGHT


@dataclass(frozen=True, slots=True)
class RiskOutcome:
    """What came of one encounter, without avoidance and with each planner."""

    number: int
    weight: float
    layer: int
    """Altitude layer that the intruder begins in, from 0."""
    straight: Separation
    flown: Mapping[str, Separation]
    """By planner."""
    emergencies: Mapping[str, int]
    """Decisions in which nothing kept the margin, by planner."""
    decision_ms: Mapping[str, float] = field(default_factory=dict, compare=False)
    """Median of the decisions, by planner; without those that took none."""

    def of(self, planner: str) -> Separation:
        """Of a planner, or of straight flight."""
        return self.straight if planner == STRAIGHT else self.flown[planner]
