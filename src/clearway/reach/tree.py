"""A reach set as flat arrays: every movement of every kept trajectory once, parents first."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray

LAST_LAYER = 1
SIDE = 2
BRIEF = 3
"""Kind of end of a trajectory that has fewer movements than others of a set by time."""


@dataclass(frozen=True, eq=False)
class ReachSet:
    """Trajectories in one grid for one start pitch (section 4.5), as a tree without its root.

    A node is one movement that follows its parent's. Positions are in the grid frame: the body
    frame at the start, where the vehicle sits at the origin with nose along x.

    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> reach_set = cw.build_reach_set(automaton, cw.AvoidanceGrid.uniform())
    >>> last = int(reach_set.trajectories[-1])
    >>> len(reach_set.movements_to(last)) == len(reach_set.path(last))
    True
    """

    grid: AvoidanceGrid
    start_pitch_rad: float
    _: KW_ONLY
    movement_names: tuple[str, ...]
    movement_smooth: tuple[bool, ...]
    """Per movement name: in the smooth set S of def. 25."""
    parent: npt.NDArray[np.int32]
    """[nodes] index of the parent, always smaller than the node's own; -1 below the root."""
    movement: npt.NDArray[np.int16]
    """[nodes] index into `movement_names`."""
    depth: npt.NDArray[np.int16]
    """[nodes] movements from the root, 1 for the first."""
    end_time_s: FloatArray
    """[nodes] time from the start to the end of the node's movement."""
    length_m: FloatArray
    """[nodes] length flown from the start to the end of the node's movement."""
    states: FloatArray
    """[nodes, 6] state at the end of the movement: position in the grid frame, attitude as the
    automaton counts it (pitch absolute, yaw from 0 at the start)."""
    samples_m: FloatArray
    """[nodes, samples, 3] positions along the movement at equal times, the last at its end."""
    sagitta_m: FloatArray
    """[nodes] how far the path may lie from the chords between consecutive samples."""
    cell_start: npt.NDArray[np.int32]
    """[nodes + 1] where a node's cells begin in `cell_index` (CSR)."""
    cell_index: npt.NDArray[np.int32]
    """[passed] flat cells that the movement enters and no ancestor has passed, in order."""
    end_cell: npt.NDArray[np.int32]
    """[nodes] cell of the end point; -1 where the movement ends outside the grid."""
    exit_kind: npt.NDArray[np.int8]
    """[nodes] 0 while under way, LAST_LAYER or SIDE where a trajectory is complete."""

    def __repr__(self) -> str:
        return one_line(
            "ReachSet",
            (
                f"{self.nodes:,} nodes",
                f"{len(self.trajectories):,} trajectories",
                f"to {self.grid.range_m:g} m",
                f"start pitch {np.degrees(self.start_pitch_rad):.3g} deg",
            ),
        )

    @property
    def nodes(self) -> int:
        return len(self.parent)

    @property
    def complete(self) -> BoolArray:
        """[nodes] nodes that end a trajectory: in the last layer or out through the side."""
        return np.not_equal(self.exit_kind, 0)

    @property
    def trajectories(self) -> IntArray:
        """[trajectories] nodes that end one."""
        return np.flatnonzero(self.exit_kind)

    def path(self, node: int) -> list[int]:
        """Return the nodes that lead to one.

        Parameters
        ----------
        node
            Index of the last.

        Returns
        -------
        list of int
            From below the root to `node`.

        Raises
        ------
        ClearwayError
            For what is no node.
        """
        if not isinstance(node, int | np.integer) or not -1 <= node < self.nodes:
            raise ClearwayError(f"node: one from 0 to {self.nodes - 1} is needed, got {node!r}")
        nodes, (parent, _) = [], self._steps
        while node >= 0:
            nodes.append(node)
            node = parent[node]
        return nodes[::-1]

    def node_of(self, movements: tuple[str, ...]) -> int:
        """Return the node that movements lead to from the start.

        Parameters
        ----------
        movements
            Their names, in order.

        Returns
        -------
        int
            Its index; -1 where no path has them.
        """
        node = -1
        if not isinstance(movements, tuple | list):
            raise ClearwayError(f"movements: a tuple of names is needed, got {movements!r}")
        for name in movements:
            if name not in self.movement_names:
                return -1
            movement = self.movement_names.index(name)
            found = np.flatnonzero((self.parent == node) & (self.movement == movement))
            if not len(found):
                return -1
            node = int(found[-1])
        return node

    def movements_to(self, node: int) -> tuple[str, ...]:
        """Return the movement buffer of a node.

        Parameters
        ----------
        node
            Its index.

        Returns
        -------
        tuple of str
            Names of the movements from the start to its end.
        """
        _, names = self._steps
        return tuple([names[n] for n in self.path(node)])

    @cached_property
    def _steps(self) -> tuple[list[int], list[str]]:
        """[nodes] parent and name of the movement: walked at every decision, where single numbers
        out of arrays would take longer than all the rest."""
        return self.parent.tolist(), [self.movement_names[m] for m in self.movement.tolist()]
