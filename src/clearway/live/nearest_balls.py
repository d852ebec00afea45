"""How near balls come to the centres of the coarse cells of a `RouteMap`: compiled loops.

Balls are gathered by the cell that they lie in, and there by its eighths. Cells are told of those
about them from the nearest outwards: most balls can then come no nearer to a centre than others do,
and are passed over a group at a time.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import IntArray
from clearway.base.compiled import borrowing, compiled, inlined
from clearway.base.frames import FloatArray

PARTS = 2
"""Of a cell along each axis."""
SURELY = 1.0 + 1e-12
"""Factor on a squared bound: what lies beyond it is not within, however numbers are rounded."""


class Groups(NamedTuple):
    """What lies in the same cell, one group after the other."""

    order: IntArray
    """[n] number of each."""
    starts: IntArray
    """[groups + 1] where in it each group begins, with the end."""
    boxes: FloatArray
    """[groups, 7] lowest and highest corner of the centres of a group's balls, and their widest."""


def mark_balls(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
) -> None:
    """Lower the distance of cells' centres, as far as `reach` from balls, to what balls leave.

    nearest: [nx, ny, nz] of cells `width` wide from `low` [3] on; position: [n, 3]; in metres.
    """
    far = _cells_about(radius, width, reach)
    _mark_balls(nearest, position, radius, low, width, reach, far, _outwards(far))


@lru_cache(maxsize=8)
def _outwards(far: int) -> IntArray:
    return outwards(far)


@compiled
def _mark_balls(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
    far: int,
    steps: IntArray,
) -> None:
    """far: cells as far as which balls may be told of. steps: `outwards` to these."""
    homes = np.empty((len(radius), 3), dtype=np.int64)
    _find_homes(homes, position, low, width, far, nearest.shape)
    order, starts = gathered(homes)
    parts = Groups(order, starts, np.empty((len(starts) - 1, 7)))
    balls = np.empty((len(radius), 4))
    _put_in_order(balls, position, radius, order)
    _bound_balls(parts, balls)
    cells = np.empty((len(starts) - 1, 3), dtype=np.int64)
    for part in range(len(cells)):
        for axis in range(3):
            cells[part, axis] = homes[order[starts[part]], axis] // PARTS
    order, starts = gathered(cells)
    whole = Groups(order, starts, np.empty((len(starts) - 1, 7)))
    _bound_parts(whole, parts)
    _mark_gathered(nearest, balls, low, width, reach, cells, parts, whole, steps)


@compiled
def gathered(cells: IntArray) -> tuple[IntArray, IntArray]:
    """Those that lie in cells [n, 3] in the order of these, and where in it each begins, with the
    end."""
    low, spans = np.zeros(3, dtype=np.int64), np.ones(3, dtype=np.int64)
    for axis in range(3):
        if len(cells):
            low[axis] = cells[:, axis].min()
            spans[axis] = cells[:, axis].max() - low[axis] + 1
    count = np.zeros(spans[0] * spans[1] * spans[2] + 1, dtype=np.int64)
    key = np.empty(len(cells), dtype=np.int64)
    for n in range(len(cells)):
        a, b, c = cells[n, 0] - low[0], cells[n, 1] - low[1], cells[n, 2] - low[2]
        key[n] = (a * spans[1] + b) * spans[2] + c
        count[key[n] + 1] += 1
    starts = [0]
    for k in range(1, len(count)):
        if count[k]:
            starts.append(starts[-1] + count[k])
        count[k] += count[k - 1]
    order = np.empty(len(cells), dtype=np.int64)
    for n in range(len(cells)):
        order[count[key[n]]] = n
        count[key[n]] += 1
    return order, np.array(starts)


@compiled
def outwards(far: int) -> IntArray:
    """[k, 3] steps to the cells about one, the nearest first."""
    side = 2 * far + 1
    steps = np.empty((side**3, 3), dtype=np.int64)
    for k in range(side**3):
        steps[k, 0], steps[k, 1] = k // (side * side) - far, k // side % side - far
        steps[k, 2] = k % side - far
    return steps[np.argsort(np.sum(steps * steps, axis=1), kind="mergesort")]


@borrowing
def _cells_about(radius: FloatArray, width: float, reach: float) -> int:
    """Cells along an axis as far as which balls may be told of."""
    widest = 0.0
    for n in range(len(radius)):
        widest = max(widest, radius[n])
    return int(np.ceil((reach + widest) / width)) + 1


@borrowing
def _find_homes(
    homes: IntArray,
    position: FloatArray,
    low: FloatArray,
    width: float,
    far: int,
    shape: tuple[int, int, int],
) -> None:
    """Fill in the parts of cells [n, 3] that balls lie in; those too far off to mark any lie
    outside."""
    for n in range(len(position)):
        for axis in range(3):
            at = np.floor((position[n, axis] - low[axis]) / width * PARTS)
            first, last = -far - 1.0, shape[axis] + far + 0.0
            homes[n, axis] = int(min(max(at, first * PARTS), last * PARTS))


@borrowing
def _put_in_order(
    balls: FloatArray, position: FloatArray, radius: FloatArray, order: IntArray
) -> None:
    """Fill in centres and radii [n, 4] of balls in an order."""
    for n in range(len(balls)):
        at = order[n]
        balls[n, 0], balls[n, 1], balls[n, 2] = position[at, 0], position[at, 1], position[at, 2]
        balls[n, 3] = radius[at]


@borrowing
def _bound_balls(parts: Groups, balls: FloatArray) -> None:
    """Fill in the boxes of groups of balls that lie in their order."""
    boxes, starts = parts.boxes, parts.starts
    for g in range(len(boxes)):
        for axis in range(3):
            boxes[g, axis] = boxes[g, 3 + axis] = balls[starts[g], axis]
        boxes[g, 6] = 0.0
        for at in range(starts[g], starts[g + 1]):
            for axis in range(3):
                boxes[g, axis] = min(boxes[g, axis], balls[at, axis])
                boxes[g, 3 + axis] = max(boxes[g, 3 + axis], balls[at, axis])
            boxes[g, 6] = max(boxes[g, 6], balls[at, 3])


@borrowing
def _bound_parts(whole: Groups, parts: Groups) -> None:
    """Fill in the boxes of groups of parts."""
    boxes, order, starts = whole.boxes, whole.order, whole.starts
    for g in range(len(boxes)):
        for column in range(7):
            boxes[g, column] = parts.boxes[order[starts[g]], column]
        for at in range(starts[g], starts[g + 1]):
            part = order[at]
            for axis in range(3):
                boxes[g, axis] = min(boxes[g, axis], parts.boxes[part, axis])
                boxes[g, 3 + axis] = max(boxes[g, 3 + axis], parts.boxes[part, 3 + axis])
            boxes[g, 6] = max(boxes[g, 6], parts.boxes[part, 6])


@borrowing
def _mark_gathered(
    nearest: FloatArray,
    balls: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
    cells: IntArray,
    parts: Groups,
    whole: Groups,
    steps: IntArray,
) -> None:
    """cells: [parts, 3] in which each part lies."""
    nx, ny, nz = nearest.shape
    order, starts = whole.order, whole.starts
    widest = 0.0
    for g in range(len(whole.boxes)):
        widest = max(widest, whole.boxes[g, 6])
    for k in range(len(steps)):
        u, v, w = steps[k, 0], steps[k, 1], steps[k, 2]
        # From a centre to the nearest place in a cell so many off.
        gap_x, gap_y = max(abs(u) - 0.5, 0.0), max(abs(v) - 0.5, 0.0)
        gap_z = max(abs(w) - 0.5, 0.0)
        least = width * np.sqrt(gap_x * gap_x + gap_y * gap_y + gap_z * gap_z) - widest
        if least > reach:
            continue
        for g in range(len(starts) - 1):
            first = order[starts[g]]
            a, b, c = cells[first, 0] + u, cells[first, 1] + v, cells[first, 2] + w
            if a < 0 or b < 0 or c < 0 or a >= nx or b >= ny or c >= nz:
                continue
            known = nearest[a, b, c]
            if least > known:
                continue
            x, y = low[0] + (a + 0.5) * width, low[1] + (b + 0.5) * width
            z = low[2] + (c + 0.5) * width
            if not _may_be_nearer(x, y, z, min(known, reach), whole.boxes, g):
                continue
            for at in range(starts[g], starts[g + 1]):
                part = order[at]
                if _may_be_nearer(x, y, z, min(known, reach), parts.boxes, part):
                    begin, end = parts.starts[part], parts.starts[part + 1]
                    known = _nearest_of(x, y, z, known, reach, balls, begin, end)
            nearest[a, b, c] = known


@inlined
def _may_be_nearer(
    x: float, y: float, z: float, known: float, boxes: FloatArray, group: int
) -> bool:
    """Whether a ball of a group may come nearer to a place than is known."""
    off_x = max(max(boxes[group, 0] - x, x - boxes[group, 3]), 0.0)
    off_y = max(max(boxes[group, 1] - y, y - boxes[group, 4]), 0.0)
    off_z = max(max(boxes[group, 2] - z, z - boxes[group, 5]), 0.0)
    bound = known + boxes[group, 6]
    return bool(off_x * off_x + off_y * off_y + off_z * off_z <= bound * bound * SURELY)


@inlined
def _nearest_of(
    x: float,
    y: float,
    z: float,
    known: float,
    reach: float,
    balls: FloatArray,
    begin: int,
    end: int,
) -> float:
    """The distance known of a place, or what some balls leave that come nearer, within `reach`."""
    for at in range(begin, end):
        dx, dy, dz = x - balls[at, 0], y - balls[at, 1], z - balls[at, 2]
        squared, bound = dx * dx + dy * dy + dz * dz, min(known, reach) + balls[at, 3]
        # Roots take as long as all the rest, and most balls are farther off.
        if squared <= bound * bound * SURELY:
            away = np.sqrt(squared) - balls[at, 3]
            if away < known and away <= reach:
                known = away
    return known
