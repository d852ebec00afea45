"""Raw returns into cells, in blocks: plain arithmetic that the compiler can vectorise, then counts.

Only the last loops branch on data, and only for what is rare: a return that is dropped, or one so
close to a border of a cell that the tables do not decide; or where neighbours mostly are alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.brief import brief
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.sensors.binning import (
    BORDER,
    OUTSIDE,
    STEPS,
    TINY,
    CellTables,
    cell_at_border,
    exact_column,
)

REASONS = ("kept", "outside", "nonfinite", "blind", "beyond", "airframe", "ground")
"""What becomes of a return; "outside" ones, out of the grid, are kept too."""
KEPT, OUTSIDE_GRID, NONFINITE, BLIND, BEYOND, AIRFRAME, GROUND = range(len(REASONS))

BLOCK = 512
"""Returns at a time: their intermediate values stay in the fastest cache."""

GATHERED = 0.8
"""Share of a block up to which those that may be in the grid are gathered: it takes as long as a
fifth of what is done with each afterwards."""

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


A, B, C, X, Y, Z, RANGE2, DISTANCE2 = range(0, 8 * (BLOCK + 8), BLOCK + 8)
"""Where the columns of numbers of a block begin: sensor frame, grid frame, squared distances from
the sensor and from the grid's origin. Not a power of two apart, or they would share cache lines."""


class Block(NamedTuple):
    """Working memory for BLOCK returns."""

    of: FloatArray
    """Columns of numbers in one array, at places that the compiler knows: so it knows that they do
    not overlap, and one loop can fill in several."""
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
def _cull(flat: FloatArray, culled: float, block: Block) -> int:
    """Take in the returns of a block; how many are within a squared range.

    flat: [3 * returns] one after the other: only so does the compiler know how far apart they are.
    """
    of, count = block.of, len(flat) // 3
    for n in range(count):
        a, b, c = flat[3 * n], flat[3 * n + 1], flat[3 * n + 2]
        of[A + n], of[B + n], of[C + n] = a, b, c
        of[RANGE2 + n] = a**2 + b**2 + c**2
    m = 0
    for n in range(count):
        m += of[RANGE2 + n] <= culled
    return m


@borrowing
def _gather_near(count: int, culled: float, block: Block) -> None:
    """Move those of a block within a squared range to the front."""
    of, source = block.of, block.source
    m = 0
    for n in range(count):
        source[m] = n  # Written always and passed over if far: no branch.
        m += of[RANGE2 + n] <= culled
    for n in range(m):
        k = np.int64(source[n])
        of[A + n], of[B + n], of[C + n], of[RANGE2 + n] = (
            of[A + k],
            of[B + k],
            of[C + k],
            of[RANGE2 + k],
        )


@borrowing
def _count_far(count: int, filters: Filters, culled: float, block: Block) -> tuple[int, int, int]:
    """Of those of a block beyond a squared range: how many are not finite, beyond the sensor's
    range, ground."""
    of, high = block.of, filters.max_range**2
    nonfinite, beyond, ground = 0, 0, 0
    for n in range(count):
        nonfinite += not of[RANGE2 + n] < np.inf
    for n in range(count):
        beyond += (of[RANGE2 + n] > max(high, culled)) & (of[RANGE2 + n] < np.inf)
    if filters.ground == -np.inf:
        return nonfinite, beyond, 0
    _place(count, filters, block)
    up = filters.up
    up_x, up_y, up_z = up[0], up[1], up[2]
    for n in range(count):
        low = up_x * of[X + n] + up_y * of[Y + n] + up_z * of[Z + n] <= filters.ground
        ground += low & (of[RANGE2 + n] > culled) & (of[RANGE2 + n] <= high)
    return nonfinite, beyond, ground


@borrowing
def _place(count: int, filters: Filters, block: Block) -> None:
    """Grid frame and squared distances of a block."""
    r, o, of = filters.rotation, filters.origin, block.of
    r00, r01, r02, ox = r[0, 0], r[0, 1], r[0, 2], o[0]
    r10, r11, r12, oy = r[1, 0], r[1, 1], r[1, 2], o[1]
    r20, r21, r22, oz = r[2, 0], r[2, 1], r[2, 2], o[2]
    for n in range(count):
        a, b, c = of[A + n], of[B + n], of[C + n]
        x = r00 * a + r01 * b + r02 * c + ox
        y = r10 * a + r11 * b + r12 * c + oy
        z = r20 * a + r21 * b + r22 * c + oz
        # What is not finite goes to the origin: dropped, but its steps must lie in the tables.
        finite = of[RANGE2 + n] < np.inf
        x, y, z = x if finite else 0.0, y if finite else 0.0, z if finite else 0.0
        of[X + n], of[Y + n], of[Z + n] = x, y, z
        of[DISTANCE2 + n] = x**2 + y**2 + z**2


@borrowing
def _sort_out(count: int, filters: Filters, block: Block) -> None:
    """Why each return of a block is dropped, KEPT if it is not."""
    e, up, ground = filters.body, filters.up, filters.ground
    ex, ey, ez, up_x, up_y, up_z = e[0], e[1], e[2], up[0], up[1], up[2]
    low, high, own = filters.min_range**2, filters.max_range**2, filters.airframe_radius**2
    of, reason = block.of, block.reason
    for n in range(count):
        x, y, z, squared = of[X + n], of[Y + n], of[Z + n], of[RANGE2 + n]
        from_body = (x - ex) ** 2 + (y - ey) ** 2 + (z - ez) ** 2
        height = up_x * x + up_y * y + up_z * z
        code = GROUND if height <= ground else KEPT
        code = AIRFRAME if from_body < own else code
        code = BLIND if squared < low else code
        code = BEYOND if squared > high else code
        reason[n] = code if squared < np.inf else NONFINITE


@borrowing
def _cull_beside(count: int, cone: FloatArray, block: Block) -> tuple[int, int, int]:
    """Gather those of a block in the cone of `CellTables`, and those too near, unless they are
    most; how many are left, and how many of the others are ground, and beyond the range."""
    inside, reason = block.cell, block.reason
    m = _mark_inside(count, cone, block)
    if m > GATHERED * count:
        return count, 0, 0
    ground, beyond = 0, 0
    for n in range(count):
        ground += (inside[n] == 0) & (reason[n] == GROUND)
    for n in range(count):
        beyond += (inside[n] == 0) & (reason[n] == BEYOND)
    of, source, m = block.of, block.source, 0
    for n in range(count):
        source[m] = n
        m += inside[n]
    for n in range(m):
        k = np.int64(source[n])
        of[X + n], of[Y + n], of[Z + n], of[DISTANCE2 + n], reason[n] = (
            of[X + k],
            of[Y + k],
            of[Z + k],
            of[DISTANCE2 + k],
            reason[k],
        )
    return m, ground, beyond


@borrowing
def _mark_inside(count: int, cone: FloatArray, block: Block) -> int:
    """Which of a block are in the cone of `CellTables`, or too near; how many."""
    right_x, right_y, left_x, left_y = cone[0], cone[1], cone[2], cone[3]
    low, high = cone[4], cone[5]
    of, inside, reason = block.of, block.cell, block.reason
    for n in range(count):
        x, y, z, squared = of[X + n], of[Y + n], of[Z + n], of[DISTANCE2 + n]
        steep = z * abs(z)
        inside[n] = (
            (
                (right_x * x + right_y * y >= 0.0)
                & (left_x * x + left_y * y >= 0.0)
                & (steep >= low * squared)
                & (steep <= high * squared)
            )
            | (reason[n] == BLIND)
            | (reason[n] == AIRFRAME)
        )
    m = 0
    for n in range(count):
        m += inside[n]
    return m


@borrowing
def _steps(count: int, steps_per_m: float, block: Block) -> None:
    """Steps of a block in the three tables; the arithmetic of `binning.quick_column`."""
    of, layer, column, row = block.of, block.layer, block.column, block.row
    last = STEPS - 1.0
    distance = RANGE2  # which has had its use
    for n in range(count):
        of[distance + n] = np.sqrt(of[DISTANCE2 + n])
    for n in range(count):
        layer[n] = np.int32(min(of[distance + n] * steps_per_m, last))
    for n in range(count):
        x, y = of[X + n], of[Y + n]
        forward = y / (abs(x) + abs(y) + TINY)
        turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
        column[n] = np.int32(min((turned + 2.0) * (STEPS / 4.0), last))
    for n in range(count):
        sine = of[Z + n] / (of[distance + n] + TINY)
        row[n] = np.int32(max(min((sine + 1.0) * (STEPS / 2.0), last), 0.0))


@borrowing
def _cells(count: int, tables: CellTables, block: Block) -> int:
    """Cells of a block; how many of its returns are dropped."""
    layers, columns, rows = tables.layer, tables.column, tables.row
    of, layer, column, row, cell = block.of, block.layer, block.column, block.row, block.cell
    reason = block.reason
    for n in range(count):
        cell[n] = (
            layers[np.uint32(layer[n])] + columns[np.uint32(column[n])] + rows[np.uint32(row[n])]
        )
    for n in range(count):
        if BORDER <= cell[n] < OUTSIDE:
            cell[n] = cell_at_border(of[X + n], of[Y + n], of[Z + n], tables)
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
    flat = points.reshape(points.size)
    for start in range(0, len(points), BLOCK):
        part = flat[3 * start : 3 * (start + BLOCK)]
        count = len(part) // 3
        near = _cull(part, culled, block)
        if near < count:
            nonfinite, beyond, low = _count_far(count, filters, culled, block)
            counts[NONFINITE] += nonfinite
            counts[BEYOND] += beyond
            counts[GROUND] += low
            _gather_near(count, culled, block)
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
    flat = points.reshape(points.size)
    for start in range(0, len(points), BLOCK):
        part = flat[3 * start : 3 * (start + BLOCK)]
        count = len(part) // 3
        _cull(part, np.inf, block)
        _place(count, filters, block)
        _sort_out(count, filters, block)
        m += _keep(count, filters.half_spacing, block, kept[m:], radius[m:])
    return kept[:m], radius[:m]


@compiled
def _new_block() -> Block:
    return Block(
        np.empty(DISTANCE2 + BLOCK),
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


@borrowing
def _count_hits(count: int, block: Block, hits: IntArray, squared_ranges: FloatArray) -> None:
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


@borrowing
def _keep(
    count: int, half_spacing: float, block: Block, kept: FloatArray, radius: FloatArray
) -> int:
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
