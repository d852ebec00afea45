"""What an airframe can do of an encounter of minutes: speeds, rates, and how soon they come."""

from __future__ import annotations

import math
from dataclasses import dataclass

from clearway.base.checks import above_zero_problem, collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.variants import Variants


@dataclass(frozen=True, slots=True)
class Performance:
    """Speeds and rates that a vehicle flies at, and how long it takes to come to them."""

    name: str
    about: str
    speed_mps: float
    """Cruise."""
    slowest_mps: float
    fastest_mps: float
    turn_mps2: float
    """Acceleration across in a turn: the rate is that over the speed."""
    climb_mps: float
    sink_mps: float
    acceleration_mps2: float
    """Along, when it changes its speed."""
    turn_onset_s: float
    """Time constant with which a turn comes on: rolling into it."""
    climb_onset_s: float
    """Time constant with which a climb comes on."""
    reaction_s: float
    """From a decision to the first movement of the controls."""

    def __post_init__(self) -> None:
        positive = ("speed_mps", "fastest_mps", "turn_mps2", "climb_mps", "sink_mps",
                    "acceleration_mps2")  # fmt: skip
        others = ("slowest_mps", "turn_onset_s", "climb_onset_s", "reaction_s")
        problems = collect_problems(
            (
                *(above_zero_problem(name, getattr(self, name)) for name in positive),
                *(number_problem(name, getattr(self, name)) for name in others),
            )
        )
        if not problems and not self.slowest_mps <= self.speed_mps <= self.fastest_mps:
            problems.append("speed_mps: must lie between slowest_mps and fastest_mps")
        if problems:
            raise InputError(f"performance {self.name}", problems)

    def turn_rps(self, speed_mps: float) -> float:
        """Turn rate at a speed; what hovers turns on the spot, at most half a turn a second."""
        return min(math.pi, self.turn_mps2 / max(speed_mps, 1e-6))


COPTER = Performance(
    "copter",
    "15 m/s; speeds, climbs and accelerations are ArduCopter's defaults (WPNAV_*)",
    speed_mps=15.0,
    slowest_mps=3.0,
    fastest_mps=15.0,
    turn_mps2=2.5,
    climb_mps=2.5,
    sink_mps=1.5,
    acceleration_mps2=2.5,
    turn_onset_s=1.0,
    climb_onset_s=1.0,
    reaction_s=1.0,
)
WING = Performance(
    "wing",
    "25 m/s; turns with 30 degrees of bank, climbs are ArduPlane's defaults (TECS_*)",
    speed_mps=25.0,
    slowest_mps=20.0,
    fastest_mps=28.0,
    turn_mps2=5.66,
    climb_mps=5.0,
    sink_mps=5.0,
    acceleration_mps2=1.0,
    turn_onset_s=1.0,
    climb_onset_s=2.0,
    reaction_s=1.0,
)
PERFORMANCES: Variants[Performance] = Variants("vehicle", {"copter": COPTER, "wing": WING})
"""Airframes of encounter studies, by name."""
