"""Pilots in the closed loop: clearway's own system, and the planners it is compared with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from typing_extensions import TypeVar

from clearway.avoidance.plan.planner import Planner
from clearway.base.state import State
from clearway.live import FlightDecision, Reading
from clearway.live.mission import Mission, Mode
from clearway.vehicle.automaton import Movement

CLEARWAY = "clearway"
"""The name of clearway's own planner among the others."""


class Steering(Protocol):
    """What every decision in flight tells, of any planner."""

    @property
    def time_s(self) -> float: ...

    @property
    def mode(self) -> Mode: ...

    @property
    def goal(self) -> int:
        """Index of the goal flown to."""
        ...

    @property
    def state(self) -> State:
        """Own state estimate that was decided for."""
        ...

    @property
    def movements(self) -> tuple[str, ...]:
        """The movement buffer to execute, at least one."""
        ...

    @property
    def explanation(self) -> str: ...

    @property
    def counts(self) -> Mapping[str, int]:
        """Data left out since the last decision, by reason."""
        ...


D = TypeVar("D", bound=Steering, covariant=True, default=FlightDecision)
"""The decisions of a pilot; clearway's own where nothing else is stated."""


class Pilot(Protocol[D]):
    """What a simulated flight asks of a pilot; `system.AvoidanceSystem` is one."""

    @property
    def planner(self) -> Planner:
        """The vehicle's movements, its grid and its safety margin."""
        ...

    @property
    def mission(self) -> Mission: ...

    @property
    def counts(self) -> Mapping[str, int]:
        """Data left out, by reason."""
        ...

    def update(self, reading: Reading) -> None:
        """Take one reading."""
        ...

    def due(self, now_s: float) -> str | None:
        """Why a decision is due, or None."""
        ...

    def decide(self, now_s: float) -> D:
        """Decide for the present moment."""
        ...

    def movement_at(self, time_s: float) -> Movement | None:
        """What to fly at a time, from the last decision on; None where nothing is decided."""
        ...
