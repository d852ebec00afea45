"""What a reach set covers, measured: footprints, cells, smoothness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.reach.tree import LAST_LAYER, SIDE, ReachSet

Points = Literal["ends", "samples"]
"""Of which points of a trajectory a footprint is taken: movement ends, or samples between too."""


@dataclass(frozen=True)
class Coverage:
    """Figures of table 6.1, of the trajectories that end in the last layer and their nodes.

    Trajectories that leave through the side are counted apart, as they have no place in the
    paper's table.
    """

    nodes: int
    trajectories: int
    side_exits: int
    """Trajectories that leave through the side of the field of view."""
    nodes_with_side_exits: int
    """Nodes of the whole tree, as it flies."""
    footprints: int
    """Distinct footprints of movement end points: the size of (4.26), def. 23."""
    footprints_of_samples: int
    """The same of finer samples, four to a movement."""
    cells_covered: int
    """Distinct cells in which movements end."""
    smoothness: float
    """Mean share of smooth movements (4.28); 0 without a trajectory."""
    smoothness_worst: float


def measure_coverage(reach_set: ReachSet) -> Coverage:
    """Coverage of a reach set."""
    leaves = np.flatnonzero(reach_set.exit_kind == LAST_LAYER)
    nodes = leading_to(reach_set, leaves)
    cells = reach_set.end_cell[nodes]
    smooth = smoothness(reach_set, leaves)
    return Coverage(
        nodes=int(np.count_nonzero(nodes)),
        trajectories=len(leaves),
        side_exits=int(np.count_nonzero(reach_set.exit_kind == SIDE)),
        nodes_with_side_exits=reach_set.nodes,
        footprints=len(np.unique(footprint_labels(reach_set, leaves))),
        footprints_of_samples=len(np.unique(footprint_labels(reach_set, leaves, "samples"))),
        cells_covered=len(np.unique(cells[cells >= 0])),
        smoothness=float(np.mean(smooth)) if len(smooth) else 0.0,
        smoothness_worst=float(np.min(smooth)) if len(smooth) else 0.0,
    )


def leading_to(reach_set: ReachSet, leaves: IntArray) -> BoolArray:
    """[nodes] the leaves and their ancestors."""
    mask = np.zeros(reach_set.nodes, dtype=np.bool_)
    while len(leaves):
        mask[leaves] = True
        above = reach_set.parent[leaves]
        leaves = np.unique(above[above >= 0])
        leaves = leaves[~mask[leaves]]
    return mask


def footprint(reach_set: ReachSet, leaf: int, points: Points = "ends") -> tuple[int, ...]:
    """Q of a trajectory (4.25), def. 22: cells of its points in order, repeats collapsed."""
    row = _footprint_rows(reach_set, np.array([leaf]), points)[0]
    return tuple(int(cell) for cell in row if cell >= 0)


def footprint_labels(reach_set: ReachSet, leaves: IntArray, points: Points = "ends") -> IntArray:
    """[leaves] numbers that are equal where footprints are."""
    rows = np.ascontiguousarray(_footprint_rows(reach_set, leaves, points))
    whole = rows.view(f"V{rows.shape[1] * rows.itemsize}").ravel()
    _, labels = np.unique(whole, return_inverse=True)
    return np.asarray(labels.reshape(-1), dtype=np.int64)


def _footprint_rows(reach_set: ReachSet, leaves: IntArray, points: Points) -> npt.NDArray[np.int32]:
    """[leaves, points] cells of each footprint, then -1."""
    cells_of = reach_set.end_cell[:, None]
    if points == "samples":
        flat = reach_set.grid.cell_of(reach_set.samples_m.reshape(-1, 3))
        cells_of = flat.reshape(reach_set.samples_m.shape[:2]).astype(np.int32)
    deep = int(reach_set.depth.max(initial=1))
    cells = np.full((len(leaves), deep, cells_of.shape[1]), -1, dtype=np.int32)
    at = np.array(leaves, dtype=np.int64)
    for depth in range(deep, 0, -1):
        here = np.flatnonzero(at >= 0)
        here = here[reach_set.depth[at[here]] == depth]
        cells[here, depth - 1] = cells_of[at[here]]
        at[here] = reach_set.parent[at[here]]
    cells = _inside_first(cells.reshape(len(leaves), deep * cells_of.shape[1]))
    repeated = np.zeros(cells.shape, dtype=np.bool_)
    repeated[:, 1:] = cells[:, 1:] == cells[:, :-1]
    cells[repeated] = -1
    return _inside_first(cells)


def _inside_first(cells: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Rows with what is -1 at their ends, else in order."""
    order = np.argsort(cells < 0, axis=1, kind="stable")
    return np.take_along_axis(cells, order, axis=1)


def smoothness(reach_set: ReachSet, leaves: IntArray) -> FloatArray:
    """[leaves] share of smooth movements in each trajectory's buffer: (4.28), def. 25."""
    smooth = np.array(reach_set.movement_smooth, dtype=np.float64)[reach_set.movement]
    counts = np.zeros(reach_set.nodes)
    for node in range(reach_set.nodes):
        above = reach_set.parent[node]
        counts[node] = smooth[node] + (counts[above] if above >= 0 else 0.0)
    return counts[leaves] / reach_set.depth[leaves]
