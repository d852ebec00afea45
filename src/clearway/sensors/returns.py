"""Raw returns into cells, in blocks: plain arithmetic that the compiler can vectorise, then counts.

Nothing but the last loop branches on data, and that one only for what is rare: a return that is
dropped, or one so close to a border of a cell that the exact rule must decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.brief import brief
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

ROUNDING = 1e-9
"""Share by which what is culled lies farther away than it must."""

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

    def __repr__(self) -> str:
        return brief(self)


class Binned(NamedTuple):
    """Outcome of the fused pass over one scan."""

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

    a: FloatArray
    """Sensor frame."""
    b: FloatArray
    c: FloatArray
    x: FloatArray
    """Grid frame."""
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
    source: StepArray
    """Where those that are kept of a block were in it."""


@borrowing
def _cull(points: FloatArray, culled: float, block: Block) -> int:
    """Take in the returns of a block, of those not all within a squared range only these; how many
    there are."""
    a, b, c, squared = block.a, block.b, block.c, block.squared_range
    count = len(points)
    # One output per loop, or the compiler gives up proving that they do not overlap.
    for n in range(count):
        a[n] = points[n, 0]
    for n in range(count):
        b[n] = points[n, 1]
    for n in range(count):
        c[n] = points[n, 2]
    for n in range(count):
        squared[n] = a[n] ** 2 + b[n] ** 2 + c[n] ** 2
    m = 0
    for n in range(count):
        m += squared[n] <= culled
    return m


@borrowing
def _gather_near(count: int, culled: float, block: Block) -> None:
    """Move those of a block within a squared range to the front."""
    a, b, c, squared, source = block.a, block.b, block.c, block.squared_range, block.source
    m = 0
    for n in range(count):
        source[m] = n  # Written always and passed over if far: no branch.
        m += squared[n] <= culled
    for n in range(m):
        k = np.uint32(source[n])
        a[n], b[n], c[n], squared[n] = a[k], b[k], c[k], squared[k]


@borrowing
def _count_far(count: int, filters: Filters, culled: float, block: Block) -> tuple[int, int, int]:
    """Of those of a block beyond a squared range: how many are not finite, beyond the sensor's
    range, ground."""
    squared, high = block.squared_range, filters.max_range**2
    nonfinite, beyond, ground = 0, 0, 0
    for n in range(count):
        nonfinite += not squared[n] < np.inf
    for n in range(count):
        beyond += (squared[n] > max(high, culled)) & (squared[n] < np.inf)
    if filters.ground == -np.inf:
        return nonfinite, beyond, 0
    _place(count, filters, block)
    x, y, z, up = block.x, block.y, block.z, filters.up
    up_x, up_y, up_z = up[0], up[1], up[2]
    for n in range(count):
        low = up_x * x[n] + up_y * y[n] + up_z * z[n] <= filters.ground
        ground += low & (squared[n] > culled) & (squared[n] <= high)
    return nonfinite, beyond, ground


@borrowing
def _place(count: int, filters: Filters, block: Block) -> None:
    """Grid frame and squared distances of a block."""
    r, o = filters.rotation, filters.origin
    a, b, c, x, y, z = block.a, block.b, block.c, block.x, block.y, block.z
    squared_range, squared_distance = block.squared_range, block.squared_distance
    r00, r01, r02, ox = r[0, 0], r[0, 1], r[0, 2], o[0]
    r10, r11, r12, oy = r[1, 0], r[1, 1], r[1, 2], o[1]
    r20, r21, r22, oz = r[2, 0], r[2, 1], r[2, 2], o[2]
    # What is not finite goes to the origin: it is dropped, but its steps must lie in the tables.
    for n in range(count):
        placed = r00 * a[n] + r01 * b[n] + r02 * c[n] + ox
        x[n] = placed if squared_range[n] < np.inf else 0.0
    for n in range(count):
        placed = r10 * a[n] + r11 * b[n] + r12 * c[n] + oy
        y[n] = placed if squared_range[n] < np.inf else 0.0
    for n in range(count):
        placed = r20 * a[n] + r21 * b[n] + r22 * c[n] + oz
        z[n] = placed if squared_range[n] < np.inf else 0.0
    for n in range(count):
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
def _cull_beside(count: int, cone: FloatArray, block: Block) -> tuple[int, int, int]:
    """Gather those of a block in the cone of `CellTables`, and those too near; how many, and how
    many of the others are ground, and beyond the range."""
    right_x, right_y, left_x, left_y, low, high = (
        cone[0],
        cone[1],
        cone[2],
        cone[3],
        cone[4],
        cone[5],
    )
    x, y, z, squared, reason = block.x, block.y, block.z, block.squared_distance, block.reason
    inside, source = block.cell, block.source
    for n in range(count):
        steep = z[n] * abs(z[n])
        inside[n] = (
            (
                (right_x * x[n] + right_y * y[n] >= 0.0)
                & (left_x * x[n] + left_y * y[n] >= 0.0)
                & (steep >= low * squared[n])
                & (steep <= high * squared[n])
            )
            | (reason[n] == BLIND)
            | (reason[n] == AIRFRAME)
        )
    m, ground, beyond = 0, 0, 0
    for n in range(count):
        ground += (inside[n] == 0) & (reason[n] == GROUND)
    for n in range(count):
        beyond += (inside[n] == 0) & (reason[n] == BEYOND)
    for n in range(count):
        source[m] = n
        m += inside[n]
    for n in range(m):
        k = np.uint32(source[n])
        x[n], y[n], z[n], squared[n], reason[n] = x[k], y[k], z[k], squared[k], reason[k]
    return m, ground, beyond


@borrowing
def _steps(count: int, steps_per_m: float, block: Block) -> None:
    """Steps of a block in the three tables; the arithmetic of `binning.quick_column`."""
    x, y, z, squared_distance = block.x, block.y, block.z, block.squared_distance
    layer, column, row = block.layer, block.column, block.row
    last = STEPS - 1.0
    distance = block.squared_range  # which has had its use
    for n in range(count):
        distance[n] = np.sqrt(squared_distance[n])
    for n in range(count):
        layer[n] = np.int32(min(distance[n] * steps_per_m, last))
    for n in range(count):
        forward = y[n] / (abs(x[n]) + abs(y[n]) + TINY)
        turned = forward if x[n] >= 0.0 else np.copysign(2.0, y[n]) - forward
        column[n] = np.int32(min((turned + 2.0) * (STEPS / 4.0), last))
    for n in range(count):
        sine = z[n] / (distance[n] + TINY)
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
    """Cull, transform, drop for a reason, bin: one pass over the returns [n, 3] of the sensor
    frame."""
    edges = tables.edges
    columns = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    cells = columns * (len(edges.range_m) - 1)
    # One cell more than there are: what lies outside is counted there, without a branch.
    hits, ground = np.zeros(cells + 1, dtype=np.int64), np.zeros(cells + 1, dtype=np.int64)
    squared_ranges, blocked = np.zeros(cells + 1), np.zeros(columns + 1, dtype=np.int64)
    counts = np.zeros(len(REASONS), dtype=np.int64)
    block, culled = _new_block(), _culled_m(filters, edges.range_m[-1]) ** 2
    for start in range(0, len(points), BLOCK):
        part = points[start : start + BLOCK]
        near = _cull(part, culled, block)
        if near < len(part):
            nonfinite, beyond, low = _count_far(len(part), filters, culled, block)
            counts[NONFINITE] += nonfinite
            counts[BEYOND] += beyond
            counts[GROUND] += low
            _gather_near(len(part), culled, block)
        _place(near, filters, block)
        _sort_out(near, filters, block)
        near, low, beyond = _cull_beside(near, tables.cone, block)
        counts[GROUND] += low
        counts[BEYOND] += beyond
        _steps(near, tables.steps_per_m, block)
        if _cells(near, tables, block) > 0:
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


@borrowing
def _culled_m(filters: Filters, range_m: float) -> float:
    """Range from the sensor beyond which nothing is in the grid, blind or the own airframe."""
    o, e = filters.origin, filters.body
    from_grid = np.sqrt(o[0] ** 2 + o[1] ** 2 + o[2] ** 2)
    from_body = np.sqrt((o[0] - e[0]) ** 2 + (o[1] - e[1]) ** 2 + (o[2] - e[2]) ** 2)
    farthest = max(range_m + from_grid, filters.airframe_radius + from_body, filters.min_range)
    return float(farthest * (1.0 + ROUNDING))


@compiled
def kept_returns(points: FloatArray, filters: Filters) -> tuple[FloatArray, FloatArray]:
    """[kept, 3] grid frame and [kept] half the beam spacing there, of the returns that
    `bin_returns` keeps, also those outside the grid."""
    kept, radius = np.empty((len(points), 3)), np.empty(len(points))
    block, m = _new_block(), 0
    for start in range(0, len(points), BLOCK):
        part = points[start : start + BLOCK]
        _cull(part, np.inf, block)
        _place(len(part), filters, block)
        _sort_out(len(part), filters, block)
        m += _keep(len(part), filters.half_spacing, block, kept[m:], radius[m:])
    return kept[:m], radius[:m]


@compiled
def _new_block() -> Block:
    return Block(
        np.empty(BLOCK),
        np.empty(BLOCK),
        np.empty(BLOCK),
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
