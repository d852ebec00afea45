"""Many intruders at once: what every decision works out for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.brief import brief
from clearway.base.compiled import compiled, read_only, seal
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, State
from clearway.traffic.intruder import Intruder

STANDING = 1e-10
"""Ranges of the grid a second; what is slower stands still."""

# Columns of the numbers that are reported of each.
RADIUS = 0
TIME = 1
POSITION_STD = 2
VELOCITY_STD = 3
BOUND = 4
MANOEUVRE = 5


@dataclass(frozen=True, eq=False)
class Intruders(Sequence[Intruder]):
    """Many intruders as arrays, one row each; one by one they are made when they are asked for.

    Decisions ask for few of them, but for the arrays several times.
    """

    told: Sequence[Intruder]
    """Each as it was reported: all of it but place, velocity and time, if it was moved since."""
    position_m: FloatArray
    """[n, 3] read only."""
    velocity_mps: FloatArray
    """[n, 3] read only."""
    spread_rad: FloatArray
    """[n, 2] read only."""
    numbers: FloatArray
    """[n, 6] read only: what else is known of each, in m and s; a bound that is not is 0."""
    moved: bool = False
    """Whether they are seen elsewhere than they were reported, at another time."""

    __repr__ = brief

    @classmethod
    def of(cls, intruders: Sequence[Intruder]) -> Intruders:
        """The same as arrays, worked out unless they are there."""
        if isinstance(intruders, Intruders):
            return intruders
        if not intruders:
            return cls(intruders, *NOBODY)
        return cls(
            intruders,
            _rows([i.position_m for i in intruders], 3),
            _rows([i.velocity_mps for i in intruders], 3),
            _rows([i.spread_rad for i in intruders], 2),
            seal(np.array([_numbers_of(each) for each in intruders], dtype=np.float64)),
        )

    @overload
    def __getitem__(self, index: int) -> Intruder: ...

    @overload
    def __getitem__(self, index: slice) -> list[Intruder]: ...

    def __getitem__(self, index: int | slice) -> Intruder | list[Intruder]:
        if isinstance(index, slice):
            return [self[n] for n in range(*index.indices(len(self)))]
        if not self.moved:
            return self.told[index]
        numbers = self.numbers[index].tolist()
        return self.told[index].move(
            self.position_m[index], self.velocity_mps[index], numbers[POSITION_STD], numbers[TIME]
        )

    def __len__(self) -> int:
        return len(self.told)

    def where(self, kept: BoolArray) -> Intruders:
        """[n] those marked."""
        return Intruders.of([self[n] for n in np.flatnonzero(kept).tolist()])

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(intruder.name for intruder in self.told)

    @cached_property
    def _widens(self) -> FloatArray:
        """[n] growth of the wider spread by speed: by tan, so that all of it is covered."""
        growth: FloatArray = np.tan(self.spread_rad.max(axis=1, initial=0.0))
        return growth

    def motions(self, range_m: float) -> tuple[FloatArray, FloatArray]:
        """Positions [n, 3] and velocities [n, 3], as compiled loops take them, to be read only.

        One that takes ages to pass a grid of such a range stands still.
        """
        known = self._motions
        if range_m not in known:
            least_mps = STANDING * range_m
            known[range_m] = _motions(self.position_m, self.velocity_mps, least_mps)
        return known[range_m]

    @cached_property
    def _motions(self) -> dict[float, tuple[FloatArray, FloatArray]]:
        """By the range of a grid."""
        return {}

    def see_at(self, state: State, world_from_body: FloatArray) -> Intruders:
        """Each predicted to the time of a state (`Intruder.at`) and seen from it (`seen_from`).

        world_from_body: [3, 3] the state's rotation, worked out once.
        """
        here = map(read_only, (state.position_m, world_from_body))
        told = (self.position_m, self.velocity_mps, self.numbers)
        position, velocity, numbers = map(seal, _see(*told, float(state.time_s), *here))
        return Intruders(self.told, position, velocity, self.spread_rad, numbers, moved=True)

    def balls(
        self, velocity_mps: FloatArray, time_s: float, sigmas: float, horizon_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """[n] radius of a ball around each at a time that holds it wherever it has deviated to
        since it was reported, and [n] how fast that grows from then on.

        The wider of its spreads or what its acceleration bound allows, plus `sigmas` standard
        deviations of the predicted position; as growth a bound counts by what it allows at the
        horizon. velocity_mps: [n, 3] as it is seen at that time.
        """
        about = (float(time_s), float(sigmas), float(horizon_s))
        return _balls(self.velocity_mps, velocity_mps, self._widens, self.numbers, *about)


def _numbers_of(told: Intruder) -> tuple[float, ...]:
    """In the order of the columns."""
    return (
        told.radius_m,
        told.time_s,
        told.position_std_m,
        told.velocity_std_mps,
        told.acceleration_bound_mps2 or 0.0,
        told.manoeuvre_mps2,
    )


def _rows(vectors: Sequence[FloatArray], length: int) -> FloatArray:
    """[n, length], read only."""
    rows = np.concatenate([np.zeros(0), *vectors]).reshape(-1, length)
    rows.flags.writeable = False
    return rows


NOBODY = _rows([], 3), _rows([], 3), _rows([], 2), _rows([], 6)


@compiled
def _motions(position: Floats2, velocity: Floats2, least_mps: float) -> tuple[Floats2, Floats2]:
    """Positions, and velocities of what is not slower than the least."""
    moving = velocity.copy()
    for n in range(len(velocity)):
        if _speed(velocity, n) < least_mps:
            moving[n] = 0.0
    return position.copy(), moving


@compiled
def _see(
    position: Floats2,
    velocity: Floats2,
    numbers: Floats2,
    time_s: float,
    origin: Floats,
    world_from_body: Floats2,
) -> tuple[Floats2, Floats2, Floats2]:
    """Places [n, 3] at a time and velocities [n, 3], seen from a body, and numbers [n, 6] then."""
    place, turned = np.empty((len(numbers), 3)), np.empty((len(numbers), 3))
    then = numbers.copy()
    then[:, TIME] = time_s
    for n in range(len(numbers)):
        elapsed_s = time_s - numbers[n, TIME]
        vx, vy, vz = velocity[n, 0], velocity[n, 1], velocity[n, 2]
        x = position[n, 0] + vx * elapsed_s - origin[0]
        y = position[n, 1] + vy * elapsed_s - origin[1]
        z = position[n, 2] + vz * elapsed_s - origin[2]
        for axis in range(3):
            i, j, k = world_from_body[0, axis], world_from_body[1, axis], world_from_body[2, axis]
            place[n, axis] = x * i + y * j + z * k
            turned[n, axis] = vx * i + vy * j + vz * k
        std_m = np.hypot(numbers[n, POSITION_STD], numbers[n, VELOCITY_STD] * elapsed_s)
        then[n, POSITION_STD] = std_m
    return place, turned, then


@compiled
def _balls(
    told_mps: Floats2,
    seen_mps: Floats2,
    widens: Floats,
    numbers: Floats2,
    time_s: float,
    sigmas: float,
    horizon_s: float,
) -> tuple[Floats, Floats]:
    """Radii and growths [n], as of `Intruders.balls`."""
    radius, growth = np.empty(len(numbers)), np.empty(len(numbers))
    for n in range(len(numbers)):
        elapsed_s = abs(time_s - numbers[n, TIME])
        bound, velocity_std = numbers[n, BOUND], numbers[n, VELOCITY_STD]
        turned = 0.5 * max(bound, numbers[n, MANOEUVRE]) * elapsed_s**2
        std_m = np.hypot(numbers[n, POSITION_STD], velocity_std * elapsed_s)
        spread = widens[n] * _speed(told_mps, n) * elapsed_s
        radius[n] = numbers[n, RADIUS] + (max(spread, turned) + sigmas * std_m)
        turning = 0.5 * horizon_s * bound
        growth[n] = widens[n] * _speed(seen_mps, n) + sigmas * velocity_std + turning
    return radius, growth


@compiled
def _speed(velocity: Floats2, n: int) -> float:
    vx, vy, vz = velocity[n, 0], velocity[n, 1], velocity[n, 2]
    return float(np.sqrt(vx * vx + vy * vy + vz * vz))
