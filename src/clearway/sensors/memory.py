"""Detected points that left the field of view: remembered, and forgotten where beams pass through.

A beam of the pattern that returns from farther away, or does not return at all, shows that nothing
is left at a remembered point. Without the latter the ghosts of moved objects would stay in the sky.
A nearer return hides the point and says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.compiled import compiled, read_only
from clearway.errors import ClearwayError
from clearway.frames import FloatArray
from clearway.sensors.lidar import Lidar, Scan
from clearway.sensors.passing import Sensor, beam_raster, count_passes
from clearway.sensors.simulate import sensor_pose
from clearway.sensors.voxels import merge_balls, number_voxels, slot_of, table_bits, voxel_key
from clearway.state import BoolArray, IntArray, State


@dataclass(frozen=True, slots=True, eq=False)
class PointMemory:
    """Remembered hit points, at most one ball per voxel of the world frame, oldest first."""

    voxel_m: float
    horizon_s: float
    """Points not seen for longer are forgotten."""
    reach_m: float
    """Returns from farther away are not remembered."""
    capacity: int
    """With more than this many voxels the longest unseen are forgotten."""
    passes_to_clear: int
    """Sweeps in a row that must pass through a point: one alone may miss a wire."""
    position_m: FloatArray
    """[n, 3] world frame."""
    radius_m: FloatArray
    """[n] of the ball that covers the voxel's returns and half the beam spacing around them."""
    last_seen_s: FloatArray
    """[n] ascending."""
    passes: IntArray
    """[n] sweeps that passed through since."""

    @classmethod
    def empty(
        cls,
        voxel_m: float,
        horizon_s: float = np.inf,
        *,
        reach_m: float = np.inf,
        capacity: int = 50_000,
        passes_to_clear: int = 2,
    ) -> PointMemory:
        """Nothing remembered yet; raises ClearwayError naming an impossible setting."""
        settings = {"voxel_m": voxel_m, "horizon_s": horizon_s, "reach_m": reach_m}
        for name, value in settings.items():
            if not value > 0.0:
                raise ClearwayError(f"point memory: {name} must be above 0, got {value}")
        if capacity < 1 or passes_to_clear < 1:
            raise ClearwayError("point memory: capacity and passes_to_clear must be at least 1")
        return cls(
            float(voxel_m),
            float(horizon_s),
            float(reach_m),
            capacity,
            passes_to_clear,
            np.zeros((0, 3)),
            np.zeros(0),
            np.zeros(0),
            np.zeros(0, dtype=np.int64),
        )

    def near(self, position_m: FloatArray, radius_m: float) -> tuple[FloatArray, FloatArray]:
        """Positions [k, 3] and radii [k] of remembered balls within a distance of a position."""
        return _near(self.position_m, self.radius_m, read_only(position_m), float(radius_m))


def update_memory(
    memory: PointMemory,
    lidar: Lidar,
    scan: Scan,
    state: State,
    *,
    tolerance_m: float = 0.0,
    ground_m: float = -np.inf,
) -> PointMemory:
    """Memory after a scan taken at `state`: forget what it passed through, remember its returns.

    tolerance_m: uncertainty of the pose, added to the range by which beams must pass a point.
    ground_m: returns at or below this height of the world frame are not remembered, nor are
    blind, too far and own-airframe ones. A voxel hit by this scan is never forgotten.
    """
    rotation, origin = sensor_pose(lidar, state)
    pattern = lidar.pattern
    sensor = Sensor(
        read_only(rotation),
        read_only(origin),
        state.position_m,
        float(pattern.min_range_m),
        float(min(pattern.max_range_m, 1e30)),
        float(lidar.airframe_radius_m),
        0.5 * float(pattern.spacing_rad),
        0.5 * memory.voxel_m + 3.0 * lidar.sigma_m + tolerance_m,
    )
    points, radii = _in_world(scan.points_m, sensor, float(memory.reach_m), float(ground_m))
    voxel_of, voxels = number_voxels(points, memory.voxel_m)
    seen, seen_radii = merge_balls(points, radii, voxel_of, voxels)
    passes = count_passes(
        memory.position_m,
        memory.radius_m,
        memory.voxel_m,
        memory.passes,
        scan.points_m,
        sensor,
        beam_raster(pattern),
    )
    again = _in_voxels_of(memory.position_m, seen, memory.voxel_m)
    position, radius, last_seen, passes = _joined(
        Balls(memory.position_m, memory.radius_m, memory.last_seen_s, passes),
        ~again & (passes < memory.passes_to_clear),
        scan.time_s - memory.horizon_s,
        Balls(seen, seen_radii, np.full(voxels, scan.time_s), np.zeros(voxels, dtype=np.int64)),
    )
    room = slice(-memory.capacity, None)
    return PointMemory(
        memory.voxel_m,
        memory.horizon_s,
        memory.reach_m,
        memory.capacity,
        memory.passes_to_clear,
        position[room],
        radius[room],
        last_seen[room],
        passes[room],
    )


class Balls(NamedTuple):
    """The columns of `PointMemory` as the loops take them."""

    position_m: FloatArray
    radius_m: FloatArray
    last_seen_s: FloatArray
    passes: IntArray


@compiled
def _joined(old: Balls, keep: BoolArray, expiry: float, new: Balls) -> Balls:
    """Old balls that are kept and have not expired, then the new ones."""
    size = len(keep) + len(new.radius_m)
    positions, radii = np.empty((size, 3)), np.empty(size)
    last_seen, passes = np.empty(size), np.empty(size, dtype=np.int64)
    m = 0
    for n in range(len(keep)):
        if keep[n] and old.last_seen_s[n] >= expiry:
            for axis in range(3):
                positions[m, axis] = old.position_m[n, axis]
            radii[m], last_seen[m] = old.radius_m[n], old.last_seen_s[n]
            passes[m] = old.passes[n]
            m += 1
    end = m + len(new.radius_m)
    positions[m:end], radii[m:end] = new.position_m, new.radius_m
    last_seen[m:end], passes[m:end] = new.last_seen_s, new.passes
    return Balls(positions[:end], radii[:end], last_seen[:end], passes[:end])


@compiled
def _in_world(
    points: FloatArray, sensor: Sensor, reach: float, ground: float
) -> tuple[FloatArray, FloatArray]:
    """Returns worth remembering [m, 3] in the world frame, and half the beam spacing there."""
    r, o, e = sensor.rotation, sensor.origin, sensor.body
    r00, r01, r02, ox, ex = r[0, 0], r[0, 1], r[0, 2], o[0], e[0]
    r10, r11, r12, oy, ey = r[1, 0], r[1, 1], r[1, 2], o[1], e[1]
    r20, r21, r22, oz, ez = r[2, 0], r[2, 1], r[2, 2], o[2], e[2]
    low, high = sensor.min_range**2, min(sensor.max_range, reach) ** 2
    own, half_spacing = sensor.airframe_radius**2, sensor.half_spacing
    placed, radii = np.empty((len(points), 3)), np.empty(len(points))
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
        radii[m] = half_spacing * np.sqrt(squared)
        m += 1
    return placed[:m], radii[:m]


@compiled
def _in_voxels_of(positions: FloatArray, seen: FloatArray, voxel: float) -> BoolArray:
    """[n] whether a position shares its voxel with any of those seen."""
    bits = table_bits(len(seen))
    keys = np.full(1 << bits, -1, dtype=np.int64)
    per_voxel, shift = 1.0 / voxel, 64 - bits
    for n in range(len(seen)):
        key = voxel_key(seen[n, 0], seen[n, 1], seen[n, 2], per_voxel)
        keys[slot_of(key, keys, shift)] = key
    shared = np.zeros(len(positions), dtype=np.bool_)
    for n in range(len(positions)):
        key = voxel_key(positions[n, 0], positions[n, 1], positions[n, 2], per_voxel)
        shared[n] = keys[slot_of(key, keys, shift)] == key
    return shared


@compiled
def _near(
    positions: FloatArray, radii: FloatArray, center: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray]:
    kept, kept_radii = np.empty((len(positions), 3)), np.empty(len(positions))
    cx, cy, cz = center[0], center[1], center[2]
    m = 0
    for n in range(len(positions)):
        x, y, z = positions[n, 0] - cx, positions[n, 1] - cy, positions[n, 2] - cz
        if x * x + y * y + z * z <= (reach + radii[n]) ** 2:
            kept[m] = positions[n]
            kept_radii[m] = radii[n]
            m += 1
    return kept[:m], kept_radii[:m]
