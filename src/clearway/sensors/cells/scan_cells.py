"""From the returns of a scan to what it says of every cell, in one compiled call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import CellTables
from clearway.sensors.cells.return_block import Filters
from clearway.sensors.cells.returns import bin_returns
from clearway.sensors.cells.visibility import visible_behind


class PlacedScan(NamedTuple):
    """The returns of a scan, and all that sorts them into the cells of a grid."""

    points_m: Floats2
    """[n, 3] sensor frame."""
    filters: Filters
    tables: CellTables
    beams: Ints
    """[columns * rows] |L| of (5.39)."""
    layers_in_range: int

    def __repr__(self) -> str:
        return brief(self)


class DetectedCells(NamedTuple):
    """What a scan says of every cell."""

    hits: Ints
    """[cells] |H| of (5.40)."""
    squared_ranges_m2: Floats
    """[cells] sum over the hits."""
    counts: Ints
    """[REASONS]"""
    share: Floats
    """[cells] P_OL (5.41)."""
    hindrance: Floats
    """[cells] as of `Detection`."""
    visibility: Floats
    """[cells] P_V (5.47)."""

    def __repr__(self) -> str:
        return brief(self)


@compiled
def detect_cells(scan: PlacedScan) -> DetectedCells:
    """From the returns of a scan to what it says of the cells."""
    beams = scan.beams
    found = bin_returns(scan.points_m, scan.filters, scan.tables)  # (5.40)
    hindrance, visibility = hindrance_of(
        found.hindering, found.blocked, beams, scan.layers_in_range
    )  # (5.42), (5.47)
    return DetectedCells(
        found.hits,
        found.squared_ranges_m2,
        found.counts,
        compute_hit_share(found.hits, beams),  # (5.41)
        hindrance,
        visibility,
    )


@compiled
def compute_hit_share(hits: Ints, beams: Ints) -> Floats:
    """[cells] hits of the column's beams that ended in the cell, within [0, 1]."""
    columns = len(beams)
    share = np.zeros(len(hits))
    for cell in range(len(hits)):
        count = beams[cell % columns]
        if count > 0 and hits[cell] > 0:
            share[cell] = min(1.0, hits[cell] / count)
    return share


@compiled
def hindrance_of(
    hindering: Ints, blocked: Ints, beams: Ints, layers_in_range: int
) -> tuple[Floats, Floats]:
    """Hindrance and visibility [cells]; beams that the own airframe stops see no cell at all."""
    hindrance = compute_hit_share(hindering, beams)
    start = np.zeros(len(beams))
    for column in range(len(beams)):
        if beams[column] > 0:
            start[column] = max(0.0, 1.0 - blocked[column] / beams[column])
    return hindrance, visible_behind(hindrance, start, layers_in_range)
