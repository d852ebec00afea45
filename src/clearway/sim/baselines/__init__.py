"""The planners that clearway is compared with, by name; all fly by `BaselinePilot`."""

from clearway.sim.baselines.knowledge import NOT_APPLICABLE, REPORTED_TRAFFIC, Danger, Source
from clearway.sim.baselines.manoeuvre import Craft, MakeRule, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.pilot import BaselineDecision, BaselinePilot
from clearway.sim.baselines.registry import PLANNERS, check_planner_name, pilot_named
from clearway.sim.pilot import CLEARWAY

__all__ = [
    "CLEARWAY",
    "NOT_APPLICABLE",
    "PLANNERS",
    "REPORTED_TRAFFIC",
    "BaselineDecision",
    "BaselinePilot",
    "Craft",
    "Danger",
    "MakeRule",
    "Manoeuvre",
    "ManoeuvreRule",
    "Source",
    "check_planner_name",
    "pilot_named",
]
