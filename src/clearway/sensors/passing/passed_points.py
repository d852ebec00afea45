"""Which remembered points the beams of a sweep pass through, by comparing along each direction.

A point is passed only if all beams around it go on beyond it, or real surfaces would be eaten at
their edges.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Ints
from clearway.base.compiled import compiled, seal
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sensors.beams.binning import TINY
from clearway.sensors.beams.lidar import Lidar
from clearway.sensors.beams.raster import BeamRaster, find_bin
from clearway.sensors.beams.simulate import sensor_pose

MAX_WINDOW = 8
"""Columns on either side looked at, however narrow they are towards the poles."""
REACH_OF_BEAM = 1.2
"""Half beam spacings within which a beam counts as pointing at something."""


class Sensor(NamedTuple):
    """Pose and limits of the sensor as the loops take them."""

    rotation: Floats2
    """[3, 3] world from sensor."""
    origin: Floats
    """[3] world frame."""
    body: Floats
    """[3] body's origin, world frame."""
    min_range: float
    max_range: float
    airframe_radius: float
    half_spacing: float
    tolerance: float


def sensor_at(lidar: Lidar, state: State, tolerance_m: float) -> Sensor:
    """The sensor of a vehicle in a state; beams pass a point if they go on for the tolerance."""
    rotation, origin = sensor_pose(lidar, state)
    pattern = lidar.pattern
    return Sensor(
        seal(rotation),
        seal(origin),
        state.position_m,
        float(pattern.min_range_m),
        float(min(pattern.max_range_m, 1e30)),
        float(lidar.airframe_radius_m),
        0.5 * float(pattern.spacing_rad),
        float(tolerance_m),
    )


class Placed(NamedTuple):
    """The returns of a sweep that obstacles can have given."""

    points_m: Floats2
    """[m, 3] world frame."""
    distance_m: Floats
    """[m] from the sensor."""
    source: Ints
    """[m] which of the sweep's returns."""


@compiled
def place_returns(points: Floats2, sensor: Sensor, reach: float, ground: float) -> Placed:
    """Those within the limits and `reach`, above `ground`, that are not of the airframe."""
    placed, distances = np.empty((len(points), 3)), np.empty(len(points))
    source = np.empty(len(points), dtype=np.int64)
    m = _place(points, sensor, reach, ground, placed, distances, source)
    return Placed(placed[:m], distances[:m], source[:m])


@compiled
def _place(
    points: Floats2,
    sensor: Sensor,
    reach: float,
    ground: float,
    placed: Floats2,
    distances: Floats,
    source: Ints,
) -> int:
    """Fill in what `place_returns` tells of each; how many there are."""
    r, o, e = sensor.rotation, sensor.origin, sensor.body
    r00, r01, r02, ox, ex = r[0, 0], r[0, 1], r[0, 2], o[0], e[0]
    r10, r11, r12, oy, ey = r[1, 0], r[1, 1], r[1, 2], o[1], e[1]
    r20, r21, r22, oz, ez = r[2, 0], r[2, 1], r[2, 2], o[2], e[2]
    low, high = sensor.min_range**2, min(sensor.max_range, reach) ** 2
    own = sensor.airframe_radius**2
    m = 0
    for n in range(len(points)):
        a, b, c = points[n, 0], points[n, 1], points[n, 2]
        squared = a * a + b * b + c * c
        if not (squared >= low and squared <= high):
            continue
        x = r00 * a + r01 * b + r02 * c + ox
        y = r10 * a + r11 * b + r12 * c + oy
        z = r20 * a + r21 * b + r22 * c + oz
        if z <= ground or (x - ex) ** 2 + (y - ey) ** 2 + (z - ez) ** 2 < own:
            continue
        placed[m, 0], placed[m, 1], placed[m, 2] = x, y, z
        distances[m], source[m] = np.sqrt(squared), n
        m += 1
    return m


def returns_in_world(
    points: FloatArray, sensor: Sensor, reach: float, ground: float
) -> tuple[FloatArray, FloatArray]:
    """Returns of obstacles [m, 3] in the world frame, and half the beam spacing there."""
    placed = place_returns(points, sensor, reach, ground)
    return placed.points_m, sensor.half_spacing * placed.distance_m


@compiled
def find_passed_through(
    positions: Floats2,
    radii: Floats,
    nearest: Floats2,
    sensor: Sensor,
    raster: BeamRaster,
) -> Bools:
    """[n] whether a sweep shows that nothing is at balls: points [n, 3] with radii [n].

    nearest: [columns, rows] `nearest_returns` of the sweep.
    """
    passed = np.zeros(len(positions), dtype=np.bool_)
    for n in range(len(positions)):
        x, y, z = in_sensor(positions[n, 0], positions[n, 1], positions[n, 2], sensor)
        distance = np.sqrt(x * x + y * y + z * z)
        # Where beams lie too far apart, all may miss what is left.
        if REACH_OF_BEAM * sensor.half_spacing * distance <= radii[n]:
            beyond = distance + sensor.tolerance
            passed[n] = goes_on(x, y, z, distance, beyond, nearest, sensor, raster)
    return passed


@compiled
def in_sensor(x: float, y: float, z: float, sensor: Sensor) -> tuple[float, float, float]:
    """A point of the world in the sensor's frame."""
    r, o = sensor.rotation, sensor.origin
    a, b, c = x - o[0], y - o[1], z - o[2]
    return (
        r[0, 0] * a + r[1, 0] * b + r[2, 0] * c,
        r[0, 1] * a + r[1, 1] * b + r[2, 1] * c,
        r[0, 2] * a + r[1, 2] * b + r[2, 2] * c,
    )


@compiled
def goes_on(
    x: float,
    y: float,
    z: float,
    distance: float,
    beyond: float,
    nearest: Floats2,
    sensor: Sensor,
    raster: BeamRaster,
) -> bool:
    """Whether a sweep looks at a point of the sensor's frame, and past it beyond some range."""
    if distance < sensor.min_range or beyond > sensor.max_range:
        return False
    low, high = raster.low, raster.high
    sine = z / (distance + TINY)
    column, row = find_bin(x, y, sine, low, raster.per_column, raster.per_row, raster.bottom)
    # The raster has an empty row below and above the pattern's beams.
    if row < 1 or row + 1 >= low.shape[1] or not raster.flanked[column, row]:
        return False
    slack = REACH_OF_BEAM * sensor.half_spacing * np.sqrt(max(0.0, 1.0 - sine * sine))
    looks_here = (
        (low[column, row] - slack <= sine and sine <= high[column, row] + slack)
        or high[column, row - 1] + slack >= sine
        or low[column, row + 1] - slack <= sine
    )
    return looks_here and _is_passed(column, row, sine, beyond, nearest)


@compiled
def _is_passed(column: int, row: int, sine: float, beyond: float, nearest: Floats2) -> bool:
    """Whether all beams around a direction go on beyond a range."""
    columns = nearest.shape[0]
    cosine = np.sqrt(max(0.0, 1.0 - sine * sine))
    window = MAX_WINDOW if cosine * MAX_WINDOW < 1.0 else int(np.ceil(1.0 / cosine))
    for shift in range(-window, window + 1):
        j = column + shift
        if j < 0:
            j += columns
        elif j >= columns:
            j -= columns
        for k in range(row - 1, row + 2):
            if nearest[j, k] <= beyond:
                return False
    return True
