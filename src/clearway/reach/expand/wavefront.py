"""Wave-front expansion (4.5.1): layer by layer, with a rule that says which nodes go on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import Lattice, grid_from_level, in_grid
from clearway.reach.expand.trace import NEAR, NOT_ALLOWED, OUT_BEYOND, OUT_SIDE, expand

MOST_NODES = 3_000_000


@dataclass(frozen=True, eq=False)
class Front:
    """Nodes that wait in one layer; what a keep rule may know of them."""

    grid: AvoidanceGrid
    mirror: tuple[int, ...] | None
    cell: IntArray
    """[n] flat cell of the node's end; `grid.cells` short of the first layer."""
    position_m: FloatArray
    """[n, 3] of the node's end, grid frame."""
    heading: FloatArray
    """[n, 3] unit vector of flight at the node's end, grid frame."""
    smooth: IntArray
    """[n] smooth movements in the buffer (def. 25)."""
    depth: IntArray
    """[n] movements in the buffer."""
    buffers: ByteArray
    """[n, movements deep] index of each movement + 1, 0 after the end."""
    expanded: IntArray
    """[cells + 1] nodes of each cell that have been expanded already."""


KeepRule = Callable[[Front], BoolArray]
"""Front -> [n] which nodes are expanded. It is asked again when children stay in the layer."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes under way, in the level frame at yaw 0."""

    position_m: FloatArray
    yaw_rad: FloatArray
    attitude: npt.NDArray[np.int32]
    place: IntArray
    buffers: ByteArray

    def __len__(self) -> int:
        return len(self.place)

    @property
    def depth(self) -> IntArray:
        """[n] movements in the buffer."""
        return np.asarray(np.count_nonzero(self.buffers, axis=1), dtype=np.int64)

    def pick(self, mask: BoolArray) -> Nodes:
        return Nodes(
            self.position_m[mask],
            self.yaw_rad[mask],
            self.attitude[mask],
            self.place[mask],
            self.buffers[mask],
        )

    def join(self, other: Nodes) -> Nodes:
        return Nodes(
            np.concatenate([self.position_m, other.position_m]),
            np.concatenate([self.yaw_rad, other.yaw_rad]),
            np.concatenate([self.attitude, other.attitude]),
            np.concatenate([self.place, other.place]),
            np.concatenate([self.buffers, other.buffers]),
        )


def trajectories(
    lattice: Lattice,
    grid: AvoidanceGrid,
    start_pitch_rad: float,
    deep: int,
    keep: KeepRule,
    *,
    side_exits: bool = True,
) -> ByteArray:
    """Buffers [trajectories, deep] of the complete trajectories that a keep rule leaves.

    States are constrained as in (3.7), def. 4: to the grid and to what the automaton allows.

    A movement's end in the last layer, beyond it, or outside through the side completes one. A
    child in the same layer waits again, a child in an earlier layer is dropped, and so is what
    is not complete after `deep` movements. The cells' budgets are given again for as long as
    nothing has come beyond the layer. Raises ClearwayError when the tree outgrows memory.
    """
    waiting = _children(_root(lattice, start_pitch_rad, deep), lattice, grid, start_pitch_rad)
    made = len(waiting)
    for layer in range(-1, grid.layers - 1):
        here = _layer_of(waiting, grid) == layer
        # A buffer that is full before the last layer is not complete and leads nowhere.
        front = waiting.pick(here & (waiting.depth < deep))
        waiting = waiting.pick(~here)
        expanded = np.zeros(grid.cells + 1, dtype=np.int64)
        gone_beyond = bool(np.any(waiting.place != OUT_SIDE))
        while len(front):
            chosen = keep(_front(front, lattice, grid, start_pitch_rad, expanded))
            going = front.pick(chosen)
            if not len(going):
                if gone_beyond or not np.any(expanded):
                    break
                # A layer thicker than a movement takes more than what one budget allows.
                expanded[:] = 0
                continue
            expanded += np.bincount(_cell_of(going, grid), minlength=grid.cells + 1)
            children = _children(going, lattice, grid, start_pitch_rad)
            made += len(children)
            if made > MOST_NODES:
                raise ClearwayError(
                    f"the reach set outgrows {MOST_NODES} nodes; take fewer layers or movements, "
                    "or a method that selects"
                )
            at = _layer_of(children, grid)
            stay = (at == layer) & (children.depth < deep)
            front = front.pick(~chosen).join(children.pick(stay))
            waiting = waiting.join(children.pick(at > layer))
            gone_beyond |= bool(np.any((at > layer) & (children.place != OUT_SIDE)))
    return waiting.pick((waiting.place != OUT_SIDE) | side_exits).buffers


def _root(lattice: Lattice, start_pitch_rad: float, deep: int) -> Nodes:
    return Nodes(
        np.zeros((1, 3)),
        np.zeros(1),
        np.array([lattice.start[start_pitch_rad]], dtype=np.int32),
        np.array([NEAR]),
        np.zeros((1, deep), dtype=np.uint8),
    )


def _children(nodes: Nodes, lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float) -> Nodes:
    """Every allowed movement of every node, in the order of nodes, then movements (4.29)."""
    ends, yaws, attitudes, places = expand(
        nodes.position_m,
        nodes.yaw_rad,
        nodes.attitude,
        lattice.pieces,
        grid_from_level(start_pitch_rad),
        grid.edges,
    )
    node, movement = np.nonzero(places != NOT_ALLOWED)
    buffers = nodes.buffers[node]
    buffers[np.arange(len(node)), nodes.depth[node]] = movement + 1
    at = (node, movement)
    return Nodes(ends[at], yaws[at], attitudes[at], places[at], buffers)


def _layer_of(nodes: Nodes, grid: AvoidanceGrid) -> IntArray:
    """Layer of each node's end: -1 short of the first one, `layers` where it has left the grid."""
    layer = nodes.place // (grid.columns * grid.rows)
    layer[nodes.place == NEAR] = -1
    layer[(nodes.place == OUT_SIDE) | (nodes.place == OUT_BEYOND)] = grid.layers
    return layer


def _cell_of(nodes: Nodes, grid: AvoidanceGrid) -> IntArray:
    return np.where(nodes.place >= 0, nodes.place, grid.cells)


def _front(
    nodes: Nodes,
    lattice: Lattice,
    grid: AvoidanceGrid,
    start_pitch_rad: float,
    expanded: IntArray,
) -> Front:
    smooth = np.array([False, *(movement.smooth for movement in lattice.automaton.movements)])
    rotation = grid_from_level(start_pitch_rad)
    pitch, yaw = lattice.pieces.attitude_rad[nodes.attitude, 1], nodes.yaw_rad
    level = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
    return Front(
        grid=grid,
        mirror=lattice.mirror,
        cell=_cell_of(nodes, grid),
        position_m=in_grid(nodes.position_m, rotation),
        heading=in_grid(np.stack(level, axis=1), rotation),
        smooth=np.count_nonzero(smooth[nodes.buffers], axis=1),
        depth=nodes.depth,
        buffers=nodes.buffers,
        expanded=expanded,
    )
