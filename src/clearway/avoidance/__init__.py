"""The decision cycle: situation, hazards, evidence, fusion, costs, rules, verification, choice."""

from clearway.avoidance.decide import Decision, decide

__all__ = ["Decision", "decide"]
