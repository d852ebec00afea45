"""The study's own search for a way: it knows the world, and flies no decision of clearway."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.obstacles.world import World
from clearway.vehicle.automaton import Movement, MovementAutomaton

KEPT = 400
"""States that are followed on from each movement: those farthest from everything."""
MOST_S = 60.0
STEPS = 6
"""Places that are looked at on each movement."""


def way_left(automaton: MovementAutomaton, world: World, state: FloatArray, body_m: float) -> bool:
    """Whether movements lead from a state [6] to where it is safe, the body clear of everything.

    Safe is to stand, of what can; else a way that has turned round, and for a minute at most.
    """
    ways = [(np.asarray(state, dtype=np.float64), 0.0)]
    shortest_s = min(movement.duration_s for movement in automaton.movements)
    while ways and ways[0][1] < MOST_S - shortest_s:
        found: list[tuple[float, FloatArray, float]] = []
        for at, flown_s in ways:
            for movement, stands in zip(automaton.movements, automaton.stands, strict=True):
                nearest_m, end = _flown(automaton, world, at, movement)
                if nearest_m <= body_m:
                    continue
                if stands or (not automaton.can_stop and abs(end[5] - state[5]) >= np.pi):
                    return True
                found.append((nearest_m, end, flown_s + movement.duration_s))
        found.sort(key=lambda one: -one[0])
        ways = [(end, at_s) for _, end, at_s in found[:KEPT]]
    return bool(ways)


def _flown(
    automaton: MovementAutomaton, world: World, state: FloatArray, movement: Movement
) -> tuple[float, FloatArray]:
    """How near it comes on a movement, and where that ends."""
    times = movement.duration_s * np.arange(1, STEPS + 1) / STEPS
    places = np.array([automaton.predict(state, movement, float(time)) for time in times])
    return float(world.distance_m(places[:, :3]).min()), places[-1]
