"""Habits of real autopilots that a simulated one can take on, each seen on ArduCopter's own."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clearway.avoidance.plan.time_cost import speed_abilities
from clearway.vehicle.automaton import MovementAutomaton

TILT_S = 0.15
"""Of a copter of some kilograms."""
STRONGER = 1.5
"""Acceleration that a copter has, in those that it is flown with: some is needed to correct."""


@dataclass(frozen=True, slots=True)
class Habits:
    """None of them by default."""

    takes_off_s: float = 0.0
    """Begins on the ground, and takes off for so long; a set-point meanwhile ends the take-off."""
    stays_on_ground: bool = False
    """Never takes off by itself: disarmed."""
    follows_from_s: float = 0.0
    """Its mode follows set-points from then on."""
    pauses_s: tuple[float, float] = (math.inf, math.inf)
    """From when until when another mode brakes and holds."""
    led_away_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """With which velocity a pilot flies it meanwhile; east, north, up."""
    deaf: bool = False
    """Takes no set-point, and says nothing of it, as one that asks for signatures."""
    tilt_deg: float = 0.0
    """Its nose is down by so much, and with it the plane in which distances are measured."""
    timeout_s: float = math.inf
    """A set-point is flown on for so long after it came; then it stops."""
    acceleration_mps2: float = math.inf
    climb_acceleration_mps2: float = math.inf
    """Up and down."""
    tilt_s: float = 0.0
    """Acceleration comes with this time constant, since it tilts first: a copter with inertia."""
    jerk_mps3: float = math.inf
    """By how much its acceleration changes a second: ArduCopter's PSC_JERK_XY, 5 by default."""
    dead_s: float = 0.0
    """What it is told moves it so much later."""
    trims_for_s: float = 0.0
    """What it accelerates by when another kind of set-point comes it takes for wind, and adds it
    with this time constant: ArduCopter, for about 2 s."""
    traffic_every_s: float = 0.0
    """New positions of aircraft come so seldom; between them the old one is told every second, with
    the age that it had."""
    traffic_late_s: float = 0.0
    """Positions of aircraft are older than told by up to so much."""
    lost_from_s: float = math.inf
    """From then on nothing new is reported of aircraft: the last position is repeated."""
    stall_s: tuple[float, float] = (math.inf, 0.0)
    """When its clock stands still, and for how long."""
    jitter_s: float = 0.0
    """Messages come late by up to so much."""
    asks_first: bool = False
    """Streams come only when they are asked for; heartbeats come anyway."""
    sectors: bool = False
    """Distances come as DISTANCE_SENSOR, one for each of eight sectors: those that have ever shown
    anything, and none while none shows anything."""
    sensor_dies_s: float = math.inf
    refuses: tuple[int, ...] = ()
    """Messages of these numbers are not sent, and that is said when they are asked for."""
    height_off_m: float = 0.0
    """Of the local frame's zero above the home."""
    seed: int = 0

    def late_s(self, name: str, time_s: float) -> float:
        """How much older than told the position of an aircraft is."""
        if not self.traffic_late_s:
            return 0.0
        parts = [self.seed, round(1000.0 * time_s), *name.encode()]
        return float(np.random.default_rng(parts).uniform(0.0, self.traffic_late_s))


def default_habits(automaton: MovementAutomaton) -> Habits:
    """Of a vehicle with inertia those of a copter that tilts, a little stronger than it is flown;
    else none."""
    if not automaton.has_inertia:
        return Habits()
    return Habits(
        tilt_s=TILT_S, acceleration_mps2=STRONGER * speed_abilities(automaton).acceleration_mps2
    )
