"""Simulated scans: rays cast from a mounted LiDAR into a world, with noise and drop-outs."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.obstacles.world import World
from clearway.sensors.lidar import Lidar, Scan


def sensor_pose(lidar: Lidar, state: State) -> tuple[FloatArray, FloatArray]:
    """Rotation [3, 3] world from sensor, and the sensor's position [3] in the world frame."""
    world_from_body = state.world_from_body
    origin = state.position_m + world_from_body @ lidar.mounting.position_m
    return world_from_body @ lidar.mounting.body_from_sensor, origin


class Scanner(Protocol):
    """What the simulator asks of a sensor that is no `Lidar`: the reading that it would give."""

    @property
    def name(self) -> str: ...

    def scan(self, world: World, state: State, rng: np.random.Generator) -> Scan:
        """One reading of the true world from a true state, in the sensor frame."""
        ...


def scanned(sensor: Lidar | Scanner, world: World, state: State, rng: np.random.Generator) -> Scan:
    """What a sensor returns from a state."""
    if isinstance(sensor, Lidar):
        return simulate_scan(sensor, world, state, rng)
    return sensor.scan(world, state, rng)


def simulate_scan(
    lidar: Lidar, world: World, state: State, seed: int | np.random.Generator = 0
) -> Scan:
    """One sweep from a state, all beams at once: first returns in the sensor frame.

    Ranges carry normal noise of the sensor's sigma along the beam, returns get lost with its
    drop-out probability; both are the same for the same seed. Returns nearer than the blind
    range or beyond the sensor's range do not come back.
    """
    rng = np.random.default_rng(seed)
    pattern = lidar.pattern
    rotation, origin = sensor_pose(lidar, state)
    directions = np.ascontiguousarray(pattern.directions @ rotation.T)
    ranges = world.cast(origin, directions, pattern.max_range_m)
    if lidar.sigma_m > 0.0:
        ranges = ranges + rng.normal(0.0, lidar.sigma_m, pattern.beams)
    returned = (
        np.isfinite(ranges)
        & (ranges > 0.0)
        & (ranges >= pattern.min_range_m)
        & (ranges <= pattern.max_range_m)
    )
    if lidar.dropout > 0.0:
        returned &= rng.random(pattern.beams) >= lidar.dropout
    points = ranges[returned, None] * pattern.directions[returned]
    return Scan(points, state.time_s, lidar.name)
