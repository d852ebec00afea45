"""Many intruders at once: what every decision works out for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np

from clearway.base.brief import brief
from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, State
from clearway.traffic.intruder import Intruder

STANDING = 1e-10
"""Ranges of the grid a second; what is slower stands still."""


@dataclass(frozen=True, eq=False)
class Intruders(Sequence[Intruder]):
    """Many intruders as arrays, one row each; one by one they are made when they are asked for.

    Decisions ask for few of them, but for the arrays several times.
    """

    told: Sequence[Intruder]
    """Each as it was told: all of it but place, velocity and time, if it was moved since."""
    position_m: FloatArray
    """[n, 3] read only."""
    velocity_mps: FloatArray
    """[n, 3] read only."""
    spread_rad: FloatArray
    """[n, 2] read only."""
    moved: tuple[list[float], float] | None = None
    """Where they are seen elsewhere than they were told: standard deviations of their positions
    (m), and the time (s)."""

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
        )

    @overload
    def __getitem__(self, index: int) -> Intruder: ...

    @overload
    def __getitem__(self, index: slice) -> list[Intruder]: ...

    def __getitem__(self, index: int | slice) -> Intruder | list[Intruder]:
        if isinstance(index, slice):
            return [self[n] for n in range(*index.indices(len(self)))]
        if self.moved is None:
            return self.told[index]
        std_m, time_s = self.moved
        return self.told[index].moved(
            self.position_m[index], self.velocity_mps[index], std_m[index], time_s
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
    def speed_mps(self) -> FloatArray:
        """[n]"""
        speed: FloatArray = np.sqrt(np.square(self.velocity_mps).sum(axis=1))
        return speed

    @cached_property
    def position_std_m(self) -> FloatArray:
        """[n]"""
        return np.array(self.moved[0] if self.moved else [i.position_std_m for i in self.told])

    @cached_property
    def velocity_std_mps(self) -> FloatArray:
        """[n]"""
        return np.array([i.velocity_std_mps for i in self.told])

    @cached_property
    def spread_mps(self) -> FloatArray:
        """[n] growth of the wider spread: by tan, so that all of the stated spread is covered."""
        growth: FloatArray = np.tan(self.spread_rad.max(axis=1, initial=0.0)) * self.speed_mps
        return growth

    def ages_s(self, time_s: float) -> FloatArray:
        """[n] how long before a time each was where it is said to be."""
        times_s = [self.moved[1]] * len(self) if self.moved else [i.time_s for i in self.told]
        return time_s - np.array(times_s)

    def motions(self, range_m: float) -> tuple[FloatArray, FloatArray]:
        """Positions [n, 3] and velocities [n, 3], as compiled loops take them.

        One that takes ages to pass a grid of such a range stands still.
        """
        velocity = self.velocity_mps.copy()
        velocity[self.speed_mps < STANDING * range_m] = 0.0
        return self.position_m.copy(), velocity

    def seen_at(self, state: State, world_from_body: FloatArray) -> Intruders:
        """Each predicted to the time of a state (`Intruder.at`) and seen from it (`seen_from`).

        world_from_body: [3, 3] the state's rotation, worked out once.
        """
        if not self.told:
            return Intruders(self.told, *NOBODY, ([], state.time_s))
        elapsed, here = self.ages_s(state.time_s), (state.position_m, world_from_body)
        position, velocity = _seen(
            self.position_m, self.velocity_mps, elapsed, *map(read_only, here)
        )
        position.flags.writeable = velocity.flags.writeable = False
        std = np.hypot(self.position_std_m, self.velocity_std_mps * elapsed)
        moved = std.tolist(), state.time_s
        return Intruders(self.told, position, velocity, self.spread_rad, moved)

    def deviations_m(self, elapsed_s: FloatArray, sigmas: float = 0.0) -> FloatArray:
        """[n] how far from its straight path each may be after a while, [n] seconds of either sign.

        The wider of its spreads or what its acceleration bound allows, plus `sigmas` standard
        deviations of the predicted position.
        """
        elapsed = np.abs(elapsed_s)
        bounds = [max(i.acceleration_bound_mps2 or 0.0, i.manoeuvre_mps2) for i in self.told]
        turned = 0.5 * np.array(bounds) * elapsed**2
        std = np.hypot(self.position_std_m, self.velocity_std_mps * elapsed)
        deviations: FloatArray = np.maximum(self.spread_mps * elapsed, turned) + sigmas * std
        return deviations


def _rows(vectors: Sequence[FloatArray], length: int) -> FloatArray:
    """[n, length], read only."""
    rows = np.concatenate([np.zeros(0), *vectors]).reshape(-1, length)
    rows.flags.writeable = False
    return rows


NOBODY = _rows([], 3), _rows([], 3), _rows([], 2)


@compiled
def _seen(
    position: FloatArray,
    velocity: FloatArray,
    elapsed: FloatArray,
    origin: FloatArray,
    world_from_body: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Places [n, 3], flown on for some time [n], and velocities [n, 3], seen from a body."""
    place, turned = np.empty((len(elapsed), 3)), np.empty((len(elapsed), 3))
    for n in range(len(elapsed)):
        vx, vy, vz = velocity[n, 0], velocity[n, 1], velocity[n, 2]
        x = position[n, 0] + vx * elapsed[n] - origin[0]
        y = position[n, 1] + vy * elapsed[n] - origin[1]
        z = position[n, 2] + vz * elapsed[n] - origin[2]
        for axis in range(3):
            i, j, k = world_from_body[0, axis], world_from_body[1, axis], world_from_body[2, axis]
            place[n, axis] = x * i + y * j + z * k
            turned[n, axis] = vx * i + vy * j + vz * k
    return place, turned
