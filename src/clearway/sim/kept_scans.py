"""Sensors whose readings are kept for later, as they give them: before faults on the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.state import State
from clearway.obstacles.world import World
from clearway.sensors.lidar import Lidar, Scan
from clearway.sensors.simulate import Scanner, scanned


@dataclass(frozen=True, slots=True)
class KeepingScanner:
    """A sensor as it is, that adds every reading to a list."""

    sensor: Lidar | Scanner
    kept: list[Scan]

    @property
    def name(self) -> str:
        return self.sensor.name

    def scan(self, world: World, state: State, rng: np.random.Generator) -> Scan:
        """The sensor's own reading."""
        reading = scanned(self.sensor, world, state, rng)
        self.kept.append(reading)
        return reading
