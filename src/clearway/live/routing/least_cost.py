"""What a way over cells costs at least, by which the search for the cheapest is led."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats3
from clearway.base.compiled import compiled
from clearway.live.routing.route_map import UNOBSERVED_COST


class Cheapness(NamedTuple):
    """What bounds the price of any way to the goal from below."""

    low: tuple[float, float, float]
    """Corner of the box that holds all cells that cost less than what nobody has seen."""
    high: tuple[float, float, float]
    least: float
    """Price of the cheapest of them."""
    beyond: float
    """Cells from that box to the goal."""
    short: float
    """Cells before the goal at which a way may end."""


@compiled
def cheapness(price: Floats3, ga: int, gb: int, gc: int, short: float) -> Cheapness:
    """The bound for ways to a goal cell, by the prices [nx, ny, nz] of a metre in each cell."""
    nx, ny, nz = price.shape
    least = UNOBSERVED_COST
    low_a, low_b, low_c, high_a, high_b, high_c = nx, ny, nz, -1, -1, -1
    for a in range(nx):
        for b in range(ny):
            for c in range(nz):
                if price[a, b, c] < UNOBSERVED_COST:
                    least = min(least, price[a, b, c])
                    low_a, high_a = min(low_a, a), max(high_a, a)
                    low_b, high_b = min(low_b, b), max(high_b, b)
                    low_c, high_c = min(low_c, c), max(high_c, c)
    low, high = (low_a - 0.5, low_b - 0.5, low_c - 0.5), (high_a + 0.5, high_b + 0.5, high_c + 0.5)
    beyond = _apart(low, high, float(ga), float(gb), float(gc)) if high_a >= 0 else 0.0
    return Cheapness(low, high, least, max(beyond - short, 0.0), short)


@compiled
def bound_cost(bound: Cheapness, a: int, b: int, c: int, ga: int, gb: int, gc: int) -> float:
    """Price below which no way leads from a cell to the goal: whatever lies outside the box costs
    as much as what nobody has seen, and the rest as much as the cheapest in it.

    It changes from cell to cell by no more than the step costs.
    """
    away = np.sqrt(float((a - ga) ** 2 + (b - gb) ** 2 + (c - gc) ** 2)) - bound.short
    outside = _apart(bound.low, bound.high, float(a), float(b), float(c)) + bound.beyond
    if away <= outside:
        return float(UNOBSERVED_COST * max(away, 0.0))
    return float(UNOBSERVED_COST * outside + bound.least * (away - outside))


@compiled
def _apart(
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    a: float,
    b: float,
    c: float,
) -> float:
    """From a box to a point; 0 inside."""
    da = max(low[0] - a, a - high[0], 0.0)
    db = max(low[1] - b, b - high[1], 0.0)
    dc = max(low[2] - c, c - high[2], 0.0)
    return float(np.sqrt(da * da + db * db + dc * dc))
