"""Simulated scans: rays cast from a mounted LiDAR into a world, with noise and drop-outs."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled, read_only
from clearway.base.frames import FloatArray
from clearway.base.rounding import SURELY
from clearway.base.state import State
from clearway.obstacles.world import World
from clearway.sensors.beams.lidar import Lidar, Scan

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


def scan_world(
    sensor: Lidar | Scanner, world: World, state: State, rng: np.random.Generator
) -> Scan:
    """What a sensor returns from a state."""
    if isinstance(sensor, Lidar):
        return simulate_scan(sensor, world, state, rng)
    return sensor.scan(world, state, rng)


def simulate_scan(
    lidar: Lidar, world: World, state: State, seed: int | np.random.Generator = 0
) -> Scan:
    """One sweep from a state, all beams at once: first returns in the sensor frame.

    Ranges carry normal noise of the sensor's sigma along the beam, returns get lost with its
    drop-out probability; both are drawn for beams that meet something, and are the same for the
    same seed. Returns nearer than the blind range or beyond the sensor's range do not come back.
    A false return takes the place of what its beam would have met.
    """
    rng = np.random.default_rng(seed)
    pattern = lidar.pattern
    rotation, origin = sensor_pose(lidar, state)
    if _meets_nothing(world, origin, pattern.max_range_m):
        if lidar.false_returns == 0.0:
            return Scan(np.zeros((0, 3)), state.time_s, sensor=lidar.name)
        ranges = np.full(pattern.beams, np.inf)
    else:
        directions = _turn(pattern.directions, read_only(rotation))
        ranges = read_only(world.cast(origin, directions, pattern.max_range_m))
    if lidar.false_returns > 0.0:
        ranges = _with_false(lidar, ranges, rng)
    met = int(np.count_nonzero(np.isfinite(ranges)))
    points = _returns(
        pattern.directions,
        ranges,
        (float(pattern.min_range_m), float(pattern.max_range_m)),
        rng.standard_normal(met) if lidar.sigma_m > 0.0 else NO_DRAWS,
        float(lidar.sigma_m),
        rng.random(met) if lidar.dropout > 0.0 else NO_DRAWS,
        float(lidar.dropout),
    )
    return Scan(points, state.time_s, sensor=lidar.name)


def _with_false(lidar: Lidar, ranges: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return ranges [beams] of which a share is drawn evenly from the sensor's whole range."""
    pattern = lidar.pattern
    false = rng.random(pattern.beams) < lidar.false_returns
    drawn = rng.uniform(pattern.min_range_m, pattern.max_range_m, pattern.beams)
    return read_only(np.where(false, drawn, ranges))


def _meets_nothing(world: World, origin: FloatArray, max_range_m: float) -> bool:
    """Whether all surfaces are surely beyond a range from a place [3]."""
    (nearest_m,) = world.distance_m(origin[None])
    return bool(nearest_m > SURELY * max_range_m)


@compiled
def _turn(vectors: Floats2, rotation: Floats2) -> Floats2:
    """[n, 3] rotation [3, 3] of each of some vectors [n, 3]."""
    turned = np.empty((len(vectors), 3))
    for n in range(len(vectors)):
        x, y, z = vectors[n, 0], vectors[n, 1], vectors[n, 2]
        for axis in range(3):
            turned[n, axis] = rotation[axis, 0] * x + rotation[axis, 1] * y + rotation[axis, 2] * z
    return turned


@compiled
def _returns(
    directions: Floats2,
    ranges: Floats,
    limits: tuple[float, float],
    noise: Floats,
    sigma: float,
    luck: Floats,
    dropout: float,
) -> Floats2:
    """Points [returns, 3] of the beams [beams] that come back from a range between two limits.

    noise, luck: standard normal and uniform draws of the beams whose range is finite, in order;
    none where they do not count.
    """
    least, farthest = limits
    measured = np.empty(len(ranges))
    beams = np.empty(len(ranges), dtype=np.int64)
    count, met = 0, -1
    for beam in range(len(ranges)):
        far = ranges[beam]
        if not np.isfinite(far):
            continue
        met += 1
        if len(noise):
            far += sigma * noise[met]
        if not (far > 0.0 and least <= far <= farthest):
            continue
        if len(luck) and luck[met] < dropout:
            continue
        measured[count], beams[count] = far, beam
        count += 1
    points = np.empty((count, 3))
    for n in range(count):
        for axis in range(3):
            points[n, axis] = measured[n] * directions[beams[n], axis]
    return points
