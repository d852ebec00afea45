"""Movement buffers flown once more: where they are complete, and the states at their ends."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats2, Ints, UInt8s2
from clearway.base.compiled import compiled
from clearway.base.grid import AvoidanceGrid, GridEdges
from clearway.reach.expand.buffers import ByteArray, keys_of, unpack_keys
from clearway.reach.expand.lattice import Lattice, LatticePieces, grid_from_level
from clearway.reach.expand.trace import end_place, exit_of


def complete_buffers(
    buffers: ByteArray, lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float
) -> ByteArray:
    """The buffers [n, deep], each cut where its trajectory is complete; each result once.

    Left out are those that are not complete at their end, or that hold a forbidden movement.
    """
    lengths = _cut_lengths(
        np.ascontiguousarray(buffers),
        lattice.start[start_pitch_rad],
        lattice.pieces,
        grid_from_level(start_pitch_rad),
        grid.edges,
    )
    cut = np.where(np.arange(buffers.shape[1]) < lengths[:, None], buffers, 0)[lengths > 0]
    return unpack_keys(np.unique(keys_of(cut.astype(np.uint8))), buffers.shape[1])


@compiled
def _cut_lengths(
    buffers: UInt8s2, start: int, pieces: LatticePieces, rotation: Floats2, edges: GridEdges
) -> Ints:
    """[n] movements until a buffer's trajectory is complete; 0 if it never is."""
    lengths = np.zeros(len(buffers), dtype=np.int64)
    for n in range(len(buffers)):
        x, y, z, yaw = 0.0, 0.0, 0.0, 0.0
        at = start
        for depth in range(buffers.shape[1]):
            m = np.int64(buffers[n, depth]) - 1
            if m < 0 or pieces.following[at, m] < 0:
                break
            path = pieces.path[at, m]
            cosine, sine = np.cos(yaw), np.sin(yaw)
            if exit_of(end_place((x, y, z, cosine, sine), path, rotation, edges), edges) != 0:
                lengths[n] = depth + 1
                break
            last = path[len(path) - 1]
            x, y, z = (
                x + cosine * last[0] - sine * last[1],
                y + sine * last[0] + cosine * last[1],
                z + last[2],
            )
            yaw += pieces.turn_rad[at, m]
            at = pieces.following[at, m]
    return lengths


@compiled
def level_states(buffers: UInt8s2, start: int, pieces: LatticePieces) -> tuple[Floats2, Ints]:
    """x, y, z, yaw [n, 4] in the level frame and attitude [n] at the end of buffers [n, deep]."""
    states = np.zeros((len(buffers), 4))
    attitude = np.full(len(buffers), start, dtype=np.int64)
    for n in range(len(buffers)):
        x, y, z, yaw = 0.0, 0.0, 0.0, 0.0
        at = start
        for depth in range(buffers.shape[1]):
            if buffers[n, depth] == 0:
                break
            m = np.int64(buffers[n, depth]) - 1
            path = pieces.path[at, m]
            last = path[len(path) - 1]
            cosine, sine = np.cos(yaw), np.sin(yaw)
            x += cosine * last[0] - sine * last[1]
            y += sine * last[0] + cosine * last[1]
            z += last[2]
            yaw += pieces.turn_rad[at, m]
            at = pieces.following[at, m]
        states[n, 0], states[n, 1], states[n, 2], states[n, 3] = x, y, z, yaw
        attitude[n] = at
    return states, attitude
