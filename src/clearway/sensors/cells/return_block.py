"""A block of raw returns: plain arithmetic that the compiler can vectorise, to where each belongs.

Only the last loop branches on data, and only for what is rare: a return so close to a border of a
cell that the tables do not decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Int32s
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.sensors.beams.binning import BORDER, OUTSIDE, STEPS, TINY, CellTables, cell_at_border

REASONS = ("kept", "outside", "nonfinite", "blind", "beyond", "airframe", "ground")
"""What becomes of a return; "outside" ones, out of the grid, are kept too."""
KEPT, OUTSIDE_GRID, NONFINITE, BLIND, BEYOND, AIRFRAME, GROUND = range(len(REASONS))

BLOCK = 512
"""Returns at a time: their intermediate values stay in the fastest cache."""

GATHERED = 0.8
"""Share of a block up to which those that may be in the grid are gathered: it takes as long as a
fifth of what is done with each afterwards."""

StepArray = npt.NDArray[np.int32]


class Filters(NamedTuple):
    """Pose of the sensor, and what makes a return none of an obstacle."""

    rotation: Floats2
    """[3, 3] grid from sensor."""
    origin: Floats
    """[3] sensor in the grid frame."""
    body: Floats
    """[3] body's origin in the grid frame."""
    up: Floats
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


A, B, C, X, Y, Z, RANGE2, DISTANCE2 = range(0, 8 * (BLOCK + 8), BLOCK + 8)
"""Where the columns of numbers of a block begin: sensor frame, grid frame, squared distances from
the sensor and from the grid's origin. Not a power of two apart, or they would share cache lines."""


class Block(NamedTuple):
    """Working memory for BLOCK returns."""

    of: Floats
    """Columns of numbers in one array, at places that the compiler knows: so it knows that they do
    not overlap, and one loop can fill in several."""
    layer: Int32s
    column: Int32s
    row: Int32s
    """Steps in the tables."""
    cell: Int32s
    """Flat cell, OUTSIDE or more where there is none or the return is dropped."""
    reason: Int32s
    source: Int32s
    """Where those that are kept of a block were in it."""


@compiled
def take_in(flat: Floats, culled: float, block: Block) -> int:
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


@compiled
def gather_near(count: int, culled: float, block: Block) -> None:
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


@compiled
def count_far(count: int, filters: Filters, culled: float, block: Block) -> tuple[int, int, int]:
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
    place_block(count, filters, block)
    up = filters.up
    up_x, up_y, up_z = up[0], up[1], up[2]
    for n in range(count):
        low = up_x * of[X + n] + up_y * of[Y + n] + up_z * of[Z + n] <= filters.ground
        ground += low & (of[RANGE2 + n] > culled) & (of[RANGE2 + n] <= high)
    return nonfinite, beyond, ground


@compiled
def place_block(count: int, filters: Filters, block: Block) -> None:
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


@compiled
def sort_out(count: int, filters: Filters, block: Block) -> None:
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


@compiled
def cull_beside(count: int, cone: Floats, block: Block) -> tuple[int, int, int]:
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


@compiled
def _mark_inside(count: int, cone: Floats, block: Block) -> int:
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


@compiled
def find_steps(count: int, steps_per_m: float, block: Block) -> None:
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


@compiled
def find_cells(count: int, tables: CellTables, block: Block) -> int:
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
def new_block() -> Block:
    """Room for a block."""
    return Block(
        np.empty(DISTANCE2 + BLOCK),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int32),
    )
