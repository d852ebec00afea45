"""The decision cycle: situation, hazards, evidence, fusion, costs, rules, verification, choice."""

from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision

__all__ = ["Decision", "decide"]
