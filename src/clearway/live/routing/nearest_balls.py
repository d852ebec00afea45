"""How near balls come to the centres of the coarse cells of a `RouteMap`: compiled loops.

Balls are gathered by the cell that they lie in, and there by its eighths. Cells are told of those
about them from the nearest outwards: most balls can then come no nearer to a centre than others do,
and are passed over a group at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats3, Ints, Ints2
from clearway.base.compiled import compiled
from clearway.base.rounding import SURELY

PARTS = 2
"""Of a cell along each axis."""


class Groups(NamedTuple):
    """Balls by the cells that they lie in, and there by parts of these."""

    balls: Floats2
    """[n, 4] centre and radius, part after part."""
    cells: Ints2
    """[groups, 3] in which each group lies."""
    first_part: Ints
    """[groups + 1] where the parts of each begin, with the end."""
    first_ball: Ints
    """[parts + 1] likewise the balls of each part."""
    box: Floats2
    """[groups, 7] lowest and highest corner of the centres of a group's balls, and their widest."""
    part_box: Floats2
    """[parts, 7] likewise of a part."""


@compiled
def mark_balls(
    nearest: Floats3,
    position: Floats2,
    radius: Floats,
    low: Floats,
    width: float,
    reach: float,
) -> None:
    """Lower the distance of cells' centres, as far as `reach` from balls, to what balls leave.

    nearest: [nx, ny, nz] of cells `width` wide from `low` [3] on; position: [n, 3]; in metres.
    """
    far = _cells_about(radius, width, reach)
    homes = np.empty((len(radius), 3), dtype=np.int64)
    _find_homes(homes, position, low, width, far, nearest.shape)
    order, starts = _gathered(homes // PARTS)
    groups, most = len(starts) - 1, min(PARTS**3 * (len(starts) - 1), len(radius))
    first_part, first_ball = np.empty(groups + 1, np.int64), np.empty(most + 1, np.int64)
    by_part = np.empty(len(radius), dtype=np.int64)
    _split(homes, order, starts, np.empty(PARTS**3, np.int64), by_part, first_part, first_ball)
    balls, box, part_box = np.empty((len(radius), 4)), np.empty((groups, 7)), np.empty((most, 7))
    cells = np.empty((groups, 3), dtype=np.int64)
    gathered = Groups(balls, cells, first_part, first_ball, box, part_box)
    _put_in_order(gathered, position, radius, homes, by_part)
    _mark_gathered(nearest, gathered, low, width, reach, outwards(far))


@compiled
def _gathered(cells: Ints2) -> tuple[Ints, Ints]:
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
def outwards(far: int) -> Ints2:
    """[k, 3] steps to the cells about one, the nearest first."""
    side = 2 * far + 1
    steps = np.empty((side**3, 3), dtype=np.int64)
    for k in range(side**3):
        steps[k, 0], steps[k, 1] = k // (side * side) - far, k // side % side - far
        steps[k, 2] = k % side - far
    return steps[np.argsort(np.sum(steps * steps, axis=1), kind="mergesort")]


@compiled
def _cells_about(radius: Floats, width: float, reach: float) -> int:
    """Cells along an axis as far as which balls may be told of."""
    widest = 0.0
    for n in range(len(radius)):
        widest = max(widest, radius[n])
    return int(np.ceil((reach + widest) / width)) + 1


@compiled
def _find_homes(
    homes: Ints2,
    position: Floats2,
    low: Floats,
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


@compiled
def _split(
    homes: Ints2,
    order: Ints,
    starts: Ints,
    tally: Ints,
    by_part: Ints,
    first_part: Ints,
    first_ball: Ints,
) -> None:
    """Fill in the balls of each group part after part, and where these begin.

    order, starts: of groups, by `_gathered`. tally: [PARTS^3] to work with.
    """
    parts = 0
    for g in range(len(starts) - 1):
        first_part[g] = parts
        tally[:] = 0
        for at in range(starts[g], starts[g + 1]):
            tally[_part_of(homes, order[at])] += 1
        begin = starts[g]
        for part in range(len(tally)):
            if tally[part] > 0:
                first_ball[parts] = begin
                parts += 1
            begin, tally[part] = begin + tally[part], begin
        for at in range(starts[g], starts[g + 1]):
            part = _part_of(homes, order[at])
            by_part[tally[part]] = order[at]
            tally[part] += 1
    first_part[len(starts) - 1], first_ball[parts] = parts, len(order)


@compiled
def _part_of(homes: Ints2, n: int) -> int:
    """Which part of its cell a ball lies in."""
    return int((homes[n, 0] % PARTS * PARTS + homes[n, 1] % PARTS) * PARTS + homes[n, 2] % PARTS)


@compiled
def _put_in_order(
    groups: Groups, position: Floats2, radius: Floats, homes: Ints2, by_part: Ints
) -> None:
    """Fill in balls and cells, and the boxes of parts and groups."""
    balls, box, part_box = groups.balls, groups.box, groups.part_box
    for at in range(len(balls)):
        n = by_part[at]
        for axis in range(3):
            balls[at, axis] = position[n, axis]
        balls[at, 3] = radius[n]
    for g in range(len(box)):
        first, last = groups.first_part[g], groups.first_part[g + 1]
        for axis in range(3):
            groups.cells[g, axis] = homes[by_part[groups.first_ball[first]], axis] // PARTS
        _begin(box, g)
        for part in range(first, last):
            _begin(part_box, part)
            for at in range(groups.first_ball[part], groups.first_ball[part + 1]):
                for axis in range(3):
                    part_box[part, axis] = min(part_box[part, axis], balls[at, axis])
                    part_box[part, 3 + axis] = max(part_box[part, 3 + axis], balls[at, axis])
                part_box[part, 6] = max(part_box[part, 6], balls[at, 3])
            for axis in range(3):
                box[g, axis] = min(box[g, axis], part_box[part, axis])
                box[g, 3 + axis] = max(box[g, 3 + axis], part_box[part, 3 + axis])
            box[g, 6] = max(box[g, 6], part_box[part, 6])


@compiled
def _begin(boxes: Floats2, n: int) -> None:
    """Fill in a box of nothing."""
    for axis in range(3):
        boxes[n, axis], boxes[n, 3 + axis] = np.inf, -np.inf
    boxes[n, 6] = 0.0


@compiled
def _mark_gathered(
    nearest: Floats3,
    groups: Groups,
    low: Floats,
    width: float,
    reach: float,
    steps: Ints2,
) -> None:
    nx, ny, nz = nearest.shape
    cells, first_part, first_ball = groups.cells, groups.first_part, groups.first_ball
    widest = 0.0
    for g in range(len(cells)):
        widest = max(widest, groups.box[g, 6])
    for k in range(len(steps)):
        u, v, w = steps[k, 0], steps[k, 1], steps[k, 2]
        # From a centre to the nearest place in a cell so many off.
        gap_x, gap_y = max(abs(u) - 0.5, 0.0), max(abs(v) - 0.5, 0.0)
        gap_z = max(abs(w) - 0.5, 0.0)
        least = width * np.sqrt(gap_x * gap_x + gap_y * gap_y + gap_z * gap_z) - widest
        if least > reach:
            continue
        for g in range(len(cells)):
            a, b, c = cells[g, 0] + u, cells[g, 1] + v, cells[g, 2] + w
            if a < 0 or b < 0 or c < 0 or a >= nx or b >= ny or c >= nz:
                continue
            known = nearest[a, b, c]
            if least > known:
                continue
            x, y = low[0] + (a + 0.5) * width, low[1] + (b + 0.5) * width
            z = low[2] + (c + 0.5) * width
            if not _may_be_nearer(x, y, z, min(known, reach), groups.box, g):
                continue
            for part in range(first_part[g], first_part[g + 1]):
                if _may_be_nearer(x, y, z, min(known, reach), groups.part_box, part):
                    begin, end = first_ball[part], first_ball[part + 1]
                    known = _nearest_of(x, y, z, known, reach, groups.balls, begin, end)
            nearest[a, b, c] = known


@compiled
def _may_be_nearer(x: float, y: float, z: float, known: float, boxes: Floats2, group: int) -> bool:
    """Whether a ball of a group may come nearer to a place than is known."""
    off_x = max(max(boxes[group, 0] - x, x - boxes[group, 3]), 0.0)
    off_y = max(max(boxes[group, 1] - y, y - boxes[group, 4]), 0.0)
    off_z = max(max(boxes[group, 2] - z, z - boxes[group, 5]), 0.0)
    bound = known + boxes[group, 6]
    return bool(off_x * off_x + off_y * off_y + off_z * off_z <= bound * bound * SURELY)


@compiled
def _nearest_of(
    x: float,
    y: float,
    z: float,
    known: float,
    reach: float,
    balls: Floats2,
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
