"""What a march leaves open: cells that it did not look at, and those too near to something."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.live.routing.field.route_levels import is_covered, middle_of
from clearway.live.routing.field.wave import March

LEANING = 2
"""The finest so many levels, which places are asked of one after another."""


@compiled
def fill_in_rest(m: March, vehicle: Floats, bound: float) -> None:
    """Give cells that were not looked at a time that leads back to the vehicle, and coarse
    ones that finer ones cover the mean of these."""
    levels = m.levels
    n, layers = levels.n, levels.layers
    for level in range(levels.depth):
        for i in range(n):
            for j in range(n):
                cell = ((level * n + i) * n + j) * layers
                if is_covered(levels, level, i, j):
                    p = 2 * (levels.low[level, 0] + i) - levels.low[level - 1, 0]
                    q = 2 * (levels.low[level, 1] + j) - levels.low[level - 1, 1]
                    one = (((level - 1) * n + p) * n + q) * layers
                    for k in range(layers):
                        total, count = 0.0, 0
                        for a in (one, one + layers, one + n * layers, one + (n + 1) * layers):
                            if m.time_s[a + k] < np.inf:
                                total += m.time_s[a + k]
                                count += 1
                        if count > 0:
                            m.time_s[cell + k] = total / count
                elif bound < np.inf:
                    for k in range(layers):
                        if m.time_s[cell + k] == np.inf and m.speed_mps[cell + k] > 0.0:
                            at = middle_of(levels, level, i, j, k)
                            away = np.hypot(at[0] - vehicle[0], at[1] - vehicle[1])
                            m.time_s[cell + k] = bound + away / m.pace.fastest_mps


@compiled
def lean_away(m: March, slow_mps: float) -> None:
    """Give cells beside those that have a way the latest time of these and the escape: between the
    middles of cells, times then lead away from what stands."""
    levels = m.levels
    n, layers = levels.n, levels.layers
    row = n * layers
    for level in range(min(levels.depth, LEANING)):
        out_s = levels.width_m * (1 << level) / slow_mps
        for i in range(1, n - 1):
            for j in range(1, n - 1):
                for k in range(layers):
                    cell = ((level * n + i) * n + j) * layers + k
                    if m.speed_mps[cell] > 0.0 or m.time_s[cell] < np.inf:
                        continue
                    latest = -1.0
                    for there in (cell - row, cell + row, cell - layers, cell + layers):
                        if m.speed_mps[there] > 0.0 and m.time_s[there] < np.inf:
                            latest = max(latest, m.time_s[there])
                    if latest < 0.0:
                        for there in (
                            cell - row - layers,
                            cell - row + layers,
                            cell + row - layers,
                            cell + row + layers,
                        ):
                            if m.speed_mps[there] > 0.0 and m.time_s[there] < np.inf:
                                latest = max(latest, m.time_s[there])
                    if latest >= 0.0:
                        m.time_s[cell] = latest + out_s
