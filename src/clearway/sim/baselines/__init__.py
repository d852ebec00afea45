"""The planners that clearway is compared with, by name; all fly by `BaselinePilot`."""

from clearway.sim.baselines.manoeuvre import Craft, MakeRule, Manoeuvre, Rule
from clearway.sim.baselines.pilot import BaselineDecision, BaselinePilot
from clearway.sim.baselines.registry import PLANNERS, known_planner, pilot_named
from clearway.sim.pilot import CLEARWAY

__all__ = [
    "CLEARWAY",
    "PLANNERS",
    "BaselineDecision",
    "BaselinePilot",
    "Craft",
    "MakeRule",
    "Manoeuvre",
    "Rule",
    "known_planner",
    "pilot_named",
]
