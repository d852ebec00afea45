"""What leads a vehicle with inertia in the closed loop: the references of the pilot's plan."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sim.pilot import Pilot
from clearway.sim.plants.led import Asked
from clearway.sim.plants.plant import Plant, leading
from clearway.vehicle.movement import Movement
from clearway.vehicle.reference import Reference

SENSED_S = 0.1
"""Time between two scans, at most."""


class Guide:
    """Which movement is under way, how it is parted by scans, and what it asks of the vehicle.

    A pilot without `reference_at` is led along its movements, each from the planned end of the one
    before. One with `ahead_s` decides as long before a movement ends as the plant lags.
    """

    def __init__(self, pilot: Pilot[Any], plant: Plant) -> None:
        self._automaton = pilot.planner.automaton
        self._told = getattr(pilot, "reference_at", None)
        self._start: FloatArray = pilot.mission.start.vector
        self._movement: Movement | None = None
        self._began_s = self._ends_s = -np.inf
        if not self._automaton.has_inertia:
            return
        lasts_s = self._automaton.movements[0].duration_s
        self.part_s = lasts_s / np.ceil(lasts_s / SENSED_S - 1e-9)
        """Time between two scans: a whole part of a movement."""
        if hasattr(pilot, "ahead_s"):
            parts = np.ceil(leading(plant).lag_s / self.part_s - 1e-9)
            cast(Any, pilot).ahead_s = float(parts * self.part_s)

    def movement_at(self, now_s: float, movement: Movement, flown: list[str]) -> None:
        """A movement is under way now; one that begins is added to those that were flown."""
        begun = now_s >= self._ends_s - 1e-6
        if not begun and movement is self._movement:
            return
        if self._movement is not None and begun:
            self._start = self._automaton.predict(self._start, self._movement)
        flown.append(movement.name)
        self._movement, self._began_s = movement, now_s
        self._ends_s = now_s + movement.duration_s

    def ask_from(self, now_s: float) -> Asked:
        """What is asked a time from now on; past the plan's end, what it asks for there."""

        def ask(later_s: float) -> Reference:
            told = None if self._told is None else self._told(now_s + later_s)
            if told is not None:
                return cast(Reference, told)
            assert self._movement is not None  # Whoever flies has begun one.
            into_s = now_s + later_s - self._began_s
            return Reference.of(self._automaton, self._start, self._movement, into_s)

        return ask
