"""How fast the way on from a cell is, by the clearance there: a compiled loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.live.routing.field.route_levels import Levels

FINE_LEVELS = 2
"""The finest so many levels keep the margin. In coarser cells that would close a forest whose trees
a way leads between: they bar walls alone."""
BARRED_M = -1e9
"""Clearance where rules forbid to fly."""


class SpeedRule(NamedTuple):
    """How fast the way on from a cell is, by the clearance there."""

    margin_m: float
    """Nothing leads nearer to anything."""
    wide_m: float
    """From that clearance on the vehicle is as fast as it can be."""
    slow_mps: float
    """Speed at the margin."""
    fast_mps: float
    porous_mps: float
    """Speed in cells too coarse to tell whether something can be passed."""
    exact_levels: int
    """The finest so many levels tell."""


@compiled
def speeds_of(levels: Levels, clearance_m: Floats, rule: SpeedRule) -> Floats:
    """Return the speed [cells] of the way on from cells by the clearance there."""
    n, layers = levels.n, levels.layers
    speed = np.empty(len(clearance_m))
    cell = 0
    for level in range(levels.depth):
        barred = find_barred_clearance(levels, level, rule.margin_m)
        per_metre = (rule.fast_mps - rule.slow_mps) / max(rule.wide_m - rule.margin_m, 1e-9)
        closed = 0.0 if level < rule.exact_levels else rule.porous_mps
        for _ in range(n * n * layers):
            clear = clearance_m[cell]
            if clear <= BARRED_M:
                speed[cell] = 0.0
            elif clear < barred:
                speed[cell] = closed
            elif clear >= rule.wide_m:
                speed[cell] = rule.fast_mps
            else:
                faster = rule.slow_mps + max(clear - rule.margin_m, 0.0) * per_metre
                speed[cell] = min(faster, rule.fast_mps)
            cell += 1
    return speed


@compiled
def find_barred_clearance(levels: Levels, level: int, margin_m: float) -> float:
    """Return the clearance in metres below which cells of a level are closed."""
    # No step from middle to middle leads through a wall of points a finest cell apart.
    barred = 0.5 * np.hypot(levels.width_m * (1 << level), levels.width_m)
    if level < FINE_LEVELS:
        barred = max(barred, margin_m)
    return float(barred)
