"""The combined intersection model (5.35)-(5.37): chosen models, timed or not, several intruders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Bools, Floats, Floats2
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.traffic.intruder import Intruder
from clearway.traffic.models.body import body_cells
from clearway.traffic.models.cells import Accuracy, ModelCells, empty_arrays
from clearway.traffic.models.line import line_cells
from clearway.traffic.models.many import Intruders
from clearway.traffic.models.paper_lattice import lattice_cells
from clearway.traffic.models.spread import spread_cells
from clearway.traffic.models.timing import TIMED_RULES, VehicleTimes
from clearway.traffic.models.tube import tube_cells

IntersectionModel = Callable[[AvoidanceGrid, Sequence[Intruder], FloatArray, Accuracy], ModelCells]
"""Grid, intruders in its frame, up [3] and accuracy to what the model says, [n, cells]."""

MODELS: dict[str, IntersectionModel] = {
    "line": lambda grid, intruders, _up, _accuracy: line_cells(grid, intruders),
    "body": lambda grid, intruders, _up, accuracy: body_cells(grid, intruders, accuracy),
    "spread": spread_cells,
    "tube": lambda grid, intruders, _up, accuracy: tube_cells(grid, intruders, accuracy),
    "lattice": lambda grid, intruders, up, _accuracy: lattice_cells(grid, intruders, up),
}
"""Intersection models by name: the flags l, b and s of (5.36), and the paper's replacements."""

STRAIGHT_ON = ("line", "spread")
"""Models by which an intruder stays within a cone about its course."""
GRID_UP = (0.0, 0.0, 1.0)
SPARE_RAD = 0.02
"""By which the cone counts as wider, and the grid as larger, for all the rounding."""
TINY = 1e-300


class OfNear(NamedTuple):
    """What a model says of those that come near."""

    model: ModelCells
    near: BoolArray | None
    """[n] which of all they are; None where it is all."""

    def count_in(self, each: FloatArray, timed: bool) -> None:
        """Raise the probabilities of all [n, cells] to what this says, timed or not (5.36)."""
        model = self.model
        said = model.timed if timed and model.timed is not None else model.probability
        if self.near is None:
            np.maximum(each, said, out=each)
        else:
            each[self.near] = np.maximum(each[self.near], said)

    def of_all(self) -> ModelCells:
        """The cells of all intruders, of which those that stay away meet none."""
        model, near = self
        if near is None:
            return model
        arrays = empty_arrays(len(near), model.probability.shape[1])
        for every, some in zip(
            arrays, (model.probability, model.entry_s, model.leave_s, model.dwell_s), strict=True
        ):
            every[near] = some
        meeting = None
        if model.meeting is not None:
            meeting = np.zeros(arrays.probability.shape)
            meeting[near] = model.meeting
        return ModelCells(*arrays, meeting=meeting)


@dataclass(frozen=True, eq=False)
class IntruderCells:
    """What intruders mean for each cell of the grid; what explains it is put together when it is
    asked for."""

    probability: FloatArray
    """[cells] P_OI: probability of meeting any of them (5.37)."""
    each: FloatArray
    """[n, cells] the same of each intruder, the largest of its models (5.36)."""
    found: MappingProxyType[str, OfNear]
    """By model name, of those that come near."""

    __repr__ = brief

    @cached_property
    def models(self) -> MappingProxyType[str, ModelCells]:
        """By model name, arrays [n, cells]."""
        return MappingProxyType({name: found.of_all() for name, found in self.found.items()})

    @property
    def intruders(self) -> list[dict[str, ModelCells]]:
        """For each intruder its models by name, arrays [cells]."""
        return [
            {name: model.of(n) for name, model in self.models.items()}
            for n in range(len(self.each))
        ]


def assess_intruders(
    grid: AvoidanceGrid,
    intruders: Sequence[Intruder],
    models: Sequence[str] = ("line", "spread"),
    timed: bool | str = False,
    vehicle_times: VehicleTimes | None = None,
    up: npt.ArrayLike = GRID_UP,
    accuracy: Accuracy = "fast",
) -> IntruderCells:
    """Probability of meeting intruders in each cell (5.36), (5.37).

    Intruders are in the grid's frame at the decision time, `up` [3] is world up in it. `models`
    are names of MODELS. `timed` is False, a name of TIMED_RULES, or True for the paper's (5.5);
    it needs `vehicle_times`. With these given each model carries its timed probability even where
    `timed` is False. Raises ClearwayError naming the valid choices.
    """
    rule = _check_rule(models, timed, vehicle_times)
    direction = np.array(up, dtype=np.float64)
    if direction.shape != (3,) or not 0.0 < abs(direction).max() < np.inf:
        raise ClearwayError(f"up: a direction of 3 finite numbers is needed, got {up!r}")
    direction /= abs(direction).max()
    intruders = Intruders.of(intruders)
    near = may_meet(grid, intruders) if any(name in STRAIGHT_ON for name in models) else None
    coming = len(intruders) if near is None else int(np.count_nonzero(near))
    kept = intruders if near is None or coming == len(intruders) else intruders.where(near)
    each, met = np.zeros((len(intruders), grid.cells)), False
    assessed: dict[str, OfNear] = {}
    for name in models:
        if kept is intruders or name not in STRAIGHT_ON:
            found = OfNear(MODELS[name](grid, intruders, direction, accuracy), None)
        elif coming:
            found = OfNear(MODELS[name](grid, kept, direction, accuracy), near)
        else:
            found = OfNear(_of_nobody(name, grid), near)
        if vehicle_times is not None:
            model = found.of_all()
            found = OfNear(replace(model, timed=TIMED_RULES[rule](model, vehicle_times)), None)
        if len(found.model.probability):
            met = True
            found.count_in(each, bool(timed))
        assessed[name] = found
    probability = combine_intruders(each) if met else np.zeros(grid.cells)
    return IntruderCells(probability, each, MappingProxyType(assessed))


@lru_cache(maxsize=32)
def _of_nobody(name: str, grid: AvoidanceGrid) -> ModelCells:
    """What a model says where nobody comes: arrays [0, cells]."""
    return MODELS[name](grid, (), np.array(GRID_UP), "fast")


def may_meet(grid: AvoidanceGrid, intruders: Sequence[Intruder]) -> BoolArray:
    """[n] whether an intruder that flies straight on, within its spreads, may come into the grid:
    whether the cone about its course meets the ball about the vehicle that holds the grid."""
    among = Intruders.of(intruders)
    position, velocity = among.motions(grid.range_m)
    return _may_meet(position, velocity, among.spread_rad.copy(), grid.range_m)


@compiled
def _may_meet(position: Floats2, velocity: Floats2, spread: Floats2, range_m: float) -> Bools:
    met = np.ones(len(position), dtype=np.bool_)
    for n in range(len(position)):
        x, y, z = position[n, 0], position[n, 1], position[n, 2]
        vx, vy, vz = velocity[n, 0], velocity[n, 1], velocity[n, 2]
        away, speed = np.sqrt(x * x + y * y + z * z), np.sqrt(vx * vx + vy * vy + vz * vz)
        if not speed > 0.0:
            continue
        towards = -(x * vx + y * vy + z * vz) / max(away * speed, TINY)
        off = np.arccos(min(1.0, max(-1.0, towards)))
        beside = off - max(spread[n, 0], spread[n, 1]) - SPARE_RAD
        nearest = away * np.sin(max(beside, 0.0)) if beside < 0.5 * np.pi else away
        met[n] = not nearest > (1.0 + SPARE_RAD) * range_m
    return met


def combine_intruders(each: FloatArray) -> FloatArray:
    """Probability [cells] of meeting any of n intruders of [n, cells], 1 - prod(1 - P) (5.37)."""
    if len(each) == 1:
        return np.array(each[0])
    return _combine(np.ascontiguousarray(each))


@compiled
def _combine(each: Floats2) -> Floats:
    missed = np.ones(each.shape[1])
    for n in range(len(each)):
        for cell in range(each.shape[1]):
            missed[cell] *= 1.0 - each[n, cell]
    return 1.0 - missed


def _check_rule(
    models: Sequence[str], timed: bool | str, vehicle_times: VehicleTimes | None
) -> str:
    """Name of the timed rule; raises ClearwayError for unknown names and missing times."""
    unknown = [name for name in models if name not in MODELS]
    if isinstance(models, str) or unknown or not models:
        raise ClearwayError(
            f"intruder models: {models!r} are not all known; choose from {', '.join(MODELS)}"
        )
    rule = timed if isinstance(timed, str) else "vehicle"
    if rule not in TIMED_RULES:
        raise ClearwayError(
            f"timed rule: {timed!r} is not known; choose from {', '.join(TIMED_RULES)}"
        )
    if timed and vehicle_times is None:
        raise ClearwayError("timed intruders need vehicle_times")
    return rule
