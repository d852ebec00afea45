"""Flights among thin things with beams just fine enough for what is declared, or too coarse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.live.preflight.fineness import turning_distance_m
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, Scan
from clearway.sim import SimulationSettings, simulate
from thin_worlds import FAMILIES, THINNEST_M, Capsules
from worlds_for_tests import GRID, planner

MARGIN_M = 0.6


class ThinFlight(NamedTuple):
    """How a flight ended."""

    reached: bool
    nearest_m: float
    emergencies: int
    lasted_s: float

    @property
    def kept(self) -> bool:
        """Whether the margin was kept all the way flown."""
        return self.nearest_m >= MARGIN_M


@dataclass(frozen=True)
class QuickScanner:
    """A LiDAR of a million beams among capsules: noise for returns only, rain along some beams."""

    lidar: Lidar
    rain: float = 0.0
    """Share of beams with a false return at any range."""

    @property
    def name(self) -> str:
        return self.lidar.name

    def scan(self, world: Capsules, state: State, rng: np.random.Generator) -> Scan:
        pattern, rotation = self.lidar.pattern, state.world_from_body
        near = world.distance_to_axes_m(state.position_m) < pattern.max_range_m + 0.1
        ranges = _first_ranges(
            state.position_m,
            pattern.directions,
            np.ascontiguousarray(rotation),
            world.start[near],
            world.end[near],
            world.radius[near],
        )
        hit = np.flatnonzero(ranges <= pattern.max_range_m)
        hit = hit[rng.random(len(hit)) >= self.lidar.dropout]
        told = ranges[hit] + rng.normal(0.0, self.lidar.sigma_m, len(hit))
        points = told[:, None] * pattern.directions[hit]
        wet = rng.integers(0, pattern.beams, rng.binomial(pattern.beams, self.rain))
        drops = rng.uniform(0.3, pattern.max_range_m, (len(wet), 1)) * pattern.directions[wet]
        return Scan(np.concatenate([points, drops]), state.time_s, sensor=self.name)


@njit(cache=True)
def _first_ranges(origin, directions, rotation, start, end, radius):  # type: ignore[no-untyped-def]
    """Range of the first cylinder on each ray: where its axis is nearest, less half the chord."""
    count = len(radius)
    axes, feet, lengths = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    for s in range(count):
        axis = end[s] - start[s]
        lengths[s] = np.sqrt(np.sum(axis * axis))
        axes[s], feet[s] = axis / lengths[s], start[s] - origin
    ranges = np.full(len(directions), np.inf)
    for n in range(len(directions)):
        x, y, z = directions[n, 0], directions[n, 1], directions[n, 2]
        dx = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z
        dy = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z
        dz = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
        for s in range(count):
            wx, wy, wz = feet[s, 0], feet[s, 1], feet[s, 2]
            ax, ay, az = axes[s, 0], axes[s, 1], axes[s, 2]
            # Distance of the two lines, before anything that divides.
            nx, ny, nz = dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax
            sine2 = nx * nx + ny * ny + nz * nz
            off = wx * nx + wy * ny + wz * nz
            if off * off > radius[s] * radius[s] * sine2 or sine2 < 1e-9:
                continue
            cosine, w_a = dx * ax + dy * ay + dz * az, wx * ax + wy * ay + wz * az
            at = (wx * dx + wy * dy + wz * dz - cosine * w_a) / sine2
            on = at * cosine - w_a
            if at <= 0.0 or on < 0.0 or on > lengths[s]:
                continue
            hit = at - np.sqrt((radius[s] * radius[s] - off * off / sine2) / sine2)
            if 0.0 < hit < ranges[n]:
                ranges[n] = hit
    return ranges


def fine_lidar(family: str) -> Lidar:
    """Beams that lie no farther apart at the turning distance than the thinnest thing is thick."""
    wanted = THINNEST_M[family] / turning_distance_m(planner())
    steps = (np.diff(GRID.edges.azimuth_rad).max(), np.diff(GRID.edges.elevation_rad).max())
    across, up = (int(np.ceil(float(step) / wanted)) for step in steps)
    beams = BeamPattern.per_cell(GRID, across, elevations_per_cell=up, max_range_m=10.0)
    return Lidar("fine", beams, sigma_m=0.03, dropout=0.05)


def thin_flight(family: str, seed: int, rain: float = 0.0) -> ThinFlight:
    """A flight of a family with its thinnest thing declared, and beams fine enough for it."""
    world, mission = FAMILIES[family](seed)
    return thin_flight_in(world, mission, fine_lidar(family), THINNEST_M[family], seed, rain)


def thin_flight_in(
    world: ObstacleMap,
    mission: Mission,
    lidar: Lidar,
    smallest_m: float | None,
    seed: int,
    rain: float = 0.0,
) -> ThinFlight:
    """A flight among lines; rain: share of the beams with a false return."""
    system = AvoidanceSystem(planner(smallest_object_m=smallest_m), mission, lidars=(lidar,))
    run = simulate(
        system,
        Capsules(world),
        lidars=(QuickScanner(lidar, rain),),
        settings=SimulationSettings(seed=seed, time_limit_s=240.0),
    )
    nearest = run.metrics.min_obstacle_distance_m
    return ThinFlight(run.reached, nearest, run.emergencies, float(run.time_s[-1]))
