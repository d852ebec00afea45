"""From parents and movements to a reach set: states, samples and passed cells of every node.

A tree is given by its parents and movements; everything else follows from them and the lattice,
and is recomputed on loading.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Floats3, Int8s, Int16s, Int32s, Int32s2, Ints2
from clearway.base.compiled import compiled
from clearway.base.grid import AvoidanceGrid, GridEdges, cell_of_point, interval_of
from clearway.reach.expand.lattice import MOVEMENT_SAMPLES, Lattice, LatticePieces, grid_from_level
from clearway.reach.expand.passage import (
    CellBorders,
    CrossingSearch,
    cell_at,
    crossing_search,
    crossings,
    list_cell_borders,
)
from clearway.reach.tree import BRIEF, LAST_LAYER, SIDE, ReachSet

Int32Array = npt.NDArray[np.int32]

OUT_SIDE = -1
OUT_BEYOND = -2
NEAR = -3
NOT_ALLOWED = -4


def trace_reach_set(
    parent: Int32Array,
    movement: npt.NDArray[np.int16],
    grid: AvoidanceGrid,
    lattice: Lattice,
    start_pitch_rad: float,
) -> ReachSet:
    """The reach set of a tree given by its parents and movements."""
    pieces = lattice.pieces
    attitude, depth, flown, starts, ends = _chain(
        parent, movement, lattice.start[start_pitch_rad], pieces
    )
    borders = list_cell_borders(grid.edges)
    samples, cell_start, cell_index, end_cell, exit_kind = _through_cells(
        parent,
        movement,
        attitude,
        starts,
        pieces,
        grid_from_level(start_pitch_rad),
        grid.edges,
        borders,
        crossing_search(borders),
    )
    if lattice.automaton.has_inertia:  # Layers by time: a plan may end anywhere.
        exit_kind = np.where(depth == depth.max(), LAST_LAYER, BRIEF).astype(np.int8)
    states = np.empty((len(parent), 6))
    states[:, :3] = samples[:, -1]
    states[:, 3:5] = pieces.attitude_rad[attitude[:, 1]]
    states[:, 5] = ends[:, 3]
    return ReachSet(
        grid=grid,
        start_pitch_rad=start_pitch_rad,
        movement_names=lattice.automaton.names,
        movement_smooth=tuple(movement.smooth for movement in lattice.automaton.movements),
        parent=parent,
        movement=movement,
        depth=depth,
        end_time_s=np.ascontiguousarray(flown[:, 0]),
        length_m=np.ascontiguousarray(flown[:, 1]),
        states=states,
        samples_m=samples,
        sagitta_m=pieces.sagitta_m[attitude[:, 0], movement],
        cell_start=cell_start,
        cell_index=cell_index,
        end_cell=end_cell,
        exit_kind=exit_kind,
    )


@compiled
def locate_point(x: float, y: float, z: float, edges: GridEdges) -> int:
    """Cell of a point in the grid frame, or where else: NEAR, OUT_BEYOND, OUT_SIDE (4.24)."""
    cell = cell_of_point(x, y, z, edges)
    if cell >= 0:
        return cell
    horizontal = np.sqrt(x * x + y * y)
    inside = (
        interval_of(np.arctan2(y, x), edges.azimuth_rad) >= 0
        and interval_of(np.arctan2(z, horizontal), edges.elevation_rad) >= 0
    )
    if not inside:
        return OUT_SIDE
    if np.sqrt(x * x + y * y + z * z) < edges.range_m[0]:
        return NEAR
    return OUT_BEYOND


@compiled
def _point(
    origin: tuple[float, float, float, float, float],
    offset: Floats,
    rotation: Floats2,
) -> tuple[float, float, float]:
    """A piece's point in the grid frame; origin: x, y, z, cos and sin of yaw, level frame."""
    x, y, z, cosine, sine = origin
    px = x + cosine * offset[0] - sine * offset[1]
    py = y + sine * offset[0] + cosine * offset[1]
    pz = z + offset[2]
    return (
        rotation[0, 0] * px + rotation[0, 1] * py + rotation[0, 2] * pz,
        rotation[1, 0] * px + rotation[1, 1] * py + rotation[1, 2] * pz,
        rotation[2, 0] * px + rotation[2, 1] * py + rotation[2, 2] * pz,
    )


@compiled
def end_place(
    origin: tuple[float, float, float, float, float],
    path: Floats2,
    rotation: Floats2,
    edges: GridEdges,
) -> int:
    """Where a movement along `path` [steps, 3] ends: a cell, NEAR, or the way it left the grid.

    A movement that ends outside left where its path first did, at the side or beyond the range.
    """
    last = len(path) - 1
    x, y, z = _point(origin, path[last], rotation)
    place = locate_point(x, y, z, edges)
    if place >= 0 or place == NEAR:
        return place
    for step in range(last):
        x, y, z = _point(origin, path[step], rotation)
        first = locate_point(x, y, z, edges)
        if first in (OUT_SIDE, OUT_BEYOND):
            return first
    return place


@compiled
def expand(
    position: Floats2,
    yaw: Floats,
    attitude: Int32s,
    pieces: LatticePieces,
    rotation: Floats2,
    edges: GridEdges,
) -> tuple[Floats3, Floats2, Int32s2, Ints2]:
    """Children of nodes [n] by every movement [n, m]: position, yaw, attitude and place.

    Positions are in the level frame at yaw 0; see `end_place` for places, NOT_ALLOWED where the
    automaton forbids the movement, or where it changes nothing at all.
    """
    nodes, movements = len(yaw), pieces.following.shape[1]
    ends = np.empty((nodes, movements, 3))
    yaws = np.empty((nodes, movements))
    attitudes = np.empty((nodes, movements), dtype=np.int32)
    places = np.empty((nodes, movements), dtype=np.int64)
    for n in range(nodes):
        at = attitude[n]
        cosine, sine = np.cos(yaw[n]), np.sin(yaw[n])
        origin = (position[n, 0], position[n, 1], position[n, 2], cosine, sine)
        for m in range(movements):
            path = pieces.path[at, m]
            last = path[len(path) - 1]
            ends[n, m, 0] = position[n, 0] + cosine * last[0] - sine * last[1]
            ends[n, m, 1] = position[n, 1] + sine * last[0] + cosine * last[1]
            ends[n, m, 2] = position[n, 2] + last[2]
            yaws[n, m] = yaw[n] + pieces.turn_rad[at, m]
            attitudes[n, m] = pieces.following[at, m]
            places[n, m] = NOT_ALLOWED
            # What changes nothing leads nowhere new: the tree would only grow by it.
            idle = attitudes[n, m] == at and pieces.turn_rad[at, m] == 0.0
            idle = idle and pieces.length_m[at, m] == 0.0
            if attitudes[n, m] >= 0 and not idle:
                places[n, m] = end_place(origin, path, rotation, edges)
    return ends, yaws, attitudes, places


@compiled
def _chain(
    parent: Int32s, movement: Int16s, start: int, pieces: LatticePieces
) -> tuple[Int32s2, Int16s, Floats2, Floats2, Floats2]:
    """Attitude index, depth, (time, length) and (x, y, z, yaw) at the start and end of nodes.

    Starts and ends are [nodes, 4] in the level frame at yaw 0.
    """
    nodes = len(parent)
    attitude = np.empty((nodes, 2), dtype=np.int32)
    depth = np.ones(nodes, dtype=np.int16)
    flown = np.zeros((nodes, 2))
    starts, ends = np.zeros((nodes, 4)), np.empty((nodes, 4))
    for n in range(nodes):
        above, m = parent[n], movement[n]
        attitude[n, 0] = start
        if above >= 0:
            starts[n] = ends[above]
            attitude[n, 0] = attitude[above, 1]
            depth[n] = depth[above] + 1
            flown[n] = flown[above]
        at = attitude[n, 0]
        last = pieces.path[at, m, pieces.path.shape[2] - 1]
        cosine, sine = np.cos(starts[n, 3]), np.sin(starts[n, 3])
        ends[n, 0] = starts[n, 0] + cosine * last[0] - sine * last[1]
        ends[n, 1] = starts[n, 1] + sine * last[0] + cosine * last[1]
        ends[n, 2] = starts[n, 2] + last[2]
        ends[n, 3] = starts[n, 3] + pieces.turn_rad[at, m]
        attitude[n, 1] = pieces.following[at, m]
        flown[n, 0] += pieces.duration_s[m]
        flown[n, 1] += pieces.length_m[at, m]
    return attitude, depth, flown, starts, ends


@compiled
def _through_cells(
    parent: Int32s,
    movement: Int16s,
    attitude: Int32s2,
    starts: Floats2,
    pieces: LatticePieces,
    rotation: Floats2,
    edges: GridEdges,
    borders: CellBorders,
    search: CrossingSearch,
) -> tuple[Floats3, Int32s, Int32s, Int32s, Int8s]:
    """Samples, cells passed (CSR), cell and kind of exit at the end of every node."""
    nodes, steps = len(parent), pieces.path.shape[2]
    stride = steps // MOVEMENT_SAMPLES
    samples = np.empty((nodes, MOVEMENT_SAMPLES, 3))
    end_cell = np.full(nodes, -1, dtype=np.int32)
    exit_kind = np.zeros(nodes, dtype=np.int8)
    cell_start = np.zeros(nodes + 1, dtype=np.int32)
    cells = np.empty(4 * nodes + 64, dtype=np.int32)
    curve = np.empty(pieces.curve.shape[3:])
    filled = 0
    for n in range(nodes):
        path = pieces.path[attitude[n, 0], movement[n]]
        parts = pieces.curve[attitude[n, 0], movement[n]]
        yaw = starts[n, 3]
        origin = (starts[n, 0], starts[n, 1], starts[n, 2], np.cos(yaw), np.sin(yaw))
        for sample in range(MOVEMENT_SAMPLES):
            x, y, z = _point(origin, path[(sample + 1) * stride - 1], rotation)
            samples[n, sample, 0], samples[n, sample, 1], samples[n, sample, 2] = x, y, z
        # What stands where it is passes its own cell only: it may lie on many borders at once.
        moving = pieces.length_m[attitude[n, 0], movement[n]] > 0.0
        for part in range(len(parts) if moving else 0):
            for k in range(len(curve)):
                curve[k, 0], curve[k, 1], curve[k, 2] = _point(origin, parts[part, k], rotation)
            number = crossings(curve, borders, search)
            if filled + number + 2 > len(cells):
                cells = np.append(cells, np.empty(len(cells) + number, dtype=np.int32))
            before = 0.0
            for crossing in range(number + 1):
                after = search.crossings[crossing] if crossing < number else 1.0
                cell = cell_at(0.5 * (before + after), search, edges)
                before = after
                if cell >= 0 and not _has_passed(cell, n, filled, parent, cell_start, cells):
                    cells[filled] = cell
                    filled += 1
        place = end_place(origin, path, rotation, edges)
        if place >= 0 and not _has_passed(place, n, filled, parent, cell_start, cells):
            cells[filled] = place
            filled += 1
        cell_start[n + 1] = filled
        end_cell[n] = max(place, -1)
        exit_kind[n] = exit_of(place, edges)
    return samples, cell_start, cells[:filled].copy(), end_cell, exit_kind


@compiled
def exit_of(place: int, edges: GridEdges) -> int:
    """Kind of exit of a movement that ends at a place; 0 while under way."""
    if place == OUT_SIDE:
        return SIDE
    per_layer = (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    if place == OUT_BEYOND or place // per_layer == len(edges.range_m) - 2:
        return LAST_LAYER
    return 0


@compiled
def _has_passed(
    cell: int, node: int, filled: int, parent: Int32s, start: Int32s, cells: Int32s
) -> bool:
    """Whether `node` so far, or an ancestor, has passed the cell."""
    for at in range(start[node], filled):
        if cells[at] == cell:
            return True
    node = parent[node]
    while node >= 0:
        for at in range(start[node], start[node + 1]):
            if cells[at] == cell:
                return True
        node = parent[node]
    return False
