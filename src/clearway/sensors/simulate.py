"""Simulated scans: rays cast from a mounted LiDAR into a world, with noise and drop-outs."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.obstacles.world import World
from clearway.sensors.lidar import Lidar, Scan

NO_DRAWS = np.empty(0)


def sensor_pose(lidar: Lidar, state: State) -> tuple[FloatArray, FloatArray]:
    """Rotation [3, 3] world from sensor, and the sensor's position [3] in the world frame, which
    is the state's own, read only, where the sensor sits at the body's origin and along its axes."""
    world_from_body, mounting = state.world_from_body, lidar.mounting
    if mounting.is_body_frame:
        return world_from_body, state.position_m
    origin = state.position_m + world_from_body @ mounting.position_m
    return world_from_body @ mounting.body_from_sensor, origin


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
    # Beams that meet nothing have their draws too: the same seed, the same noise.
    noise = rng.standard_normal(pattern.beams) if lidar.sigma_m > 0.0 else NO_DRAWS
    luck = rng.random(pattern.beams) if lidar.dropout > 0.0 else NO_DRAWS
    points = _returns(
        pattern.directions,
        read_only(ranges),
        (float(pattern.min_range_m), float(pattern.max_range_m)),
        noise,
        float(lidar.sigma_m),
        luck,
        float(lidar.dropout),
    )
    return Scan(points, state.time_s, lidar.name)


@compiled
def _returns(
    directions: FloatArray,
    ranges: FloatArray,
    limits: tuple[float, float],
    noise: FloatArray,
    sigma: float,
    luck: FloatArray,
    dropout: float,
) -> FloatArray:
    """Points [returns, 3] of the beams [beams] that come back from a range between two limits.

    noise, luck: standard normal and uniform draws of all beams, none where they do not count.
    """
    least, farthest = limits
    measured = np.empty(len(ranges))
    beams = np.empty(len(ranges), dtype=np.int64)
    count = 0
    for beam in range(len(ranges)):
        far = ranges[beam]
        if not np.isfinite(far):
            continue
        if len(noise):
            far += sigma * noise[beam]
        if not (far > 0.0 and least <= far <= farthest):
            continue
        if len(luck) and luck[beam] < dropout:
            continue
        measured[count], beams[count] = far, beam
        count += 1
    points = np.empty((count, 3))
    for n in range(count):
        for axis in range(3):
            points[n, axis] = measured[n] * directions[beams[n], axis]
    return points
