"""How hard the vehicle brakes that a guardian answers for, and who says so."""

from __future__ import annotations

import math

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.time_cost import speed_abilities

ASSUMED_MPS2 = 3.0
"""Braking of a vehicle of which nobody says how it brakes: autopilots of copters brake harder."""


def find_braking(planner: Planner, told_mps2: float | None) -> tuple[float, str]:
    """The acceleration of a vehicle, and a sentence that says so."""
    automaton = planner.automaton
    if told_mps2 is not None:
        return told_mps2, f"braking at {told_mps2:g} m/s2, as told"
    if automaton.has_inertia:
        own = speed_abilities(automaton).acceleration_mps2
        return own, f"braking at {own:.3g} m/s2, as the vehicle does"
    if not automaton.can_stop:
        return math.inf, "the vehicle cannot stop"
    return ASSUMED_MPS2, (
        f"braking at {ASSUMED_MPS2:g} m/s2 is assumed; type --acceleration-mps2, or "
        'kind = "multirotor" with acceleration_mps2, to say what the vehicle does'
    )
