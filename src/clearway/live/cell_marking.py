"""Marking the coarse cells of a `RouteMap`: the compiled loops over them."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import BoolArray, IntArray
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.sensors.free_space import Voxels

SHAPE = (64, 64, 16)
"""Cells along each axis, the vehicle about their middle."""


@compiled
def mostly_seen(free: Voxels, free_low: IntArray, low: IntArray, per_cell: int) -> BoolArray:
    """[nx, ny, nz] whether most of a cell was seen to be free, by the middles of its eighths."""
    nx, ny, nz = SHAPE
    quarter = per_cell // 4
    mostly = np.zeros((nx, ny, nz), dtype=np.bool_)
    columns, rows = free.shape[0], free.shape[2]
    for a in range(nx):
        u0 = (low[0] + a) * per_cell
        if u0 < free_low[0] or u0 + per_cell > free_low[0] + columns:
            continue
        for b in range(ny):
            v0 = (low[1] + b) * per_cell
            if v0 < free_low[1] or v0 + per_cell > free_low[1] + columns:
                continue
            for c in range(nz):
                w0 = (low[2] + c) * per_cell
                if w0 < free_low[2] or w0 + per_cell > free_low[2] + rows:
                    continue
                count = 0
                for eighth in range(8):
                    u = u0 + quarter * (1 + 2 * (eighth & 1))
                    v = v0 + quarter * (1 + (eighth & 2))
                    w = w0 + quarter * (1 + (eighth & 4) // 2)
                    count += free[u & (columns - 1), v & (columns - 1), w & (rows - 1)]
                mostly[a, b, c] = count >= 4
    return mostly


@compiled
def mark_balls(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
) -> None:
    """Lower the distance of cells' centres to what balls leave."""
    shape = nearest.shape
    for n in range(len(radius)):
        far = reach + radius[n]
        first, last = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
        for axis in range(3):
            at = (position[n, axis] - low[axis]) / width - 0.5
            first[axis] = max(0, int(np.ceil(at - far / width)))
            last[axis] = min(shape[axis] - 1, int(np.floor(at + far / width)))
        for a in range(first[0], last[0] + 1):
            dx = low[0] + (a + 0.5) * width - position[n, 0]
            for b in range(first[1], last[1] + 1):
                dy = low[1] + (b + 0.5) * width - position[n, 1]
                for c in range(first[2], last[2] + 1):
                    dz = low[2] + (c + 0.5) * width - position[n, 2]
                    away = np.sqrt(dx * dx + dy * dy + dz * dz) - radius[n]
                    nearest[a, b, c] = min(nearest[a, b, c], away)


@borrowing
def add_ball(
    values: FloatArray, at: IntArray, reach: float, lowest: int, highest: int, added: float
) -> None:
    """Add to the cells about one, as far as some cells away, from a lowest layer to a highest one;
    and twice as far above and below them."""
    far = int(np.ceil(reach))
    for a in range(max(0, at[0] - far), min(values.shape[0], at[0] + far + 1)):
        for b in range(max(0, at[1] - far), min(values.shape[1], at[1] + far + 1)):
            for c in range(values.shape[2]):
                dx, dy = a - at[0], b - at[1]
                dz = 0.5 * max(0, lowest - c, c - highest)
                if dx * dx + dy * dy + dz * dz <= reach * reach:
                    values[a, b, c] += added
