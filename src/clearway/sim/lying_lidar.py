"""LiDARs that lie, for simulations: a wall that travels along ahead, or nothing at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.obstacles.world import World
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.simulate import simulate_scan

GHOST_SHARE = 0.5
"""Where the wall stands, as a share of the sensor's range."""

Lie = Callable[[Lidar, State], Scan]
"""What a LiDAR tells instead of the truth."""


def blind(lidar: Lidar, state: State) -> Scan:
    """No return, whatever is there: all seems free."""
    return Scan(np.zeros((0, 3)), state.time_s, sensor=lidar.name)


def ghost_wall(lidar: Lidar, state: State) -> Scan:
    """Every beam returns from half the range: a wall all over the field of view."""
    far = lidar.pattern.max_range_m
    return Scan(GHOST_SHARE * far * lidar.pattern.directions, state.time_s, sensor=lidar.name)


LIES: Mapping[str, Lie] = MappingProxyType({"blind": blind, "ghost-wall": ghost_wall})
"""By name."""


@dataclass(frozen=True, slots=True)
class LyingLidar:
    """A LiDAR that tells a lie by name from a time on; raises ClearwayError for other names."""

    lidar: Lidar
    lie: str
    from_s: float = 0.0

    def __post_init__(self) -> None:
        if self.lie not in LIES:
            raise ClearwayError(f"lie {self.lie!r}: valid lies are {', '.join(LIES)}")

    @property
    def name(self) -> str:
        return self.lidar.name

    def scan(self, world: World, state: State, rng: np.random.Generator) -> Scan:
        """What it tells; the truth before `from_s`."""
        if state.time_s < self.from_s:
            return simulate_scan(self.lidar, world, state, rng)
        return LIES[self.lie](self.lidar, state)
