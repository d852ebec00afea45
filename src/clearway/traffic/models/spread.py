"""The uncertainty spread (5.14)-(5.23): the intruder is somewhere in an elliptic cone.

With semi-axes that grow in proportion to the axial distance, and standard deviations equal to
them (5.16)-(5.19), each point of the unit disc is one straight ray from the apex, with a density
that does not depend on time. The integrals over the ellipse and over time (5.22), (5.23) then are
sums over rays of their exact times in each cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid, GridEdges, cell_of_point
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.beyond import ball_around, passes_by
from clearway.traffic.models.borders import (
    ENTRY,
    LEAVE,
    Borders,
    TraversalPieces,
    compute_borders,
    scratch,
)
from clearway.traffic.models.cells import Accuracy, ModelArrays, ModelCells, empty_arrays
from clearway.traffic.models.cone_corners import cone_of, corners_of
from clearway.traffic.models.cone_hull import widen_by_edges, widen_by_turns
from clearway.traffic.models.half_lines import (
    BUNCH,
    END_S,
    LINE_SPEED,
    PASSED,
    SPEED_X,
    SPEED_Y,
    SPEED_Z,
    HalfLines,
    X,
    Y,
    Z,
    room_for_lines,
)
from clearway.traffic.models.line import stay
from clearway.traffic.models.many import Intruders
from clearway.traffic.models.traverse import begin_walk, cut_lines, step

# Columns of the sums over rays, [cells, 5]; the first two are ENTRY and LEAVE.
DWELL = 2
MEETING = 3
RAY = 4
NOT_MET = np.array([np.inf, -np.inf, 0.0, 0.0, -1.0])


class DiscNodes(NamedTuple):
    """Nodes of the unit disc, the ellipse (5.17) in its own axes.

    Those of the ring carry no weight but find when cells are met.
    """

    wide: Floats
    """[nodes] place along the cone's wider spread."""
    narrow: Floats
    """[nodes] along the other."""
    wide_height: Floats
    """[nodes] height of the normal of (5.20) along the wider spread."""
    narrow_height: Floats
    """[nodes] likewise along the other."""
    inner: int
    """The first so many are spread evenly inside; the others stand on the ring."""


@lru_cache(maxsize=8)
def disc_nodes(inner: int, ring: int) -> DiscNodes:
    """One node in each of the strips of equal area across the wider spread, and a ring at radius 1.

    Borders of cells cut thin cones straight across, so what counts is how even the strips are;
    golden sections along them make the nodes even in the other direction too.
    """
    order = np.arange(inner)
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001)
    area = 0.5 + (angle + np.sin(angle) * np.cos(angle)) / np.pi
    strip = np.interp((order + 0.5) / inner, area, angle)
    along = 2.0 * np.mod(0.5 + order * (np.sqrt(5.0) - 1.0) / 2.0, 1.0) - 1.0
    around = 2.0 * np.pi * np.arange(ring) / ring
    wide = np.concatenate([np.sin(strip), np.cos(around)])
    narrow = np.concatenate([np.cos(strip) * along, np.sin(around)])
    heights = np.exp(-0.5 * wide**2), np.exp(-0.5 * narrow**2)
    return DiscNodes(wide, narrow, *heights, inner)


NODES = {"fast": (220, 20), "fine": (5_000, 400), "reference": (200_000, 4_000)}
"""Inner and ring nodes, a ray each. Of thousands of random cones, fast keeps P_T within 0.017 and Q
within 0.025 in every cell (0.0015 and 0.0035 in the mean over a grid's cells) of what twenty times
the rays tell; reference within 1e-4."""

CUT_TOLERANCE = {"fast": 0.01, "fine": 1e-4, "reference": 1e-9}
"""Of the times at which the cone's surface cuts an edge, as a share of the cone's width."""


def spread_cells(
    grid: AvoidanceGrid,
    intruders: Sequence[Intruder],
    up: FloatArray,
    accuracy: Accuracy = "fast",
) -> ModelCells:
    """Spread model of each intruder: P_T, the mean over [i_e, i_l] (5.23), and the meeting Q.

    Intruders are in the grid's frame at the decision time, t = 0; up [3] is world up in it: the
    horizontal spread is level, whatever way the intruder flies. An intruder without spread is a
    line; one that stands still stays in its cell for ever.
    """
    arrays = empty_arrays(len(intruders), grid.cells)
    meeting = np.zeros((len(intruders), grid.cells))
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    _spreads(
        position,
        velocity,
        np.sin(among.spread_rad),
        up,
        disc_nodes(*NODES[accuracy]),
        CUT_TOLERANCE[accuracy],
        compute_borders(grid),
        grid.edges,
        arrays,
        meeting,
    )
    return ModelCells(*arrays, meeting=meeting)


@compiled
def cone_axes(velocity: Floats, up: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors along the velocity, level across it, and normal to both (5.15).

    Where the velocity is vertical the level one falls back to the grid's y, then to its x.
    """
    along = velocity / np.sqrt(np.sum(velocity**2))
    level = np.cross(up / np.sqrt(np.sum(up**2)), along)
    for fallback in (1, 0):
        if np.sum(level**2) > 1e-18:
            break
        level = -along * along[fallback]
        level[fallback] += 1.0
    level = level / np.sqrt(np.sum(level**2))
    return along, level, np.cross(along, level)


@compiled
def _spreads(
    position: Floats2,
    velocity: Floats2,
    sine: Floats2,
    up: Floats,
    nodes: DiscNodes,
    tolerance: float,
    borders: Borders,
    edges: GridEdges,
    arrays: ModelArrays,
    meeting: Floats2,
) -> None:
    lines, pieces = room_for_lines(borders), scratch(borders)
    # The last row takes what is in no cell.
    sums = np.empty((arrays.dwell_s.shape[1] + 1, 5))
    corners = corners_of(borders)
    middle_m, radius_m = ball_around(borders)
    for n in range(len(position)):
        if not np.any(velocity[n]):
            cell = cell_of_point(position[n, 0], position[n, 1], position[n, 2], edges)
            stay(n, cell, arrays)
            if cell >= 0:
                meeting[n, cell] = 1.0
            continue
        if passes_by(position[n], velocity[n], np.max(sine[n]), middle_m, radius_m):
            continue
        along, level, across = cone_axes(velocity[n], up)
        speed = np.sqrt(np.sum(velocity[n] ** 2))
        wide, narrow = level * (speed * sine[n, 0]), across * (speed * sine[n, 1])
        if sine[n, 1] > sine[n, 0]:
            wide, narrow = narrow, wide
        sums[:] = NOT_MET
        _trace_rays(
            position[n],
            velocity[n],
            wide,
            narrow,
            _weights(np.max(sine[n]), np.min(sine[n]), nodes),
            nodes,
            borders,
            lines,
            pieces,
            sums,
        )
        if sine[n, 0] > 0.0 and sine[n, 1] > 0.0:
            cone = cone_of(
                position[n],
                along / speed,
                level / (speed * sine[n, 0]),
                across / (speed * sine[n, 1]),
            )
            widen_by_edges(cone, borders, corners, tolerance, sums)
            widen_by_turns(cone, borders, sums)
        _average(n, sums, arrays, meeting)


@compiled
def _weights(sine_wide: float, sine_narrow: float, nodes: DiscNodes) -> Floats:
    """Probability of each inner node by (5.20): the mean of (5.18) and (5.19), normed as (5.21)."""
    weights = np.zeros(len(nodes.wide))
    for m in range(nodes.inner):
        # A normal's height goes with the inverse of its deviation; both times the product.
        weights[m] = sine_narrow * nodes.wide_height[m] + sine_wide * nodes.narrow_height[m]
    total = np.sum(weights)
    if total > 0.0:
        return weights / total
    weights[: nodes.inner] = 1.0 / nodes.inner
    return weights


@compiled
def _trace_rays(
    apex: Floats,
    velocity: Floats,
    wide: Floats,
    narrow: Floats,
    weights: Floats,
    nodes: DiscNodes,
    borders: Borders,
    lines: HalfLines,
    pieces: TraversalPieces,
    sums: Floats2,
) -> None:
    """Sum the rays' times in each cell, and find the hull of their entries and leaves."""
    told = lines.told
    told[X], told[Y], told[Z], told[END_S] = apex[0], apex[1], apex[2], np.inf
    for first in range(0, len(weights), BUNCH):
        many = min(BUNCH, len(weights) - first)
        for n in range(many):
            u, w = nodes.wide[first + n], nodes.narrow[first + n]
            told[SPEED_X, n] = velocity[0] + u * wide[0] + w * narrow[0]
            told[SPEED_Y, n] = velocity[1] + u * wide[1] + w * narrow[1]
            told[SPEED_Z, n] = velocity[2] + u * wide[2] + w * narrow[2]
        cut_lines(lines, many, borders)
        for n in range(many):
            _sum_up(first + n, n, weights[first + n], borders, lines, pieces, sums)


@compiled
def _sum_up(
    ray: int,
    n: int,
    weight: float,
    borders: Borders,
    lines: HalfLines,
    pieces: TraversalPieces,
    sums: Floats2,
) -> None:
    """Of one ray, which is in a place of a bunch."""
    passed, speed = lines.told[PASSED, n], lines.told[LINE_SPEED, n]
    walk, end = begin_walk(lines, n, borders, pieces)
    nowhere = len(sums) - 1
    while walk.here < end:
        entry_s = walk.here_s
        cell, walk = step(walk, passed, speed, borders, pieces)
        at = np.uint64(cell if cell >= 0 else nowhere)
        leave_s = walk.here_s
        sums[at, ENTRY] = min(sums[at, ENTRY], entry_s)
        sums[at, LEAVE] = max(sums[at, LEAVE], leave_s)
        sums[at, DWELL] += weight * (leave_s - entry_s)
        if sums[at, RAY] != ray:
            sums[at, RAY] = ray
            sums[at, MEETING] += weight


@compiled
def _average(n: int, sums: Floats2, arrays: ModelArrays, meeting: Floats2) -> None:
    """(5.23): the mean over the hull; cells that only rays of the ring touch are not met."""
    for cell in range(len(sums) - 1):
        if sums[cell, MEETING] > 0.0:
            arrays.entry_s[n, cell] = sums[cell, ENTRY]
            arrays.leave_s[n, cell] = sums[cell, LEAVE]
            arrays.dwell_s[n, cell] = sums[cell, DWELL]
            hull = sums[cell, LEAVE] - sums[cell, ENTRY]
            arrays.probability[n, cell] = min(1.0, sums[cell, DWELL] / hull)
            meeting[n, cell] = min(1.0, sums[cell, MEETING])
