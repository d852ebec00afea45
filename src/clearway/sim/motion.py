"""The track of a plant: how the simulated vehicle truly moved, movement by movement, in steps."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sim.plants.led import Asked
from clearway.sim.plants.plant import Plant, leading
from clearway.vehicle.automaton import Movement


class TrueMotion:
    """The track that a plant has flown up to now."""

    def __init__(self, plant: Plant, start_s: float, step_s: float) -> None:
        self.plant = plant
        self.times = [start_s]
        self.states = [np.array(plant.state)]
        """Each [6], world frame."""
        self.movements: list[str] = []
        self._step_s = step_s

    @property
    def corrections(self) -> int:
        """Movements flown with corrected turn rates, of plants that correct themselves so."""
        return int(getattr(self.plant, "corrections", 0))

    @property
    def now_s(self) -> float:
        return self.times[-1]

    @property
    def state(self) -> State:
        """Where the vehicle truly is."""
        return State(self.states[-1][:3], self.states[-1][3:], time_s=self.times[-1])

    def at(self, time_s: float) -> State:
        """Where it truly was at the first step from a time on."""
        n = min(bisect_left(self.times, time_s - 1e-9), len(self.states) - 1)
        return State(self.states[n][:3], self.states[n][3:], time_s=self.times[n])

    @property
    def velocity_mps(self) -> FloatArray | None:
        """[3] over the last step, world frame; None before there was one."""
        if len(self.times) < 2:
            return None
        moved = self.states[-1][:3] - self.states[-2][:3]
        velocity: FloatArray = moved / (self.times[-1] - self.times[-2])
        return velocity

    def fly(self, movement: Movement) -> Iterator[None]:
        """Execute one movement, step by step; the caller may stop it in the middle."""
        self.movements.append(movement.name)
        self.plant.begin(movement)
        yield from self._steps(movement.duration_s)

    def follow(self, asked: Asked, duration_s: float) -> Iterator[None]:
        """Follow a reference for a time, step by step; raises ClearwayError where the plant knows
        constant inputs alone."""
        leading(self.plant).follow(asked)
        yield from self._steps(duration_s)

    def _steps(self, duration_s: float) -> Iterator[None]:
        steps = int(np.ceil(duration_s / self._step_s - 1e-9))
        step = duration_s / steps
        start = self.times[-1]
        for number in range(1, steps + 1):
            self.plant.step(step)
            self.states.append(np.array(self.plant.state))
            self.times.append(start + number * step)
            yield
