"""Heights of the ground on an even grid of places, and a floor of blocks.

The ground between samples is what lies between them, so a block holds the highest sample within
it and around it: the floor is never below the terrain.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.maps.coordinates import Projection

MOST_BLOCKS = 4_000
FINEST_RELIEF_M = 1.0
"""Blocks in which the ground varies by less are not halved."""


class TerrainBlock(NamedTuple):
    """Samples under one top."""

    rows: tuple[int, int]
    columns: tuple[int, int]
    """First sample and the one after the last."""
    top_m: float
    relief_m: float
    """From the lowest to the highest of its samples."""


@dataclass(frozen=True, slots=True, eq=False)
class Terrain:
    """Heights of the ground above the raster's vertical datum, on an even grid of places."""

    height_m: FloatArray
    """[rows, columns], NaN where the raster has no data."""
    x: FloatArray
    """[columns] of the samples, in the raster's reference system, ascending."""
    y: FloatArray
    """[rows] likewise, ascending."""
    place: Projection
    from_geographic: Any
    """pyproj's transformer from longitude, latitude to x, y."""
    name: str

    def span_m(self, places: FloatArray) -> tuple[float, float] | None:
        """Lowest and highest ground in the box around places [n, 2] latitude, longitude.

        None where the raster does not hold the whole box.
        """
        x, y = self.from_geographic.transform(places[:, 1], places[:, 0])
        columns, rows = _around(self.x, x), _around(self.y, y)
        if columns is None or rows is None:
            return None
        part = self.height_m[rows[0] : rows[1], columns[0] : columns[1]]
        if np.isnan(part).any():
            return None
        return float(part.min()), float(part.max())

    def extent(self) -> FloatArray:
        """[4, 2] latitude, longitude of the whole raster's corners."""
        return self.corners(TerrainBlock((0, len(self.y)), (0, len(self.x)), 0.0, 0.0))

    def corners(self, block: TerrainBlock) -> FloatArray:
        """[4, 2] latitude, longitude of a block, half a sample wider than its samples."""
        (row, last_row), (column, last_column) = block.rows, block.columns
        half_x, half_y = 0.5 * (self.x[1] - self.x[0]), 0.5 * (self.y[1] - self.y[0])
        west, east = self.x[column] - half_x, self.x[last_column - 1] + half_x
        south, north = self.y[row] - half_y, self.y[last_row - 1] + half_y
        corners = np.array([[west, south], [east, south], [east, north], [west, north]])
        return self.place.latitude_longitude(corners)

    def floor(self, box: FloatArray | None) -> tuple[list[TerrainBlock], float]:
        """Blocks that hold the ground, and their mean lift above it in metres.

        box: places [n, 2] latitude, longitude around which a floor is wanted; None wants it all.
        """
        rows, columns = (0, len(self.y)), (0, len(self.x))
        if box is not None:
            x, y = self.from_geographic.transform(box[:, 1], box[:, 0])
            rows, columns = _inside(self.y, y), _inside(self.x, x)
        if rows[0] >= rows[1] or columns[0] >= columns[1]:
            return [], 0.0
        highest = _highest_around(self.height_m)
        blocks = _halve(self.height_m, highest, rows, columns)
        return blocks, _lift(self.height_m, blocks)


def _around(samples: FloatArray, places: FloatArray) -> tuple[int, int] | None:
    """Samples on both sides of places; None if they do not lie between samples."""
    if not (samples[0] <= np.min(places) and np.max(places) <= samples[-1]):
        return None
    first = int(np.searchsorted(samples, np.min(places), side="right")) - 1
    last = int(np.searchsorted(samples, np.max(places), side="left"))
    return first, last + 1


def _inside(samples: FloatArray, places: FloatArray) -> tuple[int, int]:
    """Samples within the span of places, and one more on each side."""
    first = int(np.searchsorted(samples, np.min(places))) - 1
    last = int(np.searchsorted(samples, np.max(places))) + 1
    return max(first, 0), min(last, len(samples))


def _highest_around(heights: FloatArray) -> FloatArray:
    """Highest of each sample and its eight neighbours; NaN stays where a sample has none."""
    from scipy.ndimage import maximum_filter

    known = np.where(np.isnan(heights), -np.inf, heights)
    highest: FloatArray = np.where(
        np.isnan(heights), np.nan, maximum_filter(known, size=3, mode="nearest")
    )
    return highest


def _halve(
    heights: FloatArray, highest: FloatArray, rows: tuple[int, int], columns: tuple[int, int]
) -> list[TerrainBlock]:
    """Blocks of little relief: the one with most is halved along its longer side, again and again.

    It ends where the ground varies little in every block, or the blocks are many.
    """
    heap: list[tuple[float, TerrainBlock]] = []

    def add(rows: tuple[int, int], columns: tuple[int, int]) -> None:
        inside = np.s_[rows[0] : rows[1], columns[0] : columns[1]]
        known = heights[inside][~np.isnan(heights[inside])]
        if len(known):
            relief = float(known.max() - known.min())
            block = TerrainBlock(rows, columns, float(np.nanmax(highest[inside])), relief)
            heapq.heappush(heap, (-relief, block))

    add(rows, columns)
    while heap and -heap[0][0] > FINEST_RELIEF_M and len(heap) < MOST_BLOCKS:
        _, block = heapq.heappop(heap)
        (top, bottom), (left, right) = block.rows, block.columns
        if bottom - top >= right - left:
            middle = top + (bottom - top) // 2
            add((top, middle), block.columns)
            add((middle, bottom), block.columns)
        else:
            middle = left + (right - left) // 2
            add(block.rows, (left, middle))
            add(block.rows, (middle, right))
    return [block for _, block in heap]


def _lift(heights: FloatArray, blocks: list[TerrainBlock]) -> float:
    """Mean of how far block tops lie above their samples."""
    total, count = 0.0, 0
    for block in blocks:
        part = heights[slice(*block.rows), slice(*block.columns)]
        known = part[~np.isnan(part)]
        total += float(np.sum(block.top_m - known))
        count += len(known)
    return total / max(count, 1)
