"""What a baseline is: a rule from what is known to what is flown next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.brief import brief
from clearway.live.mission import Mode


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """What to fly next, and why; renewed after its first movement."""

    movements: tuple[str, ...]
    """At least one."""
    reason: str
    mode: Mode = Mode.NAVIGATION
    wish: tuple[float, float, float] = (1.0, 0.0, 0.0)
    """Direction of flight wished for, world frame, by rules that wish for one."""


@dataclass(frozen=True, slots=True, eq=False)
class Craft:
    """What a rule knows of the vehicle before take-off."""

    planner: Planner
    """Movements, grid, reach sets, costs and margin: the same as clearway's."""
    body_radius_m: float
    """r_v of (6.14) and (6.15)."""
    conservative_turning_radius_m: float
    """r_t of (6.14)."""

    __repr__ = brief


ManoeuvreRule = Callable[[Situation, Manoeuvre | None], Manoeuvre]
"""(what is known, the manoeuvre before) -> the next one."""
MakeRule = Callable[[Craft], ManoeuvreRule]
