"""Sensors whose readings are kept for later, as they give them: before faults on the way."""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from clearway.base.state import State
from clearway.obstacles.world import World
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.simulate import Scanner, scan_world


class TakesScans(Protocol):
    """Whatever readings can be added to, such as a list."""

    def append(self, scan: Scan, /) -> None: ...


class ScanFile:
    """Readings in a temporary file, which nobody else sees: those of an hour are gigabytes."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed with this object.
        self._count = 0

    def append(self, scan: Scan, /) -> None:
        """Add a reading at the end."""
        self._file.seek(0, 2)
        pickle.dump(scan, self._file, pickle.HIGHEST_PROTOCOL)
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[Scan]:
        self._file.seek(0)
        for _ in range(self._count):
            yield pickle.load(self._file)

    def __del__(self) -> None:
        self._file.close()


@dataclass(frozen=True, slots=True)
class KeepingScanner:
    """A sensor as it is, that adds every reading to what keeps them."""

    sensor: Lidar | Scanner
    kept: TakesScans

    @property
    def name(self) -> str:
        return self.sensor.name

    def scan(self, world: World, state: State, rng: np.random.Generator) -> Scan:
        """The sensor's own reading."""
        reading = scan_world(self.sensor, world, state, rng)
        self.kept.append(reading)
        return reading
