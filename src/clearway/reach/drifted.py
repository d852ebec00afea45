"""A reach set carried by wind: every place moves on with the time that it takes to get there.

Movements stay what they are relative to the air. How far a path bends between samples at equal
times does not change, since wind carries the path and its chords alike. The cells that paths pass
are looked up anew, at places between the samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats3, Int32s
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import GridEdges, cell_of_point
from clearway.reach.tree import ReachSet

BETWEEN = 4
"""Places looked up from one sample to the next."""
Int32Array = npt.NDArray[np.int32]


def drift_reach_set(reach_set: ReachSet, wind_mps: FloatArray) -> ReachSet:
    """The same movements in air that moves; wind_mps: [3] grid frame.

    Which trajectories are complete stays: against the wind they end nearer.
    """
    samples, cell_start, cell_index, end_cell = _drift(
        reach_set.parent,
        reach_set.samples_m,
        reach_set.end_time_s,
        np.ascontiguousarray(wind_mps),
        reach_set.grid.edges,
    )
    states = reach_set.states.copy()
    states[:, :3] = samples[:, -1]
    return replace(
        reach_set,
        samples_m=samples,
        states=states,
        cell_start=cell_start,
        cell_index=cell_index,
        end_cell=end_cell,
    )


@compiled
def _drift(
    parent: Int32s,
    at_rest: Floats3,
    end_time_s: Floats,
    wind: Floats,
    edges: GridEdges,
) -> tuple[Floats3, Int32s, Int32s, Int32s]:
    nodes, count = at_rest.shape[0], at_rest.shape[1]
    samples = np.empty_like(at_rest)
    cell_start = np.zeros(nodes + 1, dtype=np.int32)
    cells = np.empty(nodes * count * BETWEEN, dtype=np.int32)
    end_cell = np.full(nodes, -1, dtype=np.int32)
    cell_count = (
        (len(edges.range_m) - 1) * (len(edges.azimuth_rad) - 1) * (len(edges.elevation_rad) - 1)
    )
    # The last node whose path was found to pass a cell, and whether it is on this path.
    passed_by = np.full(cell_count, -1, dtype=np.int64)
    filled = 0
    before = np.zeros(3)
    for n in range(nodes):
        p = parent[n]
        begins_s = 0.0
        before[:] = 0.0
        if p >= 0:
            begins_s = end_time_s[p]
            before[:] = samples[p, count - 1]
        above = p
        while above >= 0:
            for at in range(cell_start[above], cell_start[above + 1]):
                passed_by[cells[at]] = n
            above = parent[above]
        for s in range(count):
            time = begins_s + (end_time_s[n] - begins_s) * (s + 1) / count
            for axis in range(3):
                samples[n, s, axis] = at_rest[n, s, axis] + wind[axis] * time
            for part in range(1, BETWEEN + 1):
                share = part / BETWEEN
                x = before[0] + share * (samples[n, s, 0] - before[0])
                y = before[1] + share * (samples[n, s, 1] - before[1])
                z = before[2] + share * (samples[n, s, 2] - before[2])
                cell = cell_of_point(x, y, z, edges)
                if cell >= 0 and passed_by[cell] != n:
                    passed_by[cell] = n
                    cells[filled] = cell
                    filled += 1
                if s == count - 1 and part == BETWEEN:
                    end_cell[n] = cell if cell >= 0 else -1
            before[:] = samples[n, s]
        cell_start[n + 1] = filled
    return samples, cell_start, cells[:filled].copy(), end_cell
