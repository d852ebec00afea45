"""What of each cell is seen: hindrance by nearer cells (5.46)-(5.48), hit counts (5.45)."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Ints
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray


def visibility(grid: AvoidanceGrid, hindrance: FloatArray, beams: IntArray) -> FloatArray:
    """P_V [cells]: 1 minus the hindrance of the nearer cells in the row, (5.47), within (5.48).

    hindrance: [cells] P_OL of (5.41), as figs. 5.5 to 5.8 need it. beams: [columns * rows];
    a row without any beam is not seen at all: 0.
    """
    start = np.minimum(beams, 1).astype(np.float64)
    return visible_behind(np.ascontiguousarray(hindrance, dtype=np.float64), start, grid.layers)


@compiled
def visible_behind(hindrance: Floats, start: Floats, layers: int) -> Floats:
    """[cells] what of each row's `start` [columns * rows] is left behind its nearer cells.

    Cells of layers from `layers` on lie beyond the sensor's range and are not seen.
    """
    columns = len(start)
    seen = np.zeros(len(hindrance))
    for column in range(columns):
        left = start[column]
        for layer in range(layers):
            cell = layer * columns + column
            seen[cell] = min(max(left, 0.0), 1.0)
            left -= hindrance[cell]
    return seen


def swipe_area_m2(
    range_m: float, azimuth_rad: tuple[float, float], elevation_rad: tuple[float, float]
) -> float:
    """Area that a swipe between angles covers at a range, eqs. (5.43), (5.44) in one formula."""
    span = azimuth_rad[1] - azimuth_rad[0]
    return float(range_m**2 * (np.sin(elevation_rad[1]) - np.sin(elevation_rad[0])) * span)


def compute_expected_hits(
    points_per_swipe: float, object_area_m2: float, cell_area_m2: float, swipe_area_m2: float
) -> float:
    """Hits on an object in a cell, eq. (5.45): a count, for the swipe whose area is given.

    All areas at the same range; see `swipe_area_m2` and `AvoidanceGrid.patch_area_m2`.
    """
    return points_per_swipe * min(object_area_m2, cell_area_m2) / swipe_area_m2


@compiled
def surface_probability(
    hits: Ints,
    squared_ranges: Floats,
    beams: Ints,
    solid_angle: Floats,
    area: float,
) -> Floats:
    """[cells] min(1, hits / expected hits of a reference surface), so that 2.1.1 holds.

    With the beam density of the cell's own column, (5.45) expects |L| A_O / (r^2 solid angle)
    hits on a surface A_O at range r, at most |L|. squared_ranges: [cells] sum of r^2 of the
    hits; solid_angle: [columns * rows] sr; area: A_O in m^2.
    """
    columns = len(beams)
    probability = np.zeros(len(hits))
    for cell in range(len(hits)):
        column = cell % columns
        if hits[cell] > 0 and beams[column] > 0:
            scanned = squared_ranges[cell] * solid_angle[column] / area
            probability[cell] = min(1.0, max(scanned, float(hits[cell])) / beams[column])
    return probability
