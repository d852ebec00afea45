"""No ball that is called free can be reached by a thing that no beam met.

Places at the very edge of what is called free are sought out. Balls that touch them are put there,
as thick as beams are apart, and held against every beam of the sweep, one by one. The geometry is
the test's own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import cKDTree

from clearway.base.state import State
from clearway.sensors import BeamPattern, Lidar, Mounting, Scan
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.seen_space import SeenSpace, is_free
from clearway.sensors.observed.view_shape import view_shape
from clearway.sensors.range_sensor import LidarSensor

Array = npt.NDArray[np.float64]
RANGES_M = (10.0, 20.0, 40.0, 100.0)
EDGES = 850
"""Places a pattern and a range: 10,200 in all."""
BALLS = 3
"""Put against each."""


def rotating(far_m: float) -> BeamPattern:
    azimuth, elevation = np.arange(-180.0, 180.0, 0.8), np.arange(-24.0, 24.1, 0.8)
    return BeamPattern.from_angles(np.radians(azimuth), np.radians(elevation), max_range_m=far_m)


def camera(far_m: float) -> BeamPattern:
    azimuth, elevation = np.arange(-43.0, 43.1, 0.7), np.arange(-29.0, 29.1, 0.7)
    return BeamPattern.from_angles(np.radians(azimuth), np.radians(elevation), max_range_m=far_m)


def scattered(far_m: float) -> BeamPattern:
    """A pattern that repeats nothing: Roberts' R2 sequence, all round and mostly up."""
    at = np.arange(30_000)[:, None] * np.array([0.7548776662466927, 0.5698402909980532]) % 1.0
    sines = np.sin(np.radians([-7.0, 52.0]))
    elevation = np.arcsin(sines[0] + at[:, 1] * (sines[1] - sines[0]))
    spacing = float(np.sqrt(2.0 * np.pi * (sines[1] - sines[0]) / len(at)))
    azimuth = 2.0 * np.pi * at[:, 0] - np.pi
    return BeamPattern(
        "scattered", azimuth, elevation_rad=elevation, spacing_rad=spacing, max_range_m=far_m
    )


@lru_cache
def pattern_of(kind: str, far_m: float) -> BeamPattern:
    return PATTERNS[kind](far_m)


PATTERNS = {"rotating": rotating, "camera": camera, "scattered": scattered}


def ranges_among(balls: Array, ways: Array, far_m: float) -> Array:
    """[n] how far beams from the origin along `ways` [n, 3] go on; balls: [m, 4]."""
    found = np.full(len(ways), far_m)
    for *center, radius in balls:
        along = ways @ np.array(center)
        root = radius**2 - (float(np.dot(center, center)) - along**2)
        hit = np.where(root >= 0.0, along - np.sqrt(np.maximum(root, 0.0)), np.inf)
        found = np.where((hit > 0.0) & (hit < found), hit, found)
    return found


@dataclass
class Sweep:
    """One sweep among balls, and what it shows."""

    seen: SeenSpace
    origin: Array
    rotation: Array
    ways: Array
    ends: Array

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.ways)

    def meets(self, center: Array, radius: float) -> bool:
        """Whether any beam passes through a ball before it ends."""
        to = (center - self.origin) @ self.rotation
        far = float(np.linalg.norm(to))
        if far <= radius:
            return True
        near = self._tree.query_ball_point(to / far, 2.0 * np.sin(0.5 * np.arcsin(radius / far)))
        along = self.ways[near] @ to
        root = np.maximum(radius**2 - (far**2 - along**2), 0.0)
        return bool(np.any(along - np.sqrt(root) <= self.ends[near]))


def sweep(seed: int, kind: str, far_m: float, smallest_m: float = 0.0) -> Sweep:
    """From anywhere, tilted anyhow, the sensor off the body's middle."""
    rng = np.random.default_rng([seed, int(far_m)])
    pattern = pattern_of(kind, 1.5 * far_m)
    mounting = Mounting(rng.uniform(-0.3, 0.3, 3), rng.uniform(-0.3, 0.3, 3))
    lidar = Lidar("front", pattern, mounting=mounting)
    state = State(rng.uniform(-50.0, 50.0, 3), rng.uniform([-0.4, -0.4, -3.0], [0.4, 0.4, 3.0]))
    way = rng.normal(size=(90, 3)) * [1.0, 1.0, 0.4]
    way *= (rng.uniform(0.2, 1.4, 90) * far_m / np.linalg.norm(way, axis=1))[:, None]
    balls = np.column_stack([way, rng.uniform(0.01, 0.1, 90) * far_m])
    ends = ranges_among(balls, pattern.directions, 1.5 * far_m)
    back = ends < 1.5 * far_m
    free = FreeSpace(far_m / 50.0, state.position_m, reach_m=2.0 * far_m, smallest_m=smallest_m)
    scan = Scan(pattern.directions[back] * ends[back, None], sensor="front")
    free.take(LidarSensor(lidar), scan, state)
    rotation = state.world_from_body @ mounting.body_from_sensor
    origin = state.position_m + state.world_from_body @ mounting.position_m
    return Sweep(free.seen, origin, rotation, pattern.directions, ends)


def edges(found: Sweep, rng: np.random.Generator, far_m: float, count: int) -> Array:
    """[count, 4] balls that are called free, and are not when they move on by a hair."""
    balls: list[Array] = []
    for _ in range(100 * count):
        radius = float(rng.uniform(0.002, 0.05) * far_m)
        toward = found.ways[rng.integers(len(found.ways))] @ found.rotation.T
        at = found.origin + rng.uniform(0.8, 1.1) * far_m * toward
        on = rng.normal(size=3)
        on *= 0.01 * far_m / np.linalg.norm(on)
        if not is_free(found.seen, *at, radius):
            continue
        for _ in range(60):
            if not is_free(found.seen, *(at + on), radius):
                break
            at = at + on
        for _ in range(8):
            on = 0.5 * on
            if is_free(found.seen, *(at + on), radius):
                at = at + on
        balls.append(np.array([*at, radius]))
        if len(balls) == count:
            break
    return np.array(balls)


def unmet(found: Sweep, places: Array, rng: np.random.Generator, thick: float) -> int:
    """How many balls that touch places no beam meets; thick: in angles between beams, at least."""
    missed = 0
    for *place, radius in places:
        for _ in range(BALLS):
            way = rng.normal(size=3)
            way /= np.linalg.norm(way)
            half = thick * float(np.linalg.norm(place - found.origin) + radius)
            for _ in range(3):  # As thick as beams are apart where it then lies.
                center = place + 0.999 * (radius + half) * way
                half = thick * float(np.linalg.norm(center - found.origin))
            missed += not found.meets(place + 0.999 * (radius + half) * way, half)
    return missed


@pytest.mark.parametrize("kind", PATTERNS)
@pytest.mark.parametrize("far_m", RANGES_M)
def test_nothing_that_no_beam_met_reaches_into_what_is_free(kind: str, far_m: float) -> None:
    rng = np.random.default_rng(7)
    sine = float(np.sin(view_shape(pattern_of(kind, 1.5 * far_m)).gap_rad))
    found = sweep(0, kind, far_m)
    places = edges(found, rng, far_m, EDGES)
    assert len(places) == EDGES
    assert unmet(found, places, rng, sine) == 0


@pytest.mark.parametrize("kind", PATTERNS)
def test_what_is_thinner_may_hide_there(kind: str) -> None:
    """Or the adversary would be blind."""
    rng, found = np.random.default_rng(8), sweep(0, kind, 20.0)
    places = edges(found, rng, 20.0, 200)
    assert unmet(found, places, rng, 0.2 * view_shape(pattern_of(kind, 30.0)).gap_rad) > 0


@pytest.mark.parametrize("kind", PATTERNS)
def test_nothing_is_free_beyond_where_the_smallest_object_may_hide(kind: str) -> None:
    rng, smallest_m = np.random.default_rng(9), 0.3
    sine = float(np.sin(view_shape(pattern_of(kind, 60.0)).gap_rad))
    found = sweep(1, kind, 40.0, smallest_m)
    for far_m in rng.uniform(1.0, 50.0, 500):
        at = found.origin + far_m * (found.ways[rng.integers(len(found.ways))] @ found.rotation.T)
        if is_free(found.seen, *at, 0.1):
            assert (far_m + 0.1) * sine <= 0.5 * smallest_m
    near_m = 0.4 * smallest_m / sine
    places = edges(found, rng, near_m, 200)
    for *place, radius in places:
        way = rng.normal(size=3)
        way *= 0.999 * (radius + 0.5 * smallest_m) / np.linalg.norm(way)
        assert found.meets(place + way, 0.5 * smallest_m)
