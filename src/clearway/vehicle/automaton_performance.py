"""What a movement automaton can do of an encounter of minutes."""

from __future__ import annotations

import numpy as np

from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.performance import Performance


def derive_performance(automaton: MovementAutomaton) -> Performance:
    """What a movement automaton can do; its movements begin at once."""
    speeds = [m.pace_mps for m in automaton.movements if m.pace_mps > 0.0]
    climbs = [
        automaton.predict(np.zeros(6), movement)[2] / movement.duration_s
        for movement in automaton.movements
    ]
    limit = automaton.pitch_limit_rad
    steepest = automaton.fastest_mps * float(np.sin(np.pi / 2 if limit is None else limit))
    climb = max(steepest, *climbs)
    speed, radius = automaton.fastest_mps, automaton.turning_radius_m
    least = 1e-3 * speed
    return Performance(
        "automaton",
        "as its movements are",
        speed_mps=speed,
        slowest_mps=min(speeds),
        fastest_mps=speed,
        turn_mps2=max(speed**2 / radius if radius > 0.0 else speed, least),
        climb_mps=max(climb, least),
        sink_mps=max(climb, -min(climbs), least),
        acceleration_mps2=speed / max(m.duration_s for m in automaton.movements),
        turn_onset_s=0.0,
        climb_onset_s=0.0,
        reaction_s=0.0,
    )
