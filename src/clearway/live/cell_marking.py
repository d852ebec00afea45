"""Marking the coarse cells of a `RouteMap`: the compiled loops over them."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import BoolArray, IntArray
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.sensors.seen_space import WORD, Voxels, is_marked


@compiled
def mostly_seen(
    free: Voxels, free_low: IntArray, low: IntArray, per_cell: int, shape: tuple[int, int, int]
) -> BoolArray:
    """[nx, ny, nz] whether most of a cell was seen to be free, by the middles of its eighths."""
    nx, ny, nz = shape
    quarter = per_cell // 4
    mostly = np.zeros((nx, ny, nz), dtype=np.bool_)
    columns, rows = free.shape[0], WORD * free.shape[2]
    for a in range(nx):
        u0 = (low[0] + a) * per_cell
        if u0 < free_low[0] or u0 + per_cell > free_low[0] + columns:
            continue
        for b in range(ny):
            v0 = (low[1] + b) * per_cell
            if v0 < free_low[1] or v0 + per_cell > free_low[1] + columns:
                continue
            for c in range(nz):
                w0 = (low[2] + c) * per_cell
                if w0 < free_low[2] or w0 + per_cell > free_low[2] + rows:
                    continue
                count = 0
                for eighth in range(8):
                    u = u0 + quarter * (1 + 2 * (eighth & 1))
                    v = v0 + quarter * (1 + (eighth & 2))
                    w = w0 + quarter * (1 + (eighth & 4) // 2)
                    count += is_marked(free, u, v, w)
                mostly[a, b, c] = count >= 4
    return mostly


@compiled
def mark_balls(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
) -> None:
    """Lower the distance of cells' centres, as far as `reach` from balls, to what balls leave.

    Balls are gathered by the cell that they lie in, and cells are told of those about them from the
    nearest outwards: most balls can then come no nearer to a centre than others do.
    """
    widest = 0.0
    for n in range(len(radius)):
        widest = max(widest, radius[n])
    far = int(np.ceil((reach + widest) / width)) + 1
    home = np.empty((len(radius), 3), dtype=np.int64)
    _find_homes(home, position, low, width, far, nearest.shape)
    order, starts = _gathered(home)
    boxes = np.empty((len(starts) - 1, 7))
    _bound(boxes, position, radius, order, starts)
    _mark_gathered(
        nearest, position, radius, low, width, reach, home, order, starts, boxes, _outwards(far)
    )


@borrowing
def _bound(
    boxes: FloatArray, position: FloatArray, radius: FloatArray, order: IntArray, starts: IntArray
) -> None:
    """Fill in lowest and highest corners of the centres of gathered balls, and their widest."""
    for g in range(len(boxes)):
        for axis in range(3):
            low = high = position[order[starts[g]], axis]
            for at in range(starts[g], starts[g + 1]):
                low = min(low, position[order[at], axis])
                high = max(high, position[order[at], axis])
            boxes[g, axis], boxes[g, 3 + axis] = low, high
        widest = 0.0
        for at in range(starts[g], starts[g + 1]):
            widest = max(widest, radius[order[at]])
        boxes[g, 6] = widest


@borrowing
def _find_homes(
    home: IntArray,
    position: FloatArray,
    low: FloatArray,
    width: float,
    far: int,
    shape: tuple[int, int, int],
) -> None:
    """Fill in the cells [n, 3] that balls lie in; those too far off to mark any lie outside."""
    for n in range(len(position)):
        for axis in range(3):
            at = np.floor((position[n, axis] - low[axis]) / width)
            home[n, axis] = int(min(max(at, -far - 1.0), shape[axis] + far + 0.0))


@compiled
def _gathered(home: IntArray) -> tuple[IntArray, IntArray]:
    """Balls in the order of their cells, and where in it each of these begins, with the end."""
    low, spans = np.zeros(3, dtype=np.int64), np.ones(3, dtype=np.int64)
    for axis in range(3):
        if len(home):
            low[axis] = home[:, axis].min()
            spans[axis] = home[:, axis].max() - low[axis] + 1
    count = np.zeros(spans[0] * spans[1] * spans[2] + 1, dtype=np.int64)
    key = np.empty(len(home), dtype=np.int64)
    for n in range(len(home)):
        a, b, c = home[n, 0] - low[0], home[n, 1] - low[1], home[n, 2] - low[2]
        key[n] = (a * spans[1] + b) * spans[2] + c
        count[key[n] + 1] += 1
    starts = [0]
    for k in range(1, len(count)):
        if count[k]:
            starts.append(starts[-1] + count[k])
        count[k] += count[k - 1]
    order = np.empty(len(home), dtype=np.int64)
    for n in range(len(home)):
        order[count[key[n]]] = n
        count[key[n]] += 1
    return order, np.array(starts)


@compiled
def _outwards(far: int) -> IntArray:
    """[k, 3] steps to the cells about one, the nearest first."""
    side = 2 * far + 1
    steps = np.empty((side**3, 3), dtype=np.int64)
    for k in range(side**3):
        steps[k, 0], steps[k, 1] = k // (side * side) - far, k // side % side - far
        steps[k, 2] = k % side - far
    return steps[np.argsort(np.sum(steps * steps, axis=1), kind="mergesort")]


@borrowing
def _mark_gathered(
    nearest: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    low: FloatArray,
    width: float,
    reach: float,
    home: IntArray,
    order: IntArray,
    starts: IntArray,
    boxes: FloatArray,
    outwards: IntArray,
) -> None:
    nx, ny, nz = nearest.shape
    widest = 0.0
    for g in range(len(boxes)):
        widest = max(widest, boxes[g, 6])
    for k in range(len(outwards)):
        u, v, w = outwards[k, 0], outwards[k, 1], outwards[k, 2]
        # From a centre to the nearest place in a cell so many off.
        gap_x, gap_y = max(abs(u) - 0.5, 0.0), max(abs(v) - 0.5, 0.0)
        gap_z = max(abs(w) - 0.5, 0.0)
        least = width * np.sqrt(gap_x * gap_x + gap_y * gap_y + gap_z * gap_z) - widest
        if least > reach:
            continue
        for g in range(len(boxes)):
            first = order[starts[g]]
            a, b, c = home[first, 0] + u, home[first, 1] + v, home[first, 2] + w
            if a < 0 or b < 0 or c < 0 or a >= nx or b >= ny or c >= nz:
                continue
            known = nearest[a, b, c]
            if least > known:
                continue
            x, y = low[0] + (a + 0.5) * width, low[1] + (b + 0.5) * width
            z = low[2] + (c + 0.5) * width
            off_x = max(max(boxes[g, 0] - x, x - boxes[g, 3]), 0.0)
            off_y = max(max(boxes[g, 1] - y, y - boxes[g, 4]), 0.0)
            off_z = max(max(boxes[g, 2] - z, z - boxes[g, 5]), 0.0)
            bound = min(known, reach) + boxes[g, 6]
            if off_x * off_x + off_y * off_y + off_z * off_z > bound * bound:
                continue
            for at in range(starts[g], starts[g + 1]):
                n = order[at]
                dx, dy, dz = x - position[n, 0], y - position[n, 1], z - position[n, 2]
                away = np.sqrt(dx * dx + dy * dy + dz * dz) - radius[n]
                if away < known and away <= reach:
                    known = away
            nearest[a, b, c] = known


@compiled
def leaves_no_room(
    nearest: FloatArray, barred: float, room: float, within: float, width: float
) -> BoolArray:
    """[nx, ny, nz] of cells that are not barred, whether no centre `within` their own is as far as
    `room` from what stands: off something beside a wide place nobody has to keep for a turn.
    nearest: [nx, ny, nz] of centres, like all lengths in metres."""
    nx, ny, nz = nearest.shape
    none = np.zeros((nx, ny, nz), dtype=np.bool_)
    steps = _outwards(int(within / width))
    reached = 0
    while reached < len(steps) and np.sum(steps[reached] ** 2) * width * width <= within * within:
        reached += 1
    for a in range(nx):
        for b in range(ny):
            for c in range(nz):
                if nearest[a, b, c] >= room or nearest[a, b, c] < barred:
                    continue
                narrow = True
                for k in range(1, reached):
                    u, v, w = a + steps[k, 0], b + steps[k, 1], c + steps[k, 2]
                    if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz:
                        continue
                    if nearest[u, v, w] >= room:
                        narrow = False
                        break
                none[a, b, c] = narrow
    return none


@borrowing
def _cells_within(
    middle: float, low: float, width: float, far: float, count: int
) -> tuple[int, int]:
    """First and last cell along an axis whose centre is no farther than that."""
    at = (middle - low) / width - 0.5
    first = max(0, int(np.ceil(at - far / width)))
    return first, min(count - 1, int(np.floor(at + far / width)))


@borrowing
def add_ball(
    values: FloatArray, at: IntArray, reach: float, lowest: int, highest: int, added: float
) -> None:
    """Add to the cells about one, as far as some cells away, from a lowest layer to a highest one;
    and twice as far above and below them."""
    far = int(np.ceil(reach))
    for a in range(max(0, at[0] - far), min(values.shape[0], at[0] + far + 1)):
        for b in range(max(0, at[1] - far), min(values.shape[1], at[1] + far + 1)):
            for c in range(values.shape[2]):
                dx, dy = a - at[0], b - at[1]
                dz = 0.5 * max(0, lowest - c, c - highest)
                if dx * dx + dy * dy + dz * dz <= reach * reach:
                    values[a, b, c] += added
