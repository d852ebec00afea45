"""The body's tube (6.11), (6.12): a disc across the flight path, swept along it.

The paper's low-cost replacement for a ball: its cells and its times are those of the disc alone,
which neither reaches ahead nor lags behind.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.grid import AvoidanceGrid, GridEdges
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.borders import (
    AZIMUTH_COS,
    AZIMUTH_SIN,
    CELL,
    ELEVATION_COS,
    ELEVATION_SIN,
    ENTRY,
    LEAVE,
    RANGE,
    Borders,
    TraversalPieces,
    compute_borders,
    scratch,
)
from clearway.traffic.models.cells import Accuracy, ModelArrays, ModelCells, empty_arrays
from clearway.traffic.models.half_lines import (
    BUNCH,
    END_S,
    SPEED_X,
    HalfLines,
    X,
    room_for_lines,
)
from clearway.traffic.models.line import follow_line
from clearway.traffic.models.many import Intruders
from clearway.traffic.models.spread import DiscNodes, cone_axes, disc_nodes
from clearway.traffic.models.traverse import cut_lines, pieces_of

NODES = {"fast": (80, 40), "fine": (20_000, 4_000), "reference": (20_000, 4_000)}
"""Inner and ring points of the disc; each is a straight path through the cells."""


def tube_cells(
    grid: AvoidanceGrid, intruders: Sequence[Intruder], accuracy: Accuracy = "fast"
) -> ModelCells:
    """Tube of each intruder: probability 1 in the cells that its disc passes (6.12).

    Intruders are in the grid's frame at the decision time, t = 0; the disc has their body radius.
    Without a radius or a speed it is the line.
    """
    arrays = empty_arrays(len(intruders), grid.cells)
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    _tubes(
        position,
        velocity,
        np.array([intruder.radius_m for intruder in intruders], dtype=np.float64),
        disc_nodes(*NODES[accuracy]),
        compute_borders(grid),
        grid.edges,
        arrays,
    )
    return ModelCells(*arrays)


@compiled
def _tubes(
    position: Floats2,
    velocity: Floats2,
    radius: Floats,
    nodes: DiscNodes,
    borders: Borders,
    edges: GridEdges,
    arrays: ModelArrays,
) -> None:
    lines, pieces = room_for_lines(borders), scratch(borders)
    upright = np.array([0.0, 0.0, 1.0])
    for n in range(len(position)):
        if radius[n] == 0.0 or not np.any(velocity[n]):
            follow_line(n, position[n], velocity[n], borders, edges, lines, pieces, arrays)
            continue
        along, level, across = cone_axes(velocity[n], upright)
        speed = np.sqrt(np.sum(velocity[n] ** 2))
        _follow_paths(
            n,
            position[n],
            velocity[n],
            level,
            across,
            radius[n],
            nodes,
            borders,
            lines,
            pieces,
            arrays,
        )
        _follow_corners(n, position[n], along, speed, radius[n], borders, arrays)
        for cell in range(arrays.dwell_s.shape[1]):
            if arrays.probability[n, cell] > 0.0:
                arrays.dwell_s[n, cell] = arrays.leave_s[n, cell] - arrays.entry_s[n, cell]


@compiled
def _meet(n: int, cell: int, entry: float, leave: float, arrays: ModelArrays) -> None:
    if arrays.probability[n, cell] == 0.0:
        arrays.probability[n, cell] = 1.0
        arrays.entry_s[n, cell], arrays.leave_s[n, cell] = entry, leave
        return
    arrays.entry_s[n, cell] = min(arrays.entry_s[n, cell], entry)
    arrays.leave_s[n, cell] = max(arrays.leave_s[n, cell], leave)


@compiled
def _follow_paths(
    n: int,
    position: Floats,
    velocity: Floats,
    level: Floats,
    across: Floats,
    radius: float,
    nodes: DiscNodes,
    borders: Borders,
    lines: HalfLines,
    pieces: TraversalPieces,
    arrays: ModelArrays,
) -> None:
    told = lines.told
    told[END_S] = np.inf
    for axis in range(3):
        told[SPEED_X + axis] = velocity[axis]
    for first in range(0, len(nodes.wide), BUNCH):
        many = min(BUNCH, len(nodes.wide) - first)
        for axis in range(3):
            for m in range(many):
                u, w = nodes.wide[first + m], nodes.narrow[first + m]
                told[X + axis, m] = position[axis] + radius * (u * level[axis] + w * across[axis])
        cut_lines(lines, many, borders)
        for m in range(many):
            for piece in range(pieces_of(lines, m, borders, pieces)):
                entry, leave = pieces.times[ENTRY, piece], pieces.times[LEAVE, piece]
                _meet(n, pieces.places[CELL, piece], entry, leave, arrays)


@compiled
def _follow_corners(
    n: int,
    position: Floats,
    along: Floats,
    speed: float,
    radius: float,
    borders: Borders,
    arrays: ModelArrays,
) -> None:
    """Cells with a corner inside the tube meet it, though no path need pass there."""
    table = borders.table
    for i in range(borders.layers + 1):
        for j in range(borders.columns + 1):
            for k in range(borders.rows + 1):
                level = table[RANGE, i] * table[ELEVATION_COS, k]
                x = level * table[AZIMUTH_COS, j] - position[0]
                y = level * table[AZIMUTH_SIN, j] - position[1]
                z = table[RANGE, i] * table[ELEVATION_SIN, k] - position[2]
                ahead = x * along[0] + y * along[1] + z * along[2]
                aside2 = x * x + y * y + z * z - ahead * ahead
                if ahead <= 0.0 or aside2 >= radius * radius:
                    continue
                for a in range(max(0, i - 1), min(i + 1, borders.layers)):
                    for b in range(max(0, j - 1), min(j + 1, borders.columns)):
                        for c in range(max(0, k - 1), min(k + 1, borders.rows)):
                            cell = (a * borders.columns + b) * borders.rows + c
                            _meet(n, cell, ahead / speed, ahead / speed, arrays)
