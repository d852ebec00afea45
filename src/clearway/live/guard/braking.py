"""How hard the vehicle brakes that a guardian answers for, and who says so."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.time_cost import speed_abilities

ASSUMED_MPS2 = 3.0
"""Braking of a vehicle of which nobody says how it brakes: autopilots of copters brake harder."""


ASSUMED_LATE_S = 0.3
"""By which it answers later: copters tilt first, and come to a velocity ever more slowly."""


EAGER = 2.5
"""Times its braking, the most by which an autopilot gains speed: commanded a velocity, it takes its
own greatest."""
EAGER_LATE_S = 0.3
"""For so long it goes on to gain, and does not brake yet."""


class Braking(NamedTuple):
    """How a vehicle changes its velocity, and a sentence that says so."""

    acceleration_mps2: float
    late_s: float
    """For so long its velocity stays what it was."""
    why: str

    @property
    def eager(self) -> Braking:
        """How an autopilot may come to a commanded velocity: at once, and harder."""
        return self._replace(acceleration_mps2=EAGER * self.acceleration_mps2, late_s=0.0)

    @property
    def late(self) -> Braking:
        """How it brakes while it still gains speed."""
        return self._replace(late_s=max(self.late_s, EAGER_LATE_S))


def find_braking(planner: Planner, told_mps2: float | None) -> Braking:
    """Return the braking of a vehicle: told, its own, or a cautious default."""
    automaton = planner.automaton
    if told_mps2 is not None:
        return Braking(told_mps2, 0.0, f"braking at {told_mps2:g} m/s2, as told")
    if automaton.has_inertia:
        own = speed_abilities(automaton).acceleration_mps2
        return Braking(own, 0.0, f"braking at {own:.3g} m/s2, as the vehicle does")
    if not automaton.can_stop:
        return Braking(math.inf, 0.0, "the vehicle cannot stop")
    return Braking(
        ASSUMED_MPS2,
        ASSUMED_LATE_S,
        f"braking at {ASSUMED_MPS2:g} m/s2 is assumed, {ASSUMED_LATE_S:g} s late; type "
        '--acceleration-mps2, or kind = "multirotor" with acceleration_mps2, to say what the '
        "vehicle does",
    )
