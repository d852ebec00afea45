"""The planners by name: clearway's own, those that it is compared with, and users' own."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path
from typing import Any

from clearway.avoidance.situation import Situation
from clearway.base.errors import OwnCodeError
from clearway.base.own_code import callable_own, guarded
from clearway.base.variants import Variants
from clearway.live import AvoidanceSystem
from clearway.sim.baselines.deterministic import first_hit, full, reduced
from clearway.sim.baselines.manoeuvre import Craft, MakeRule, Manoeuvre, Rule
from clearway.sim.baselines.margins import adaptive, turn_back
from clearway.sim.baselines.mvp import modified_voltage_potential
from clearway.sim.baselines.pilot import BaselinePilot
from clearway.sim.baselines.potential_field import potential_field
from clearway.sim.baselines.straight import straight
from clearway.sim.baselines.velocity_obstacle import velocity_obstacle
from clearway.sim.baselines.vfh import vector_field_histogram
from clearway.sim.pilot import CLEARWAY, Pilot, Steering

MakePilot = Callable[[AvoidanceSystem, Craft], Pilot[Steering]]
"""(a system that has not flown, the vehicle) -> who flies; rivals use the system as knowledge."""


def _clearway(system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
    """Clearway itself: the cheapest trajectory that is rated safe and keeps the margin."""
    del craft
    return system


def _ruled(make: MakeRule) -> MakePilot:
    """Whoever flies by the rules that `make` makes, one for each craft."""
    rule_of = lru_cache(maxsize=8)(make)

    @wraps(make)
    def pilot(system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
        return BaselinePilot(system, rule_of(craft))

    return pilot


def _own(label: str, found: Any) -> MakePilot:
    """A user's `make(craft) -> rule`: called for every flight, so that rules may remember."""
    make = guarded(label, callable_own(label, found, ("craft",)))

    def pilot(system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
        return BaselinePilot(system, _checked(label, make(craft), craft))

    return pilot


def _checked(label: str, found: Any, craft: Craft) -> Rule:
    """A user's rule; what is no manoeuvre of the vehicle is refused in flight."""
    said = f"{label}(craft)"
    asked = guarded(said, callable_own(said, found, ("situation", "before")))
    names = craft.planner.automaton.names

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        answer = asked(situation, before)
        if not isinstance(answer, Manoeuvre):
            raise OwnCodeError(said, f"gave {type(answer).__name__}; a Manoeuvre is needed")
        unknown = [repr(name) for name in answer.movements if name not in names]
        if unknown or not answer.movements:
            raise OwnCodeError(
                said,
                f"gave movements {', '.join(unknown) or '()'}; at least one is needed, of "
                f"{', '.join(names)}",
            )
        return answer

    return rule


PLANNERS: Variants[MakePilot] = Variants(
    "planner",
    {
        CLEARWAY: _clearway,
        "straight": _ruled(straight),
        "deterministic": _ruled(full),
        "deterministic-reduced": _ruled(reduced),
        "deterministic-first-hit": _ruled(first_hit),
        "potential-field": _ruled(potential_field),
        "turn-back": _ruled(turn_back),
        "adaptive": _ruled(adaptive),
        "vfh": _ruled(vector_field_histogram),
        "velocity-obstacle": _ruled(velocity_obstacle),
        "mvp": _ruled(modified_voltage_potential),
    },
    _own,
)
"""Who may fly, by name; add one here."""


def known_planner(name: str, folder: Path | None = None) -> str:
    """The name itself; raises ClearwayError listing the valid ones for any other.

    folder: where modules of users are looked for before the current one.
    """
    PLANNERS.named(name, folder)
    return name


def pilot_named(
    name: str, system: AvoidanceSystem, craft: Craft, folder: Path | None = None
) -> Pilot[Steering]:
    """Whoever flies by that name, a user's own as `module:name`. Errors as of `known_planner`."""
    return PLANNERS.named(name, folder)(system, craft)
