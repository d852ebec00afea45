"""Raw returns into cells: block by block, what becomes of each, and what it counts for.

Only what is rare is branched on, a return that is dropped, or where neighbours mostly are alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import OUTSIDE, CellTables, exact_column
from clearway.sensors.cells.return_block import (
    AIRFRAME,
    BEYOND,
    BLIND,
    BLOCK,
    DISTANCE2,
    GROUND,
    KEPT,
    NONFINITE,
    OUTSIDE_GRID,
    RANGE2,
    REASONS,
    Block,
    Filters,
    X,
    Y,
    Z,
    count_far,
    cull_beside,
    find_cells,
    find_steps,
    gather_near,
    new_block,
    place_block,
    sort_out,
    take_in,
)

ROUNDING = 1e-9
"""Share by which what is culled lies farther away than it must."""


class Binned(NamedTuple):
    """Outcome of the fused pass over one scan."""

    hits: Ints
    """[cells]"""
    squared_ranges_m2: Floats
    """[cells] sum over the hits."""
    hindering: Ints
    """[cells] beams that end here: hits and ground."""
    blocked: Ints
    """[columns * rows] beams that end at the own airframe or within the blind range."""
    counts: Ints
    """[REASONS]"""


@compiled
def bin_returns(points: Floats2, filters: Filters, tables: CellTables) -> Binned:
    """Cull, transform, drop for a reason, bin: one pass over the returns [n, 3] of the sensor
    frame."""
    edges = tables.edges
    columns = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    cells = columns * (len(edges.range_m) - 1)
    # One cell more than there are: what lies outside is counted there, without a branch.
    hits, ground = np.zeros(cells + 1, dtype=np.int64), np.zeros(cells + 1, dtype=np.int64)
    squared_ranges, blocked = np.zeros(cells + 1), np.zeros(columns + 1, dtype=np.int64)
    counts = np.zeros(len(REASONS), dtype=np.int64)
    block, culled = new_block(), _bound_range_m(filters, edges.range_m[-1]) ** 2
    flat = points.reshape(points.size)
    for start in range(0, len(points), BLOCK):
        part = flat[3 * start : 3 * (start + BLOCK)]
        count = len(part) // 3
        near = take_in(part, culled, block)
        if near < count:
            nonfinite, beyond, low = count_far(count, filters, culled, block)
            counts[NONFINITE] += nonfinite
            counts[BEYOND] += beyond
            counts[GROUND] += low
            gather_near(count, culled, block)
        place_block(near, filters, block)
        sort_out(near, filters, block)
        near, low, beyond = cull_beside(near, tables.cone, block)
        counts[GROUND] += low
        counts[BEYOND] += beyond
        find_steps(near, tables.steps_per_m, block)
        if find_cells(near, tables, block) > 0:
            _count_dropped(near, filters, tables, block, ground, blocked, counts)
        _count_hits(near, block, hits, squared_ranges)
    counts[KEPT] = len(points) - counts.sum()
    counts[OUTSIDE_GRID] = counts[KEPT] - hits[:cells].sum()
    return Binned(
        hits[:cells],
        squared_ranges[:cells],
        hits[:cells] + ground[:cells],
        blocked[:columns],
        counts,
    )


@compiled
def _bound_range_m(filters: Filters, range_m: float) -> float:
    """Range from the sensor beyond which nothing is in the grid, blind or the own airframe."""
    o, e = filters.origin, filters.body
    from_grid = np.sqrt(o[0] ** 2 + o[1] ** 2 + o[2] ** 2)
    from_body = np.sqrt((o[0] - e[0]) ** 2 + (o[1] - e[1]) ** 2 + (o[2] - e[2]) ** 2)
    farthest = max(range_m + from_grid, filters.airframe_radius + from_body, filters.min_range)
    return float(farthest * (1.0 + ROUNDING))


@compiled
def keep_returns(points: Floats2, filters: Filters) -> tuple[Floats2, Floats]:
    """[kept, 3] grid frame and [kept] half the beam spacing there, of the returns that
    `bin_returns` keeps, also those outside the grid."""
    kept, radius = np.empty((len(points), 3)), np.empty(len(points))
    block, m = new_block(), 0
    flat = points.reshape(points.size)
    for start in range(0, len(points), BLOCK):
        part = flat[3 * start : 3 * (start + BLOCK)]
        count = len(part) // 3
        take_in(part, np.inf, block)
        place_block(count, filters, block)
        sort_out(count, filters, block)
        m += _keep(count, filters.half_spacing, block, kept[m:], radius[m:])
    return kept[:m], radius[:m]


@compiled
def _count_dropped(
    count: int,
    filters: Filters,
    tables: CellTables,
    block: Block,
    ground: Ints,
    blocked: Ints,
    counts: Ints,
) -> None:
    """Count the dropped returns of a block: a beam that ended there sees nothing behind."""
    edges, o, of, reason = tables.edges, filters.origin, block.of, block.reason
    for n in range(count):
        if reason[n] == KEPT:
            continue
        counts[reason[n]] += 1
        if reason[n] == GROUND:
            ground[min(block.cell[n], len(ground) - 1)] += 1
        elif reason[n] == BLIND or reason[n] == AIRFRAME:
            x, y, z = of[X + n] - o[0], of[Y + n] - o[1], of[Z + n] - o[2]
            column = exact_column(x, y, z, edges.azimuth_rad, edges.elevation_rad)
            blocked[min(column, len(blocked) - 1)] += 1
        block.cell[n] = OUTSIDE


@compiled
def _count_hits(count: int, block: Block, hits: Ints, squared_ranges: Floats) -> None:
    """Count the returns of a block in their cells."""
    cell, of = block.cell, block.of
    last = len(hits) - 1
    # Neighbours in a scan mostly share their cell, and would wait for each other's sum.
    here = np.uint32(last)
    many, sum_m2 = hits[here], squared_ranges[here]
    for n in range(count):
        c = np.uint32(min(cell[n], last))
        if c != here:
            hits[here], squared_ranges[here] = many, sum_m2
            here, many, sum_m2 = c, hits[c], squared_ranges[c]
        many += 1
        sum_m2 += of[DISTANCE2 + n]
    hits[here], squared_ranges[here] = many, sum_m2


@compiled
def _keep(count: int, half_spacing: float, block: Block, kept: Floats2, radius: Floats) -> int:
    """Append the kept returns of a block, and how far each stands for its surroundings."""
    of, reason = block.of, block.reason
    m = 0
    for n in range(count):
        # Written always and passed over if dropped: no branch.
        kept[m, 0], kept[m, 1], kept[m, 2] = of[X + n], of[Y + n], of[Z + n]
        radius[m] = of[RANGE2 + n]
        m += reason[n] == KEPT
    for n in range(m):
        radius[n] = half_spacing * np.sqrt(radius[n])
    return m
