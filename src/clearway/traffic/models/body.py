"""The intruder's body (5.10)-(5.13), (6.9), (6.10): a ball that flies straight on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.grid import AvoidanceGrid, GridEdges
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.ball_cell import (
    BOUND_M,
    CellParts,
    cell_parts,
    compute_filled_share,
)
from clearway.traffic.models.borders import (
    Borders,
    compute_borders,
    scratch,
)
from clearway.traffic.models.cells import Accuracy, ModelArrays, ModelCells, empty_arrays
from clearway.traffic.models.contact import Ball, contact, window
from clearway.traffic.models.half_lines import room_for_lines
from clearway.traffic.models.line import follow_line
from clearway.traffic.models.many import Intruders

PARTS = {"fast": 24, "fine": 400, "reference": 20_000}
"""Least parts of a cell; fast keeps (6.10) within 0.02 (0.003 in the mean)."""

FAST_PARTS_IN_ALL = 8_000
"""Grids of few, large cells cut each into more parts."""

POINT = 1e-7
"""A body smaller than this, in ranges of the grid, is a point: its contact is its line's."""

GRAZED = 0.1
"""Cells filled less than this are looked at more than once along the way."""

LARGE = 1.5
"""So are cells whose corners lie farther from their centre than so many radii."""


class Search(NamedTuple):
    """How to look for the moment at which a cell is filled most."""

    starts: int
    """Moments tried first, spread evenly, besides the one nearest to the cell's centre."""
    steps: int
    gain: float
    """Stop where the next step promises less of a share."""


SEARCH = {
    "fast": Search(0, 4, 0.004),
    "fine": Search(12, 12, 1e-5),
    "reference": Search(24, 40, 1e-9),
}


def body_cells(
    grid: AvoidanceGrid, intruders: Sequence[Intruder], accuracy: Accuracy = "fast"
) -> ModelCells:
    """Body model of each intruder: the largest share of each cell that it fills (6.10).

    Intruders are in the grid's frame at the decision time, t = 0. `indicator` is (5.13), exact:
    the body touches the cell at some time; entry, leave and dwell are of this contact. The share
    of a body without radius is 0.
    """
    arrays = empty_arrays(len(intruders), grid.cells)
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    parts = max(PARTS[accuracy], min(10 * PARTS["fast"], FAST_PARTS_IN_ALL // grid.cells))
    _bodies(
        position,
        velocity,
        np.array([intruder.radius_m for intruder in intruders], dtype=np.float64),
        SEARCH[accuracy],
        cell_parts(grid, parts),
        grid.volumes_m3,
        compute_borders(grid),
        grid.edges,
        arrays,
    )
    return ModelCells(*arrays, indicator=np.where(arrays.dwell_s > 0.0, 1.0, 0.0))


@compiled
def _bodies(
    position: Floats2,
    velocity: Floats2,
    radius: Floats,
    search: Search,
    parts: CellParts,
    volume: Floats,
    borders: Borders,
    edges: GridEdges,
    arrays: ModelArrays,
) -> None:
    lines, pieces = room_for_lines(borders), scratch(borders)
    point = POINT * edges.range_m[-1]
    for n in range(len(position)):
        if radius[n] < point:
            follow_line(n, position[n], velocity[n], borders, edges, lines, pieces, arrays)
            arrays.probability[n] = 0.0
            continue
        speed = np.sqrt(np.sum(velocity[n] ** 2))
        ux, uy, uz = velocity[n] / speed if speed > 0.0 else np.zeros(3)
        ball = Ball(position[n, 0], position[n, 1], position[n, 2], ux, uy, uz, radius[n])
        most = 4.0 / 3.0 * np.pi * radius[n] ** 3
        for cell in range(len(volume)):
            column_row = cell % (borders.columns * borders.rows)
            i, k = cell // (borders.columns * borders.rows), column_row % borders.rows
            place = (i, column_row // borders.rows, k)
            low, high = window(ball, parts.center_m, cell, parts.sizes[BOUND_M, i, k])
            if high < low:
                continue
            entry, leave, dwell = contact(ball, low, high, place, borders)
            if dwell <= 0.0:
                continue
            share = _largest_share(ball, entry, leave, search, place, parts, cell)
            arrays.probability[n, cell] = min(share, 1.0, most / volume[cell])
            arrays.entry_s[n, cell] = entry / speed if entry > 0.0 else 0.0
            arrays.leave_s[n, cell] = leave / speed
            arrays.dwell_s[n, cell] = dwell / speed


@compiled
def _share(
    ball: Ball, s: float, place: tuple[int, int, int], parts: CellParts
) -> tuple[float, float]:
    """Share of a cell that the ball fills after a length, and its change by length."""
    x, y, z = ball.x + s * ball.ux, ball.y + s * ball.uy, ball.z + s * ball.uz
    return compute_filled_share(x, y, z, ball.radius, (ball.ux, ball.uy, ball.uz), place, parts)


@compiled
def _largest_share(
    ball: Ball,
    entry: float,
    leave: float,
    search: Search,
    place: tuple[int, int, int],
    parts: CellParts,
    cell: int,
) -> float:
    """(6.10): the share of the cell that the ball fills at the best moment of their contact."""
    if leave == np.inf:
        return _share(ball, 0.0, place, parts)[0]
    center = parts.center_m
    x, y, z = center[cell, 0] - ball.x, center[cell, 1] - ball.y, center[cell, 2] - ball.z
    a, b = entry, leave
    s = min(max(x * ball.ux + y * ball.uy + z * ball.uz, a), b)
    x, y, z = x - s * ball.ux, y - s * ball.uy, z - s * ball.uz
    if np.sqrt(x * x + y * y + z * z) + parts.sizes[BOUND_M, place[0], place[2]] <= ball.radius:
        return 1.0
    best, rate = _share(ball, s, place, parts)
    # A ball that only grazes the cell, or is small beside it, may fill most of it far from the
    # cell's centre, or twice.
    large = parts.sizes[BOUND_M, place[0], place[2]] > LARGE * ball.radius
    starts = max(search.starts, 4) if large or best <= GRAZED else search.starts
    at_once = 0.0
    if entry <= 0.0 and s > 0.0:
        # What lies partly behind may be filled most where the ball is now.
        at_once = _share(ball, 0.0, place, parts)[0]
    for q in range(starts):
        middle = entry + (q + 0.5) / starts * (leave - entry)
        share, change = _share(ball, middle, place, parts)
        if share > best:
            best, rate, s = share, change, middle
            a = max(entry, middle - (leave - entry) / starts)
            b = min(leave, middle + (leave - entry) / starts)
    return max(at_once, best, _climb(ball, a, s, b, rate, search, place, parts))


@compiled
def _climb(
    ball: Ball,
    a: float,
    s: float,
    b: float,
    rate: float,
    search: Search,
    place: tuple[int, int, int],
    parts: CellParts,
) -> float:
    """Largest share met between a and b, on the way from s with the rate of change there.

    By steps towards the rise, then by false position.
    """
    best = rate_a = rate_b = 0.0
    for _ in range(search.steps):
        if rate > 0.0:
            a, rate_a = s, rate
        elif rate < 0.0:
            b, rate_b = s, rate
        else:
            break
        before = s
        if rate_a > 0.0 and rate_b < 0.0:
            s = a + min(max(rate_a / (rate_a - rate_b), 0.1), 0.9) * (b - a)
        elif rate > 0.0:
            s += 0.35 * (b - s)
        else:
            s -= 0.35 * (s - a)
        if abs(rate * (s - before)) < search.gain:
            break
        share, rate = _share(ball, s, place, parts)
        best = max(best, share)
    return best
