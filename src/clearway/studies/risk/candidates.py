"""Of several encounters drawn, the one that is flown: near ones rather, and all weigh alike.

A flight with its decisions takes as long as dozens of draws, so encounters are worth choosing. Each
candidate has the weight that even traffic gives it. It is taken with a chance in proportion to that
weight times how much its kind is wanted, and then weighs the mean of those products over its own
want: sums stay unbiased for any wants and any number of candidates, whether or not these share a
track, since a candidate taken at random would have them so. What comes as near as another then
weighs about as much, so that no single encounter decides a ratio.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.studies.risk.cylinder import Cylinder

PARTS = 5
"""Looked at between two moments, as straight flight is judged: what cuts a corner for an instant
counts, and must not weigh what those do that stay outside."""


class WantedKinds(NamedTuple):
    """How much encounters are wanted by the smallest cylinder that straight flight enters."""

    radius_m: FloatArray
    """[kinds] of cylinders about the ownship, the smallest first; what enters none comes last."""
    half_height_m: FloatArray
    want: FloatArray
    """[kinds + 1]"""


def find_wanted_kinds(
    outer: Cylinder, inner: tuple[Cylinder, ...], shares: tuple[float, ...]
) -> WantedKinds:
    """Wants that give each kind its share of what is flown, if traffic flies level and straight.

    inner: the smallest first. shares: [inner], of those that enter a cylinder and none before it;
    the rest is of those that enter none.
    """
    every = (*inner, outer)
    seen = np.array([one.radius_m * one.half_height_m for one in every])
    kind = np.diff(seen, prepend=0.0) / seen[-1]
    want = np.array([*shares, 1.0 - sum(shares)]) / kind
    return WantedKinds(
        np.array([one.radius_m for one in inner]),
        np.array([one.half_height_m for one in inner]),
        want,
    )


@compiled
def find_entered(entry: Floats, drift: Floats2, count: int, radius: Floats, half: Floats) -> int:
    """The first of the cylinders that a drift [n, 3] enters from a place [3] within its first
    `count` moments, straight between them; their number for none."""
    found = len(radius)
    for k in range(count):
        after = min(k + 1, count - 1)
        for part in range(PARTS):
            share = part / PARTS
            x = entry[0] + (1.0 - share) * drift[k, 0] + share * drift[after, 0]
            y = entry[1] + (1.0 - share) * drift[k, 1] + share * drift[after, 1]
            z = entry[2] + (1.0 - share) * drift[k, 2] + share * drift[after, 2]
            apart = np.sqrt(x * x + y * y)
            for kind in range(found):
                if apart < radius[kind] and abs(z) < half[kind]:
                    found = kind
                    break
        if found == 0:
            break
    return found


def take_candidate(
    weights: FloatArray, wants: FloatArray, rng: np.random.Generator
) -> tuple[int, float] | None:
    """Which of the candidates [n] is flown, and what it weighs; None where none has a weight."""
    products = weights * wants
    total = float(products.sum())
    if total <= 0.0:
        return None
    # The last sum is 1 but for rounding.
    place = np.searchsorted(np.cumsum(products) / total, rng.random(), side="right")
    chosen = int(min(place, np.flatnonzero(products)[-1]))
    return chosen, total / len(products) / float(wants[chosen])
