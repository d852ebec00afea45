"""Velocities near a wished one, the nearest first: a wish is changed as little as can be."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from clearway.base.frames import FloatArray

STRAIGHT = tuple(round(0.05 * n, 2) for n in range(20, 3, -1))
"""Shares of the wished speed straight on: so fine that slower comes before sideways."""
SHARES = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Of the wished speed, to the side."""
TURNS_DEG = (10.0, -10.0, 20.0, -20.0, 35.0, -35.0, 50.0, -50.0, 60.0, -60.0)
"""Aside, left positive."""
GAINS = 0.1
"""Share of the wished speed by which a velocity is nearer to the wish than standing still: for less
no vehicle is led to the side."""
LEAVES = 0.5
"""Share of the wished speed from which a hold is left: a vehicle that stands does not creep."""


def velocities_near(wished_mps: FloatArray, *, stands: bool) -> FloatArray:
    """[n, 3] velocities clearly nearer to a wished one than standing still, the nearest first.

    stands: whether the vehicle holds a place.
    """
    least = LEAVES if stands else 0.0
    east, north, up = wished_mps.tolist()
    found = []
    for share, turn in (*product(STRAIGHT, (0.0,)), *product(SHARES, TURNS_DEG)):
        if share < least:
            continue
        cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        level = (share * (cos * east - sin * north), share * (sin * east + cos * north))
        found += [(*level, share * up), *([(*level, 0.0)] if up else [])]
    tried = np.array(found)
    off = np.linalg.norm(tried - wished_mps, axis=1)
    nearer = (off <= (1.0 - GAINS) * np.linalg.norm(wished_mps)) & (off > 0.0)
    order: FloatArray = tried[nearer][np.argsort(off[nearer], kind="stable")]
    return order
