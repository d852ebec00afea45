"""Raw returns into cells, in blocks: plain arithmetic that the compiler can vectorise, then counts.

Nothing but the last loop branches on data, and that one only for what is rare: a return that is
dropped, or one so close to a border of a cell that the exact rule must decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import cell_of_point
from clearway.base.state import IntArray
from clearway.sensors.binning import BORDER, OUTSIDE, STEPS, TINY, CellTables, exact_column

REASONS = ("kept", "outside", "nonfinite", "blind", "beyond", "airframe", "ground")
"""What becomes of a return; "outside" ones, out of the grid, are kept too."""
KEPT, OUTSIDE_GRID, NONFINITE, BLIND, BEYOND, AIRFRAME, GROUND = range(len(REASONS))

BLOCK = 512
"""Returns at a time: their intermediate values stay in the fastest cache."""

StepArray = npt.NDArray[np.int32]


class Filters(NamedTuple):
    """Pose of the sensor, and what makes a return none of an obstacle."""

    rotation: FloatArray
    """[3, 3] grid from sensor."""
    origin: FloatArray
    """[3] sensor in the grid frame."""
    body: FloatArray
    """[3] body's origin in the grid frame."""
    up: FloatArray
    """[3] normal of the ground in the grid frame."""
    ground: float
    """Returns with up . point at most this are ground."""
    min_range: float
    max_range: float
    airframe_radius: float
    half_spacing: float
    """Half the angle between beams, rad."""


class Binned(NamedTuple):
    """Outcome of the fused pass over one scan."""

    points_m: FloatArray
    """[kept, 3] grid frame."""
    radius_m: FloatArray
    """[kept] half the beam spacing there."""
    hits: IntArray
    """[cells]"""
    squared_ranges_m2: FloatArray
    """[cells] sum over the hits."""
    hindering: IntArray
    """[cells] beams that end here: hits and ground."""
    blocked: IntArray
    """[columns * rows] beams that end at the own airframe or within the blind range."""
    counts: IntArray
    """[REASONS]"""


class Block(NamedTuple):
    """Working memory for BLOCK returns."""

    x: FloatArray
    y: FloatArray
    z: FloatArray
    squared_range: FloatArray
    """From the sensor."""
    squared_distance: FloatArray
    """From the grid's origin."""
    layer: StepArray
    column: StepArray
    row: StepArray
    """Steps in the tables."""
    cell: StepArray
    """Flat cell, OUTSIDE or more where there is none or the return is dropped."""
    reason: StepArray


@borrowing
def _place(points: FloatArray, filters: Filters, block: Block) -> None:
    """Grid frame and squared distances of a block."""
    r, o = filters.rotation, filters.origin
    x, y, z = block.x, block.y, block.z
    squared_range, squared_distance = block.squared_range, block.squared_distance
    r00, r01, r02, ox = r[0, 0], r[0, 1], r[0, 2], o[0]
    r10, r11, r12, oy = r[1, 0], r[1, 1], r[1, 2], o[1]
    r20, r21, r22, oz = r[2, 0], r[2, 1], r[2, 2], o[2]
    # One output per loop, or the compiler gives up proving that they do not overlap.
    for n in range(len(points)):
        squared_range[n] = points[n, 0] ** 2 + points[n, 1] ** 2 + points[n, 2] ** 2
    # What is not finite goes to the origin: it is dropped, but its steps must lie in the tables.
    for n in range(len(points)):
        placed = r00 * points[n, 0] + r01 * points[n, 1] + r02 * points[n, 2] + ox
        x[n] = placed if squared_range[n] < np.inf else 0.0
    for n in range(len(points)):
        placed = r10 * points[n, 0] + r11 * points[n, 1] + r12 * points[n, 2] + oy
        y[n] = placed if squared_range[n] < np.inf else 0.0
    for n in range(len(points)):
        placed = r20 * points[n, 0] + r21 * points[n, 1] + r22 * points[n, 2] + oz
        z[n] = placed if squared_range[n] < np.inf else 0.0
    for n in range(len(points)):
        squared_distance[n] = x[n] ** 2 + y[n] ** 2 + z[n] ** 2


@borrowing
def _sort_out(count: int, filters: Filters, block: Block) -> None:
    """Why each return of a block is dropped, KEPT if it is not."""
    e, up, ground = filters.body, filters.up, filters.ground
    ex, ey, ez, up_x, up_y, up_z = e[0], e[1], e[2], up[0], up[1], up[2]
    low, high, own = filters.min_range**2, filters.max_range**2, filters.airframe_radius**2
    x, y, z, squared, reason = block.x, block.y, block.z, block.squared_range, block.reason
    for n in range(count):
        from_body = (x[n] - ex) ** 2 + (y[n] - ey) ** 2 + (z[n] - ez) ** 2
        height = up_x * x[n] + up_y * y[n] + up_z * z[n]
        code = GROUND if height <= ground else KEPT
        code = AIRFRAME if from_body < own else code
        code = BLIND if squared[n] < low else code
        code = BEYOND if squared[n] > high else code
        reason[n] = code if squared[n] < np.inf else NONFINITE


@borrowing
def _steps(count: int, steps_per_m: float, block: Block) -> None:
    """Steps of a block in the three tables; the arithmetic of `binning.quick_column`."""
    x, y, z, squared_distance = block.x, block.y, block.z, block.squared_distance
    layer, column, row = block.layer, block.column, block.row
    last = STEPS - 1.0
    for n in range(count):
        layer[n] = np.int32(min(np.sqrt(squared_distance[n]) * steps_per_m, last))
    for n in range(count):
        forward = y[n] / (abs(x[n]) + abs(y[n]) + TINY)
        turned = forward if x[n] >= 0.0 else np.copysign(2.0, y[n]) - forward
        column[n] = np.int32(min((turned + 2.0) * (STEPS / 4.0), last))
    for n in range(count):
        sine = z[n] / (np.sqrt(squared_distance[n]) + TINY)
        row[n] = np.int32(max(min((sine + 1.0) * (STEPS / 2.0), last), 0.0))


@borrowing
def _cells(count: int, tables: CellTables, block: Block) -> int:
    """Cells of a block; how many of its returns are dropped."""
    layers, columns, rows = tables.layer, tables.column, tables.row
    layer, column, row, cell = block.layer, block.column, block.row, block.cell
    reason = block.reason
    for n in range(count):
        cell[n] = (
            layers[np.uint32(layer[n])] + columns[np.uint32(column[n])] + rows[np.uint32(row[n])]
        )
    for n in range(count):
        if BORDER <= cell[n] < OUTSIDE:
            exact = cell_of_point(block.x[n], block.y[n], block.z[n], tables.edges)
            cell[n] = exact if exact >= 0 else OUTSIDE
    dropped = 0
    for n in range(count):
        dropped += reason[n] != KEPT
    return dropped


@compiled
def bin_returns(points: FloatArray, filters: Filters, tables: CellTables) -> Binned:
    """Transform, drop for a reason, bin: one pass over the returns [n, 3] of the sensor frame."""
    edges = tables.edges
    columns = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    cells = columns * (len(edges.range_m) - 1)
    # One cell more than there are: what lies outside is counted there, without a branch.
    hits, ground = np.zeros(cells + 1, dtype=np.int64), np.zeros(cells + 1, dtype=np.int64)
    squared_ranges, blocked = np.zeros(cells + 1), np.zeros(columns + 1, dtype=np.int64)
    kept, radius = np.empty((len(points), 3)), np.empty(len(points))
    counts = np.zeros(len(REASONS), dtype=np.int64)
    block = _new_block()
    m = 0
    for start in range(0, len(points), BLOCK):
        part = points[start : start + BLOCK]
        _place(part, filters, block)
        _sort_out(len(part), filters, block)
        _steps(len(part), tables.steps_per_m, block)
        if _cells(len(part), tables, block) > 0:
            _count_dropped(len(part), filters, tables, block, ground, blocked, counts)
        _count_hits(len(part), block, hits, squared_ranges)
        m += _keep(len(part), filters.half_spacing, block, kept[m:], radius[m:])
    counts[KEPT], counts[OUTSIDE_GRID] = m, m - hits[:cells].sum()
    return Binned(
        kept[:m],
        radius[:m],
        hits[:cells],
        squared_ranges[:cells],
        hits[:cells] + ground[:cells],
        blocked[:columns],
        counts,
    )


@compiled
def _new_block() -> Block:
    return Block(
        np.empty(BLOCK),
        np.empty(BLOCK),
        np.empty(BLOCK),
        np.empty(BLOCK),
        np.empty(BLOCK),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
    )


@borrowing
def _count_dropped(
    count: int,
    filters: Filters,
    tables: CellTables,
    block: Block,
    ground: IntArray,
    blocked: IntArray,
    counts: IntArray,
) -> None:
    """Count the dropped returns of a block: a beam that ended there sees nothing behind."""
    edges, o, reason = tables.edges, filters.origin, block.reason
    for n in range(count):
        if reason[n] == KEPT:
            continue
        counts[reason[n]] += 1
        if reason[n] == GROUND:
            ground[min(block.cell[n], len(ground) - 1)] += 1
        elif reason[n] == BLIND or reason[n] == AIRFRAME:
            x, y, z = block.x[n] - o[0], block.y[n] - o[1], block.z[n] - o[2]
            column = exact_column(x, y, z, edges.azimuth_rad, edges.elevation_rad)
            blocked[min(column, len(blocked) - 1)] += 1
        block.cell[n] = OUTSIDE


@borrowing
def _count_hits(count: int, block: Block, hits: IntArray, squared_ranges: FloatArray) -> None:
    """Count the returns of a block in their cells."""
    cell, squared = block.cell, block.squared_distance
    last = len(hits) - 1
    for n in range(count):
        c = np.uint32(min(cell[n], last))
        hits[c] += 1
        squared_ranges[c] += squared[n]


@borrowing
def _keep(
    count: int, half_spacing: float, block: Block, kept: FloatArray, radius: FloatArray
) -> int:
    """Append the kept returns of a block, and how far each stands for its surroundings."""
    x, y, z, squared, reason = block.x, block.y, block.z, block.squared_range, block.reason
    m = 0
    for n in range(count):
        # Written always and passed over if dropped: no branch.
        kept[m, 0], kept[m, 1], kept[m, 2] = x[n], y[n], z[n]
        radius[m] = squared[n]
        m += reason[n] == KEPT
    for n in range(m):
        radius[n] = half_spacing * np.sqrt(radius[n])
    return m
