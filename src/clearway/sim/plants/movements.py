"""The movements that plants are usually flown with: what is asked of their loops, closed form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.inertialess import InertialessModel

GRAVITY_MPS2 = 9.81


def quadrotor_movements(speed_mps: float = 5.0, duration_s: float = 1.5) -> MovementAutomaton:
    """Those of a multirotor, with turns of 20 deg in flight, and climbs of 1.5 m/s ahead.

    Longer than it takes to stop: what came before the movement before then hardly matters. Without
    straight up and down, which lead out of the field of view at once: what leaves the view is paid
    for by a guess, and who believes in it stops for it.
    """
    every = MovementAutomaton.inertialess(
        speed_mps,
        20.0,
        duration_s=duration_s,
        steepest_deg=20.0,
        climb_mps=1.5,
        diagonals=False,
    )
    ahead = (m for m in every.movements if m.speed_mps or not m.climb_mps)
    return replace(every, movements=tuple(ahead))


def aeroplane_movements(
    speed_mps: float = 55.0,
    duration_s: float = 4.0,
    bank_deg: float = 20.0,
    climb_mps: float = 2.5,
    sink_mps: float = 3.0,
) -> MovementAutomaton:
    """Level turns of one bank, climbs and sinking that differ, and both at once."""
    rate = float(GRAVITY_MPS2 * np.tan(np.radians(bank_deg)) / speed_mps)
    turns = {"": 0.0, "Left": rate, "Right": -rate}
    climbs = {"": 0.0, "Up": climb_mps, "Down": -sink_mps}

    def all_movements() -> Iterator[Movement]:
        for climb_name, climb in climbs.items():
            for turn_name, turn in turns.items():
                name = "-".join(part for part in (climb_name, turn_name) if part) or "Straight"
                yield Movement(
                    name,
                    speed_mps,
                    yaw_rate_rps=turn,
                    duration_s=duration_s,
                    smooth=name == "Straight",
                    climb_mps=climb,
                )

    return MovementAutomaton(tuple(all_movements()), 0.0, vehicle=InertialessModel())
