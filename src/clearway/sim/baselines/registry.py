"""The planners by name: clearway's own, those that it is compared with, and users' own."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from functools import lru_cache, wraps
from inspect import getdoc
from pathlib import Path
from typing import Any

from clearway.avoidance.plan.situation import Situation
from clearway.base.errors import OwnCodeError
from clearway.base.own_code import callable_own, guard_call
from clearway.base.variants import Variants
from clearway.live import AvoidanceSystem
from clearway.sim.baselines.deterministic import first_hit, full, make_reduced
from clearway.sim.baselines.knowledge import EVERYTHING, NOTHING, Danger, Source, describe_hidden
from clearway.sim.baselines.manoeuvre import Craft, MakeRule, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.margins import adaptive, turn_back
from clearway.sim.baselines.mvp import make_mvp
from clearway.sim.baselines.pilot import BaselinePilot
from clearway.sim.baselines.potential_field import potential_field
from clearway.sim.baselines.straight import straight
from clearway.sim.baselines.velocity_obstacle import velocity_obstacle
from clearway.sim.baselines.vfh import vector_field_histogram
from clearway.sim.pilot import CLEARWAY, Pilot, Steering

MakePilot = Callable[[AvoidanceSystem, Craft], Pilot[Steering]]
"""(a system that has not flown, the vehicle) -> who flies; rivals use the system as knowledge."""


@dataclass(frozen=True, slots=True)
class KnownPlanner:
    """A planner that may fly, and what tables must say of it."""

    make: MakePilot
    knows: frozenset[Source] = EVERYTHING
    """What it decides by."""
    shares: str = ""
    """What of clearway's decisions it uses; empty for nothing, and for clearway."""
    reference: bool = False
    """Whether it avoids nothing on purpose: what others are checked against."""

    def __call__(self, system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
        return self.make(system, craft)

    @property
    def about(self) -> str:
        """What it is, in a line."""
        return (getdoc(self.make) or "").partition("\n")[0]

    def describe_hidden(self, dangers: Iterable[Danger]) -> str:
        """What of a flight it cannot know, in words; empty for nothing, and for a reference."""
        return "" if self.reference else describe_hidden(self.knows, dangers)


def _clearway(system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
    """Clearway itself: the cheapest trajectory that is rated safe and keeps the margin."""
    del craft
    return system


def _make_ruled(make: MakeRule) -> MakePilot:
    """Make the pilot that flies by the rules that `make` makes, one for each craft."""
    rule_of = lru_cache(maxsize=8)(make)

    @wraps(make)
    def pilot(system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
        return BaselinePilot(system, rule_of(craft))

    return pilot


def _own(label: str, found: Any) -> KnownPlanner:
    """A user's `make(craft) -> rule`: called for every flight, so that rules may remember.

    It may say what its rules know: `make.knows = ("sensors",)`.
    """
    make = guard_call(label, callable_own(label, found, ("craft",)))

    def pilot(system: AvoidanceSystem, craft: Craft) -> Pilot[Steering]:
        return BaselinePilot(system, _check(label, make(craft), craft))

    return KnownPlanner(pilot, _read_declared(label, getattr(found, "knows", tuple(Source))))


def _read_declared(label: str, knows: Any) -> frozenset[Source]:
    """The sources that a user's planner says it knows."""
    named = (knows,) if isinstance(knows, str) else knows
    valid_names = [str(source) for source in Source]
    if not isinstance(named, Collection) or not all(name in valid_names for name in named):
        valid = ", ".join(map(repr, valid_names))
        raise OwnCodeError(label, f"has knows = {knows!r}; valid: a tuple of {valid}")
    return frozenset(Source(name) for name in named)


def _check(label: str, found: Any, craft: Craft) -> ManoeuvreRule:
    """A user's rule; what is no manoeuvre of the vehicle is refused in flight."""
    said = f"{label}(craft)"
    asked = guard_call(said, callable_own(said, found, ("situation", "before")))
    names = craft.planner.automaton.names

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        answer = asked(situation, before)
        if not isinstance(answer, Manoeuvre):
            raise OwnCodeError(
                said,
                f"gave {type(answer).__name__}; a Manoeuvre is needed (clearway.sim.baselines)",
            )
        unknown = [repr(name) for name in answer.movements if name not in names]
        if unknown or not answer.movements:
            raise OwnCodeError(
                said,
                f"gave movements {', '.join(unknown) or '()'}; at least one is needed, of "
                f"{', '.join(names)}",
            )
        return answer

    return rule


COSTS = "reach sets and costs"
GUIDANCE = "memory of returns; the cheapest way of its reach sets, to aim along"
VERIFICATION = "reach sets, costs, memory of returns and verification; only margins differ"
HITS = frozenset({Source.SENSORS})
PLANNERS: Variants[KnownPlanner] = Variants(
    "planner",
    {
        CLEARWAY: KnownPlanner(_clearway),
        "straight": KnownPlanner(_make_ruled(straight), NOTHING, COSTS, reference=True),
        "deterministic": KnownPlanner(_make_ruled(full), HITS, "costs, and hits in its cells"),
        "deterministic-reduced": KnownPlanner(
            _make_ruled(make_reduced), HITS, f"{COSTS}, hits in its cells"
        ),
        "deterministic-first-hit": KnownPlanner(
            _make_ruled(first_hit), HITS, f"{COSTS}, hits in its cells"
        ),
        "potential-field": KnownPlanner(_make_ruled(potential_field), shares=GUIDANCE),
        "turn-back": KnownPlanner(_make_ruled(turn_back), shares=VERIFICATION),
        "adaptive": KnownPlanner(_make_ruled(adaptive), shares=VERIFICATION),
        "vfh": KnownPlanner(_make_ruled(vector_field_histogram), shares=GUIDANCE),
        "velocity-obstacle": KnownPlanner(_make_ruled(velocity_obstacle), shares=GUIDANCE),
        "mvp": KnownPlanner(_make_ruled(make_mvp), shares=GUIDANCE),
    },
    _own,
)
"""Who may fly, by name; add one here."""


def check_planner_name(name: str, folder: Path | None = None) -> str:
    """The name itself; raises ClearwayError listing the valid ones for any other.

    folder: where modules of users are looked for before the current one.
    """
    PLANNERS.find(name, folder)
    return name


def pilot_named(
    name: str, system: AvoidanceSystem, craft: Craft, folder: Path | None = None
) -> Pilot[Steering]:
    """Make the pilot of a planner's name, or of `module:name`; errors as `check_planner_name`."""
    return PLANNERS.find(name, folder)(system, craft)
