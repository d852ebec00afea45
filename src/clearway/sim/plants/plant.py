"""Plants: whatever truly moves when a movement is asked for.

A plant begins a movement and is stepped; it tells its state, and what its own sensors measure. How
it holds the movement, with which loops and at which rate, is its own business. Plants of users are
named `module:name` where those of clearway have a name.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from clearway.base.errors import ClearwayError, OwnCodeError
from clearway.base.frames import FloatArray
from clearway.base.own_code import guard_call
from clearway.sim.plants.air import Air
from clearway.sim.plants.led import Asked
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.copter import CopterLimits


class Plant(Protocol):
    """A vehicle as it truly moves."""

    def begin(self, movement: Movement) -> None:
        """From now on, hold a movement."""
        ...

    def step(self, duration_s: float) -> None:
        """Move on, by at most 0.05 s; finer steps are the plant's own."""
        ...

    @property
    def state(self) -> FloatArray:
        """[6] x, y, z, roll, pitch (nose down positive), yaw (left positive): world frame, z up."""
        ...

    @property
    def outputs(self) -> Mapping[str, float]:
        """What its own sensors measure besides, by name with the unit; may be empty."""
        ...


class LedPlant(Plant, Protocol):
    """A plant that follows a reference, as a vehicle with inertia is flown."""

    @property
    def lag_s(self) -> float:
        """How long before its time a change of the acceleration has to be known."""
        ...

    def follow(self, asked: Asked) -> None:
        """From now on, be where a reference says; `asked` tells it a time from now on."""
        ...


def leading(plant: Plant) -> LedPlant:
    """A plant that follows references; raises ClearwayError where it does not."""
    if not hasattr(plant, "follow"):
        raise ClearwayError(
            f"plant {type(plant).__name__}: a vehicle with inertia is led by references; give the "
            'plant a method `follow(asked)`, or fly kind = "inertialess"'
        )
    led: LedPlant = plant  # type: ignore[assignment]
    return led


MakePlant = Callable[[FloatArray, float, Air], Plant]
"""(state [6], speed along the path in m/s, air) -> a plant trimmed in straight and level flight, at
rest at 0 m/s."""
Moves = Callable[[FloatArray, FloatArray, float, FloatArray], FloatArray]
"""(state [6], inputs [4] or [5], duration in s, air [3] m/s) -> state: the plainest plant."""


@dataclass(frozen=True)
class PlantKind:
    """A kind of plant: how one is made, and what it is flown with."""

    about: str
    make: MakePlant
    movements: Callable[..., MovementAutomaton] | None = None
    """The movements that it is usually flown with, by closed form, for a `speed_mps` and a
    `duration_s` or by its own defaults; None where it has none of its own."""
    copter: CopterLimits | None = None
    """What it can do as a copter with inertia; None for what is none."""


@dataclass
class FunctionPlant:
    """A plant of one function."""

    moves: Moves
    at: FloatArray
    air: Air
    movement: Movement | None = None
    speed_mps: float = 0.0

    def begin(self, movement: Movement) -> None:
        self.movement, self.speed_mps = movement, movement.pace_mps

    def step(self, duration_s: float) -> None:
        assert self.movement is not None  # Whoever flies begins a movement first.
        air = self.air.step(duration_s, self.speed_mps, self.at[2], self.at[5])
        moved = np.asarray(self.moves(self.at, self.movement.inputs, duration_s, air), dtype=float)
        if moved.shape != (6,) or not np.all(np.isfinite(moved)):
            raise OwnCodeError("plant", f"gave {moved.tolist()}, no six finite numbers")
        self.at = moved

    @property
    def state(self) -> FloatArray:
        return self.at

    @property
    def outputs(self) -> Mapping[str, float]:
        return {}


def own_plant(label: str, found: Any) -> PlantKind:
    """A user's plant: a `PlantKind`, what makes one, or a function that moves a state.

    What makes one takes (state, speed_mps, air); a function takes (state, inputs, duration_s,
    air_mps). Either may have `movements`. Raises OwnCodeError for what is none of these.
    """
    if isinstance(found, PlantKind):
        return found
    about = (inspect.getdoc(found) or label).partition("\n")[0]
    if callable(found) and _takes(found, 3):
        make = guard_call(label, found)
        own = getattr(found, "movements", None), getattr(found, "copter", None)
        return PlantKind(about, make, *own)
    if callable(found) and _takes(found, 4):
        moves = guard_call(label, found)

        def of_function(state: FloatArray, _speed_mps: float, air: Air) -> Plant:
            return FunctionPlant(moves, np.array(state, dtype=np.float64), air)

        return PlantKind(about, of_function, getattr(found, "movements", None))
    raise OwnCodeError(
        label,
        "must take (state, speed_mps, air) and give a plant, or take (state, inputs, duration_s, "
        "air_mps) and give a state",
    )


def _takes(found: Callable[..., Any], number: int) -> bool:
    try:
        inspect.signature(found).bind(*range(number))
    except (TypeError, ValueError):
        return False
    return True
