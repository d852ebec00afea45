"""Detected points that left the field of view: remembered, and forgotten where beams pass through.

A beam of the pattern that returns from farther away, or does not return at all, shows that nothing
is left at a remembered point. Without the latter the ghosts of moved objects would stay in the sky.
A nearer return hides the point and says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.base.brief import brief
from clearway.base.compiled import compiled, read_only
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray, State
from clearway.sensors.lidar import Lidar, Scan
from clearway.sensors.passing import (
    beam_raster,
    count_passes,
    nearest_returns,
    returns_in_world,
    sensor_at,
)
from clearway.sensors.unsure import radii_unsure, turned_by
from clearway.sensors.voxels import merge_balls, number_voxels, slot_of, table_bits, voxel_key


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

    __repr__ = brief

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
    angle_rad: float = 0.0,
    ground_m: float = -np.inf,
) -> PointMemory:
    """Memory after a scan taken at `state`: forget what it passed through, remember its returns.

    tolerance_m: uncertainty of the pose, added to the range by which beams must pass a point.
    angle_rad: how far the attitude may be off: returns stand for all places where they may be, and
    a point is passed only if it is whichever way the attitude is off.
    ground_m: returns at or below this height of the world frame are not remembered, nor are
    blind, too far and own-airframe ones. A voxel hit by this scan is never forgotten.
    """
    tolerance_m += 0.5 * memory.voxel_m + 3.0 * lidar.sigma_m
    sensor = sensor_at(lidar, state, tolerance_m)
    points, radii = returns_in_world(scan.points_m, sensor, float(memory.reach_m), float(ground_m))
    radii = radii_unsure(points, radii, state, angle_rad)
    raster = beam_raster(lidar.pattern)
    nearest = nearest_returns(scan.points_m, raster)
    passes = [
        count_passes(
            memory.position_m,
            memory.radius_m,
            memory.voxel_m,
            memory.passes,
            nearest,
            sensor_at(lidar, turned, tolerance_m),
            raster,
        )
        for turned in turned_by(state, angle_rad)
    ]
    passed = passes[0] if len(passes) == 1 else np.min(passes, axis=0)
    return remember(memory, points, radii, passed, scan.time_s)


def remember(
    memory: PointMemory, points: FloatArray, radii: FloatArray, passes: IntArray, time_s: float
) -> PointMemory:
    """Memory after returns [m, 3] of the world frame with radii [m] at a time.

    passes: [n] of what is remembered, this reading included.
    """
    voxel_of, voxels = number_voxels(points, memory.voxel_m)
    seen, seen_radii = merge_balls(points, radii, voxel_of, voxels)
    again = _in_voxels_of(memory.position_m, seen, memory.voxel_m)
    position, radius, last_seen, passes = _joined(
        Balls(memory.position_m, memory.radius_m, memory.last_seen_s, passes),
        ~again & (passes < memory.passes_to_clear),
        time_s - memory.horizon_s,
        Balls(seen, seen_radii, np.full(voxels, time_s), np.zeros(voxels, dtype=np.int64)),
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


def forget_moved(
    memory: PointMemory,
    position_m: FloatArray,
    velocity_mps: FloatArray,
    time_s: float,
    reach_m: float,
    since_s: float,
) -> PointMemory:
    """Memory without the returns of a body in motion: those last seen where it was at that time.

    The body's centre [3] is at `position_m` at `time_s`, its surface within `reach_m` of it; only
    what was last seen at `since_s` or later can be its own.
    """
    before = memory.last_seen_s - time_s
    centers = position_m + before[:, None] * velocity_mps
    apart = np.linalg.norm(memory.position_m - centers, axis=1)
    keep = (apart > reach_m) | (memory.last_seen_s < since_s)
    if keep.all():
        return memory
    return replace(
        memory,
        position_m=memory.position_m[keep],
        radius_m=memory.radius_m[keep],
        last_seen_s=memory.last_seen_s[keep],
        passes=memory.passes[keep],
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
