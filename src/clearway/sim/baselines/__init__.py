"""The planners that clearway is compared with, by name; all fly by `BaselinePilot`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

from clearway.base.errors import ClearwayError
from clearway.sim.baselines.deterministic import first_hit, full, reduced
from clearway.sim.baselines.manoeuvre import Craft, MakeRule, Manoeuvre, Rule
from clearway.sim.baselines.margins import adaptive, turn_back
from clearway.sim.baselines.mvp import modified_voltage_potential
from clearway.sim.baselines.pilot import BaselineDecision, BaselinePilot
from clearway.sim.baselines.potential_field import potential_field
from clearway.sim.baselines.straight import straight
from clearway.sim.baselines.velocity_obstacle import velocity_obstacle
from clearway.sim.baselines.vfh import vector_field_histogram
from clearway.sim.pilot import CLEARWAY

BASELINES: Mapping[str, MakeRule] = MappingProxyType(
    {
        "straight": straight,
        "deterministic": full,
        "deterministic-reduced": reduced,
        "deterministic-first-hit": first_hit,
        "potential-field": potential_field,
        "turn-back": turn_back,
        "adaptive": adaptive,
        "vfh": vector_field_histogram,
        "velocity-obstacle": velocity_obstacle,
        "mvp": modified_voltage_potential,
    }
)
"""Rules by name: functions of the craft."""
PLANNERS = (CLEARWAY, *BASELINES)


def known_planner(name: str) -> str:
    """The name itself; raises ClearwayError listing the valid ones for any other."""
    if name not in PLANNERS:
        raise ClearwayError(f"planner {name!r}: there are {', '.join(PLANNERS)}")
    return name


@lru_cache(maxsize=32)
def rule_named(name: str, craft: Craft) -> Rule:
    """The baseline of that name for a craft; made once. Errors as of `known_planner`."""
    return BASELINES[known_planner(name)](craft)


__all__ = [
    "BASELINES",
    "CLEARWAY",
    "PLANNERS",
    "BaselineDecision",
    "BaselinePilot",
    "Craft",
    "Manoeuvre",
    "Rule",
    "known_planner",
    "rule_named",
]
