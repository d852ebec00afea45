"""Worlds of filled cells as boxes, and the ground under them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.obstacles.obstacle import Obstacle

GROUND_M = 2.0
"""Thickness of the ground."""
BEYOND_M = 30.0
"""How far the ground reaches past what stands on it."""


def ground_under(low_m: Sequence[float], high_m: Sequence[float]) -> Obstacle:
    """Return level ground at height 0 under an area, from its lowest [2] to its highest corner."""
    low, high = np.asarray(low_m) - BEYOND_M, np.asarray(high_m) + BEYOND_M
    x, y = 0.5 * (low + high)
    length, width = high - low
    return Obstacle.cuboid((x, y, -0.5 * GROUND_M), (length, width, GROUND_M), name="ground")


def boxes_of(filled: BoolArray, corner_m: Sequence[float], cell_m: float) -> list[Obstacle]:
    """Return boxes that fill exactly the filled cells [x, y, z] of a grid.

    Cells are taken together along z, then y, then x, so that a world has hundreds of boxes and not
    thousands. corner_m: [3] the grid's lowest corner.
    """
    left = filled.copy()
    boxes: list[Obstacle] = []
    origin = np.asarray(corner_m, dtype=np.float64)
    for x, y, z in np.argwhere(filled).tolist():
        if not left[x, y, z]:
            continue
        low = np.array([x, y, z])
        high = _grow(left, low)
        left[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = False
        boxes.append(_box(origin + cell_m * low, origin + cell_m * high, f"box {len(boxes)}"))
    return boxes


def _grow(left: BoolArray, low: np.ndarray) -> np.ndarray:
    """Return the end [3] of the box that grows from a cell along z, y and x while all is filled."""
    high = low + 1
    for axis in (2, 1, 0):
        while high[axis] < left.shape[axis]:
            face = [slice(a, b) for a, b in zip(low, high, strict=True)]
            face[axis] = slice(int(high[axis]), int(high[axis]) + 1)
            if not left[tuple(face)].all():
                break
            high[axis] += 1
    return high


def _box(low_m: FloatArray, high_m: FloatArray, name: str) -> Obstacle:
    length, width, height = (high_m - low_m).tolist()
    return Obstacle.cuboid(0.5 * (low_m + high_m), (length, width, height), name=name)
