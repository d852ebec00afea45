"""When the vehicle is in a cell (5.2)-(5.4), and what of an intruder's time there falls together.

A cell without a passing trajectory has the empty interval, entry inf and leave -inf (the paper's
infinities are swapped), and no timed probability.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats3, Ints
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.traffic.models.borders import (
    CELL,
    ENTRY,
    LEAVE,
    Borders,
    compute_borders,
    scratch,
)
from clearway.traffic.models.cells import ModelCells
from clearway.traffic.models.half_lines import BUNCH, room_for_lines, tell
from clearway.traffic.models.traverse import cut_lines, pieces_of

CHORDS = 16
"""For each sample of a movement."""


@dataclass(frozen=True, slots=True, eq=False)
class VehicleTimes:
    """When the vehicle can be in each cell, from the decision time."""

    entry_s: FloatArray
    """[cells] earliest entry of any trajectory (5.3); inf where none passes."""
    leave_s: FloatArray
    """[cells] latest leave of any trajectory (5.4); -inf where none passes."""


class TimedTree(Protocol):
    """What vehicle times need of a reach set; `clearway.reach.tree.ReachSet` has it."""

    @property
    def grid(self) -> AvoidanceGrid: ...
    @property
    def parent(self) -> npt.NDArray[np.int32]: ...
    @property
    def end_time_s(self) -> FloatArray: ...
    @property
    def samples_m(self) -> FloatArray: ...
    @property
    def cell_start(self) -> npt.NDArray[np.int32]: ...
    @property
    def cell_index(self) -> npt.NDArray[np.int32]: ...


def radial_vehicle_times(grid: AvoidanceGrid, speed_mps: float) -> VehicleTimes:
    """Straight out from the origin at a speed: every cell of a layer at the same times.

    Raises ClearwayError unless the speed is positive and finite.
    """
    if not (np.isfinite(speed_mps) and speed_mps > 0.0):
        raise ClearwayError(f"vehicle speed_mps: must be a finite number > 0, got {speed_mps!r}")
    edge_s = grid.range_edges_m / speed_mps
    in_layer = grid.columns * grid.rows
    return VehicleTimes(np.repeat(edge_s[:-1], in_layer), np.repeat(edge_s[1:], in_layer))


def reach_set_vehicle_times(reach_set: TimedTree) -> VehicleTimes:
    """Earliest entry and latest leave over all trajectories of a reach set (5.3), (5.4).

    Along short chords of the curves through the samples, within a ten-thousandth of a movement; a
    cell that none of them passes gets the whole movement's time.
    """
    grid = reach_set.grid
    entry = np.full(grid.cells, np.inf)
    leave = np.full(grid.cells, -np.inf)
    _reach_set_times(
        np.ascontiguousarray(reach_set.parent, dtype=np.int64),
        np.ascontiguousarray(reach_set.end_time_s, dtype=np.float64),
        _between_samples(reach_set),
        np.ascontiguousarray(reach_set.cell_start, dtype=np.int64),
        np.ascontiguousarray(reach_set.cell_index, dtype=np.int64),
        compute_borders(grid),
        entry,
        leave,
    )
    return VehicleTimes(entry, leave)


def _between_samples(reach_set: TimedTree) -> FloatArray:
    """[nodes, points, 3] movements by CHORDS times as many points, at equal times, the last at
    the end; in between they are on the polynomial through a movement's start and samples."""
    samples = np.asarray(reach_set.samples_m, dtype=np.float64)
    ends = np.concatenate([samples[:, -1], np.zeros((1, 3))])  # Parent -1 is the start.
    known = np.concatenate([ends[reach_set.parent][:, None], samples], axis=1)
    at = np.arange(known.shape[1]) / samples.shape[1]
    points = np.arange(1, CHORDS * samples.shape[1] + 1) / (CHORDS * samples.shape[1])
    weights = np.array(
        [
            np.prod([(points - other) / (one - other) for other in at if other != one], axis=0)
            for one in at
        ]
    )
    return np.ascontiguousarray(np.einsum("kp,nkx->npx", weights, known))


@compiled
def _reach_set_times(
    parent: Ints,
    end_time_s: Floats,
    samples: Floats3,
    cell_start: Ints,
    cell_index: Ints,
    borders: Borders,
    entry: Floats,
    leave: Floats,
) -> None:
    lines, pieces = room_for_lines(borders), scratch(borders)
    met = np.full(len(entry), -1)
    steps = samples.shape[1]
    for node in range(len(parent)):
        above = parent[node]
        begin_s = end_time_s[above] if above >= 0 else 0.0
        x, y, z = samples[above, steps - 1] if above >= 0 else np.zeros(3)
        step_s = (end_time_s[node] - begin_s) / steps
        for first in range(0, steps, BUNCH):
            many = min(BUNCH, steps - first)
            for s in range(first, first + many):
                to_x, to_y, to_z = samples[node, s]
                velocity = ((to_x - x) / step_s, (to_y - y) / step_s, (to_z - z) / step_s)
                tell(lines, s - first, (x, y, z), velocity, step_s)
                x, y, z = to_x, to_y, to_z
            cut_lines(lines, many, borders)
            for s in range(many):
                offset_s = begin_s + (first + s) * step_s
                for m in range(pieces_of(lines, s, borders, pieces)):
                    cell = pieces.places[CELL, m]
                    met[cell] = node
                    entry[cell] = min(entry[cell], offset_s + pieces.times[ENTRY, m])
                    leave[cell] = max(leave[cell], offset_s + pieces.times[LEAVE, m])
        for m in range(cell_start[node], cell_start[node + 1]):
            cell = cell_index[m]
            if met[cell] != node:
                entry[cell] = min(entry[cell], begin_s)
                leave[cell] = max(leave[cell], end_time_s[node])


TimedRule = Callable[[ModelCells, VehicleTimes], FloatArray]
"""Timed probability of a model's cells; arrays of both broadcast, the vehicle's are [cells]."""


def share_of_vehicle_time(model: ModelCells, vehicle: VehicleTimes) -> FloatArray:
    """P_T times the share of the vehicle's interval that the intruder is there too (5.5)."""
    return model.probability * _ratio(_overlap(model, vehicle), vehicle.leave_s - vehicle.entry_s)


def share_of_intruder_time(model: ModelCells, vehicle: VehicleTimes) -> FloatArray:
    """P_T times the share of the intruder's interval that the vehicle is there too (5.6).

    The continuous form of the paper's count of hits; 0 for an intruder that stands still.
    """
    return model.probability * _ratio(_overlap(model, vehicle), model.leave_s - model.entry_s)


def share_of_shorter_time(model: ModelCells, vehicle: VehicleTimes) -> FloatArray:
    """P_T times the overlap over the shorter interval: 1 if one of them holds the other.

    At 15 m/s against 60 m/s rule (5.5) caps a certain conflict at a quarter; this does not.
    """
    shorter = np.fmin(model.leave_s - model.entry_s, vehicle.leave_s - vehicle.entry_s)
    return model.probability * _ratio(_overlap(model, vehicle), shorter)


def future_movement(model: ModelCells, vehicle: VehicleTimes) -> FloatArray:
    """(6.8) corrected: max(timed, P_T / 2 wherever the vehicle comes before the intruder is gone).

    It leaves only the cells behind the intruder free.
    """
    timed = share_of_vehicle_time(model, vehicle)
    return np.maximum(timed, 0.5 * model.probability * (vehicle.entry_s < model.leave_s))


def future_movement_printed(model: ModelCells, vehicle: VehicleTimes) -> FloatArray:
    """(6.8) as printed: its first branch is always 0, and its second halves real conflicts."""
    timed = share_of_vehicle_time(model, vehicle)
    return np.where(vehicle.entry_s < model.leave_s, 0.5 * model.probability, timed)


TIMED_RULES: dict[str, TimedRule] = {
    "vehicle": share_of_vehicle_time,
    "intruder": share_of_intruder_time,
    "shorter": share_of_shorter_time,
    "future": future_movement,
    "future-printed": future_movement_printed,
}
"""Timed rules by name; "vehicle" is the paper's (5.5)."""


def _overlap(model: ModelCells, vehicle: VehicleTimes) -> FloatArray:
    """Length of the common interval; 0 where there is none or the cell is not met."""
    together = np.minimum(model.leave_s, vehicle.leave_s) - np.maximum(
        model.entry_s, vehicle.entry_s
    )
    longest: FloatArray = np.fmax(together, 0.0)
    return longest


def _ratio(part: FloatArray, whole: FloatArray) -> FloatArray:
    result: FloatArray = np.zeros(np.broadcast_shapes(part.shape, whole.shape))
    np.divide(part, whole, out=result, where=(part > 0.0) & (whole > 0.0))
    return result
