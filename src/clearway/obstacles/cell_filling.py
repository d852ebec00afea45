"""How much of a cell several obstacles fill together, by the parts that the cell is cut into."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.obstacles.cell_nodes import CellNodes
from clearway.obstacles.cell_share import blur_share
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.rounded_box import (
    box_distance,
    local_point,
    local_vector,
    outward_normal,
    turn_of,
)
from clearway.obstacles.some_shapes import (
    AT_ONCE,
    SomeShapes,
    lay_out_shapes,
    some_shapes,
    touching,
    turn_in,
)

FEWEST = 6
"""Parts of a cell that are looked at, however many shapes meet in it."""
MANY = 80
"""Shapes beyond which the parts that are looked at become fewer faster than the shapes become more:
the more meet, the more alike are the parts."""
SPREAD = 0.618
"""Parts are taken this share of all of them apart: no side of the cell is left out."""


class Parts(NamedTuple):
    """What shapes do to the parts of one cell at a time, in buffers that the caller lends."""

    place_m: Floats2
    """[3, parts] grid frame, by axis."""
    width_m: Floats
    """[parts] edge of the cube of a part's volume."""
    weight: Floats
    """[parts] share of the volume that is looked at."""
    filled: Floats
    """[parts] share so far."""
    main: Floats2
    """[parts, 6] of the shape that fills most: share, normal, and between which offsets along the
    normal it lies."""
    beyond_m: Floats
    """[parts] how far beyond the faces of the shape that is looked at, before it is inflated."""
    touched: Ints
    """[parts] those that it may add to."""
    some: SomeShapes


@compiled
def parts_of(nodes: CellNodes) -> Parts:
    """Room for the cell with the most parts."""
    most = np.max(np.diff(nodes.first))
    return Parts(
        np.empty((3, most)),
        np.empty(most),
        np.empty(most),
        np.empty(most),
        np.empty((most, 6)),
        np.empty(most),
        np.empty(most, dtype=np.int64),
        some_shapes(),
    )


@compiled
def estimate_share(
    shapes: Shapes, nodes: CellNodes, cell: int, found: Ints, looks: int, parts: Parts
) -> float:
    """The share of a cell that some shapes fill together, by so many looks of a shape at a part."""
    many = len(found)
    most = looks // many if many <= MANY else looks // many * MANY // many
    count = _take_parts(nodes, cell, max(FEWEST, most), parts)
    parts.filled[:] = 0.0
    parts.main[:] = 0.0
    if many > MANY:
        _fill_by_part(shapes, count, found, parts)
    else:
        for s in found:
            if _fill_parts(shapes, count, s, many > 1, parts) == count:
                break
    share = 0.0
    for p in range(count):
        share += parts.weight[p] * parts.filled[p]
    return min(share, 1.0)


@compiled
def _take_parts(nodes: CellNodes, cell: int, most: int, parts: Parts) -> int:
    """Fill in the parts of a cell, or so many of them from all over it; how many."""
    first, count = nodes.first[cell], nodes.first[cell + 1] - nodes.first[cell]
    taken, apart = int(min(count, most)), 1
    if taken < count:
        apart = int(SPREAD * count)
        while math.gcd(apart, count) > 1:
            apart += 1
    n, total = 0, 0.0
    for p in range(taken):
        for axis in range(3):
            parts.place_m[axis, p] = nodes.position_m[axis, first + n]
        parts.width_m[p], parts.weight[p] = nodes.width_m[first + n], nodes.share[first + n]
        total += parts.weight[p]
        n = (n + apart) % count
    if taken < count:
        for p in range(taken):
            parts.weight[p] /= total
    return taken


@compiled
def _fill_parts(shapes: Shapes, count: int, s: int, several: bool, parts: Parts) -> int:
    """Add shape s to what each of a cell's parts is filled by; how many are full then."""
    center, turn, half = shapes.center_m[s], shapes.rotation[s], shapes.half_m[s]
    radius, hx, hy, hz = shapes.radius_m[s], half[0], half[1], half[2]
    filled, main = parts.filled, parts.main
    x, y, z = parts.place_m[0, :count], parts.place_m[1, :count], parts.place_m[2, :count]
    _beyond(x, y, z, center, turn, half, parts.beyond_m)
    touched, full = _count_touched(parts.width_m[:count], radius, parts)
    axes = turn_of(turn)
    for n in range(touched):
        p = np.uint64(parts.touched[n])  # Which is never counted from the end.
        width = parts.width_m[p]
        lx, ly, lz = local_point(x[p], y[p], z[p], center, turn)
        share = blur_share(lx, ly, lz, hx, hy, hz, radius, width)
        if not several:
            filled[p] = share
            continue
        nx, ny, nz = outward_normal(lx, ly, lz, hx, hy, hz, axes)
        high = radius - box_distance(lx, ly, lz, hx, hy, hz)
        low = high - 2.0 * (radius + min(hx, min(hy, hz)))
        aligned = main[p, 1] * nx + main[p, 2] * ny + main[p, 3] * nz
        common = _common_length(main[p, 4], main[p, 5], low, high, aligned, 0.5 * width)
        filled[p] = _unite(filled[p], share, aligned, common / width)
        if share > main[p, 0]:
            main[p, 0], main[p, 1], main[p, 2], main[p, 3] = share, nx, ny, nz
            main[p, 4], main[p, 5] = low, high
    return full


@compiled
def _fill_by_part(shapes: Shapes, count: int, found: Ints, parts: Parts) -> None:
    """Add many shapes to a cell's parts, as `_fill_parts` adds one after the other: to the bit,
    since to each part they are added in the same order, but quicker where many meet."""
    some, filled = parts.some, parts.filled
    for first in range(0, len(found), AT_ONCE):
        these = found[first : first + AT_ONCE]
        lay_out_shapes(shapes, these, some.rows)
        full = 0
        for p in range(count):
            if filled[p] < 1.0:
                width = parts.width_m[p]
                x, y, z = parts.place_m[0, p], parts.place_m[1, p], parts.place_m[2, p]
                touched = touching(x, y, z, 0.5 * width, len(these), some)
                filled[p] = _fill_part(touched, width, filled[p], parts.main[p], some)
            full += filled[p] == 1.0
        if full == count:
            break


@compiled
def _fill_part(
    touched: int,
    width: float,
    filled: float,
    main: Floats,
    some: SomeShapes,
) -> float:
    """What a part is filled by after some shapes more; main [6]: its row of `Parts.main`."""
    rows, at = some.rows, some.local_m
    # On their own, so that they need not be read and written for every shape.
    most, mx, my, mz, before, behind = main[0], main[1], main[2], main[3], main[4], main[5]
    for n in range(touched):
        if filled == 1.0:
            break
        k = np.uint64(some.touched[n])
        lx, ly, lz, radius = at[0, k], at[1, k], at[2, k], rows[15, k]
        hx, hy, hz = rows[12, k], rows[13, k], rows[14, k]
        share = blur_share(lx, ly, lz, hx, hy, hz, radius, width)
        nx, ny, nz = outward_normal(lx, ly, lz, hx, hy, hz, turn_in(rows, k))
        high = radius - box_distance(lx, ly, lz, hx, hy, hz)
        low = high - 2.0 * (radius + min(hx, min(hy, hz)))
        aligned = mx * nx + my * ny + mz * nz
        common = _common_length(before, behind, low, high, aligned, 0.5 * width)
        filled = _unite(filled, share, aligned, common / width)
        if share > most:
            most, before, behind, mx, my, mz = share, low, high, nx, ny, nz
    main[0], main[1], main[2], main[3], main[4], main[5] = most, mx, my, mz, before, behind
    return filled


@compiled
def _unite(filled: float, share: float, aligned: float, common: float) -> float:
    """What is filled with one more share: surfaces meet as if by chance, but for parallel ones,
    whose overlap is a length in common, as a share of the part's width."""
    added = share
    if filled > 0.0:
        overlap = filled * share
        parallel = min(common, min(filled, share))
        added -= overlap + abs(aligned) * (parallel - overlap)
    return min(filled + added, 1.0)


@compiled
def _beyond(
    x: Floats,
    y: Floats,
    z: Floats,
    center: Floats,
    turn: Floats2,
    half: Floats,
    beyond: Floats,
) -> None:
    """Fill in how far beyond a shape's faces points [n] are: no branch in the loop."""
    cx, cy, cz, hx, hy, hz = center[0], center[1], center[2], half[0], half[1], half[2]
    for p in range(len(x)):
        lx, ly, lz = local_vector(x[p] - cx, y[p] - cy, z[p] - cz, turn)
        beyond[p] = max(abs(lx) - hx, max(abs(ly) - hy, abs(lz) - hz))


@compiled
def _count_touched(width: Floats, radius: float, parts: Parts) -> tuple[int, int]:
    """How many parts an inflated shape may add to, and how many are full: nothing adds to those.

    Which they are cannot be foretold, so no branch asks: the others are written over.
    """
    count = full = 0
    for p in range(len(width)):
        is_full = parts.filled[p] == 1.0
        parts.touched[count] = p
        count += (not is_full) & (parts.beyond_m[p] < radius + 0.5 * width[p])
        full += is_full
    return count, full


@compiled
def _common_length(
    low: float, high: float, other_low: float, other_high: float, aligned: float, reach: float
) -> float:
    """How much of [-reach, reach] two slabs share, the other one's normal turned if opposed."""
    if aligned < 0.0:
        other_low, other_high = -other_high, -other_low
    return max(min(min(high, other_high), reach) - max(max(low, other_low), -reach), 0.0)
