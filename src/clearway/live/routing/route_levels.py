"""Levels of cells about the vehicle: each is twice as coarse as the one in its middle."""

from __future__ import annotations

from typing import NamedTuple

from clearway.base.arrays import Ints2
from clearway.base.compiled import compiled


class Levels(NamedTuple):
    """Where cells are."""

    depth: int
    n: int
    """Cells along a side of each level."""
    layers: int
    low: Ints2
    """[depth, 2] number of the lowest cell of each level, even."""
    inner: Ints2
    """[depth, 2] the first cell of each level that the one before covers, from its lowest on."""
    width_m: float
    lowest_m: float
    layer_m: float


@compiled
def middle_of(levels: Levels, level: int, i: int, j: int, k: int) -> tuple[float, float, float]:
    width = levels.width_m * (1 << level)
    return (
        (levels.low[level, 0] + i + 0.5) * width,
        (levels.low[level, 1] + j + 0.5) * width,
        levels.lowest_m + k * levels.layer_m,
    )


@compiled
def is_covered(levels: Levels, level: int, i: int, j: int) -> bool:
    """Whether the finer level holds a cell."""
    if level == 0:
        return False
    u, v, half = levels.inner[level, 0], levels.inner[level, 1], levels.n // 2
    return bool(u <= i < u + half and v <= j < v + half)


@compiled
def is_amid(levels: Levels, level: int, i: int, j: int) -> bool:
    """Whether all cells beside one are of its own level."""
    n = levels.n
    if i < 1 or j < 1 or i >= n - 1 or j >= n - 1:
        return False
    if level == 0:
        return True
    u, v, half = levels.inner[level, 0], levels.inner[level, 1], n // 2
    return bool(i < u - 1 or j < v - 1 or i > u + half or j > v + half)
