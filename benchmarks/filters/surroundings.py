"""What filters know: returns and free space of one LiDAR, or the whole map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.filters.protocol import Copter, Own
from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, State
from clearway.live.inputs.range_sensing import RangeSensing
from clearway.obstacles.world import World
from clearway.sensors import Lidar, Scan, range_sensors
from clearway.sensors.observed.seen_space import is_free

REACH_M = 13.0
"""Farther away no filter looks: it stands within 10 m."""
SLOPE_M = 1.0
"""Above and below the copter, beside its margin: filters that climb more look too late."""
NOTHING_M = 1e6
"""So far away is what is nearest where nothing is known."""
CLOSE_M = 1e-3
"""Step of the map's slope, and radius of the ball that stands for it."""


class SeenByLidar:
    """Returns and free space, as the guardian itself remembers them."""

    def __init__(self, planner: Planner, lidar: Lidar, start_m: FloatArray, copter: Copter) -> None:
        self._sensing = RangeSensing(planner, range_sensors([lidar]), start_m=start_m)
        self._copter = copter
        self.news: Sequence[Scan] = ()
        self._waiting: list[tuple[Scan, State]] = []
        self._middle_m, self._radius_m = np.zeros((0, 3)), np.zeros(0)
        self._about_m = start_m

    def hear(self, scan: Scan | None, state: State) -> None:
        """Take what has come at a moment."""
        self.news = () if scan is None else (scan,)
        if scan is not None:
            self._waiting.append((scan, state))

    def catch_up(self, own: Own) -> None:
        """See `Surroundings`."""
        for scan, state in self._waiting:
            self._sensing.take(scan, state)
        self._waiting.clear()
        near = self._sensing.list_remembered_near(own.position_m, self._copter.margin_m)
        off = near.position_m - own.position_m
        high = np.abs(off[:, 2]) <= self._copter.margin_m + near.radius_m + SLOPE_M
        kept = high & ((off**2).sum(axis=1) <= (REACH_M + near.radius_m) ** 2)
        self._middle_m, self._radius_m = off[kept], near.radius_m[kept]
        self._about_m = own.position_m

    def clearances_m(self, places_m: FloatArray) -> FloatArray:
        """See `Surroundings`."""
        gaps = self._gaps_m(places_m)
        return gaps.min(axis=1) if gaps.shape[1] else np.full(len(places_m), np.inf)

    def nearest(self, places_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Surroundings`."""
        if not len(self._radius_m):
            return places_m + np.array([NOTHING_M, 0.0, 0.0]), np.zeros(len(places_m))
        at = self._gaps_m(places_m).argmin(axis=1)
        return self._middle_m[at] + self._about_m, self._radius_m[at]

    def nearest_balls(self, place_m: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
        """See `Surroundings`: the nearest in each of `count` level sectors."""
        off = self._middle_m + self._about_m - place_m
        gap = np.linalg.norm(off, axis=1) - self._radius_m
        turn = np.arctan2(off[:, 1], off[:, 0]) / (2.0 * np.pi) + 0.5
        sector = np.minimum((count * turn).astype(np.int64), count - 1)
        order = np.argsort(gap, kind="stable")
        _, first = np.unique(sector[order], return_index=True)
        at = order[first]
        return self._middle_m[at] + self._about_m, self._radius_m[at]

    def were_seen(self, places_m: FloatArray) -> BoolArray:
        """See `Surroundings`."""
        free = self._sensing.free_space
        assert free is not None  # The planner asks for escapes.
        body = self._copter.body_m
        return np.array([is_free(free.seen, x, y, z, body) for x, y, z in places_m.tolist()])

    def _gaps_m(self, places_m: FloatArray) -> FloatArray:
        off = places_m - self._about_m
        squared = (off**2).sum(axis=1)[:, None] - 2.0 * off @ self._middle_m.T
        squared += (self._middle_m**2).sum(axis=1)
        gaps: FloatArray = np.sqrt(np.maximum(squared, 0.0)) - self._radius_m
        return gaps


class KnownMap:
    """The true world, without error: for laws in tests, and as a reference."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.news: Sequence[Scan] = ()

    def catch_up(self, _own: Own) -> None:
        """Nothing comes: all is known."""

    def clearances_m(self, places_m: FloatArray) -> FloatArray:
        """See `Surroundings`."""
        return self._world.distance_m(np.ascontiguousarray(places_m))

    def nearest(self, places_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Surroundings`."""
        here = self.clearances_m(places_m)
        steps = CLOSE_M * np.eye(3)
        if not np.all(np.isfinite(here)):
            return places_m + np.array([NOTHING_M, 0.0, 0.0]), np.zeros(len(here))
        slope = np.stack([self.clearances_m(places_m + step) - here for step in steps], axis=1)
        slope /= np.maximum(np.linalg.norm(slope, axis=1), 1e-12)[:, None]
        near = np.minimum(here, NOTHING_M) + CLOSE_M
        return places_m - slope * near[:, None], np.full(len(here), CLOSE_M)

    def nearest_balls(self, place_m: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
        """See `Surroundings`: where rays in `count` level directions end."""
        angles = 2.0 * np.pi * np.arange(count) / count
        ways = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
        ranges = self._world.cast(place_m, ways, REACH_M)
        met = np.isfinite(ranges)
        return place_m + ways[met] * ranges[met, None], np.zeros(int(met.sum()))

    def were_seen(self, places_m: FloatArray) -> BoolArray:
        """See `Surroundings`."""
        return np.ones(len(places_m), dtype=np.bool_)
