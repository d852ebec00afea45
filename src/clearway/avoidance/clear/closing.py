"""Coming nearer to what turns after the vehicle: opening the range has worth.

A pursuer goes where the vehicle goes, so its straight way says nothing of where it will be. What
counts is whether a way leads from where it is now, or towards it.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.hazards import MovingHazards
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.reach.tree import ReachSet


def closing_m(reach_set: ReachSet, nodes: IntArray, moving: MovingHazards) -> FloatArray:
    """[n] by how much more than straight away from it paths lead to the place of an intruder.

    Summed over those intruders that have shown a manoeuvre: 0 for a path that leads straight away
    from where it is now, twice its length for one straight towards it. moving: in the grid frame.
    """
    ends, flown = reach_set.samples_m[nodes, -1], reach_set.length_m[nodes]
    nearer = np.zeros(len(nodes))
    for place in moving.position_m[moving.manoeuvre_mps2 > 0.0]:
        apart = np.linalg.norm(ends - place, axis=1)
        nearer += np.maximum(float(np.linalg.norm(place)) + flown - apart, 0.0)
    return nearer
