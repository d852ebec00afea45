"""Marking the coarse cells of a `RouteMap`: the compiled loops over them."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import BoolArray, IntArray
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.sensors.seen_space import WORD, Voxels, is_marked


@compiled
def mostly_seen(
    free: Voxels, free_low: IntArray, low: IntArray, per_cell: int, shape: tuple[int, int, int]
) -> BoolArray:
    """[nx, ny, nz] whether most of a cell was seen to be free, by the middles of its eighths."""
    nx, ny, nz = shape
    quarter = per_cell // 4
    mostly = np.zeros((nx, ny, nz), dtype=np.bool_)
    columns, rows = free.shape[0], WORD * free.shape[2]
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
                    count += is_marked(free, u, v, w)
                mostly[a, b, c] = count >= 4
    return mostly


@borrowing
def mark_balls(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
) -> None:
    """Lower the distance of cells' centres to what balls leave."""
    nx, ny, nz = nearest.shape
    low_x, low_y, low_z = low[0], low[1], low[2]
    for n in range(len(radius)):
        x, y, z, r = position[n, 0], position[n, 1], position[n, 2], radius[n]
        first_a, last_a = _cells_within(x, low_x, width, reach + r, nx)
        first_b, last_b = _cells_within(y, low_y, width, reach + r, ny)
        first_c, last_c = _cells_within(z, low_z, width, reach + r, nz)
        for a in range(first_a, last_a + 1):
            dx = low_x + (a + 0.5) * width - x
            for b in range(first_b, last_b + 1):
                dy = low_y + (b + 0.5) * width - y
                for c in range(first_c, last_c + 1):
                    dz = low_z + (c + 0.5) * width - z
                    away = np.sqrt(dx * dx + dy * dy + dz * dz) - r
                    nearest[a, b, c] = min(nearest[a, b, c], away)


@borrowing
def _cells_within(
    middle: float, low: float, width: float, far: float, count: int
) -> tuple[int, int]:
    """First and last cell along an axis whose centre is no farther than that."""
    at = (middle - low) / width - 0.5
    first = max(0, int(np.ceil(at - far / width)))
    return first, min(count - 1, int(np.floor(at + far / width)))


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
