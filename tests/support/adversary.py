"""A static world drawn by an adversary: balls put where the vehicle means to fly and nobody looked.

A ball is put only where no beam has been, so that the world might have stood like that all along.
All geometry is the test's own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class AdversaryWorld:
    """Balls, some from the start, others added in flight; what simulated flights ask of a world."""

    def __init__(
        self,
        centers_m: Array,
        radii_m: Array,
        max_range_m: float,
        *,
        clear_m: float,
        unit_m: float = 1.0,
    ) -> None:
        self.centers_m, self.radii_m = centers_m.reshape(-1, 3), radii_m.ravel()
        self.clear_m, self.unit_m = clear_m, unit_m
        """The start stands free within it; the length that balls are measured in."""
        self._max_range_m = max_range_m
        self._origins: list[Array] = []
        self._ways: list[Array] = []
        self._lengths: list[Array] = []

    def distance_m(self, points_m: npt.ArrayLike) -> Array:
        points = np.atleast_2d(np.asarray(points_m, dtype=float))
        nearest = np.full(len(points), np.inf)
        for center, radius in zip(self.centers_m, self.radii_m, strict=True):
            nearest = np.minimum(nearest, np.linalg.norm(points - center, axis=1) - radius)
        return nearest

    def cast(self, origin_m: npt.ArrayLike, directions: npt.ArrayLike, max_range_m: float) -> Array:
        origin, ways = np.asarray(origin_m, dtype=float), np.asarray(directions, dtype=float)
        found = np.full(len(ways), np.inf)
        for center, radius in zip(self.centers_m, self.radii_m, strict=True):
            to = center - origin
            along = ways @ to
            root = radius**2 - (to @ to - along**2)
            hit = np.where(root >= 0.0, along - np.sqrt(np.maximum(root, 0.0)), np.inf)
            found = np.where((hit > 0.0) & (hit < found), hit, found)
        found[found > max_range_m] = np.inf
        self._origins.append(origin)
        self._ways.append(ways)
        self._lengths.append(np.minimum(found, self._max_range_m))
        return found

    def oppose(self, plans_m: Sequence[Array], track_m: Array, rng: np.random.Generator) -> bool:
        """Put one ball across places [n, 3] that are to be flown, if it was never looked at."""
        for _ in range(40):
            plan = plans_m[rng.integers(len(plans_m))]
            if not len(plan):
                continue
            radius = rng.uniform(0.3, 1.5) * self.unit_m
            aside = rng.normal(size=3)
            aside *= rng.uniform(0.0, radius + 3.0 * self.unit_m) / np.linalg.norm(aside)
            center = plan[rng.integers(len(plan))] + aside
            away = np.linalg.norm(track_m - center, axis=1).min() - radius
            if away <= 0.1 * self.unit_m or np.linalg.norm(center) - radius <= self.clear_m:
                continue
            if self._never_looked_at(center, radius):
                self.centers_m = np.vstack([self.centers_m, center])
                self.radii_m = np.append(self.radii_m, radius)
                return True
        return False

    def _never_looked_at(self, center: Array, radius: float) -> bool:
        for origin, ways, lengths in zip(self._origins, self._ways, self._lengths, strict=True):
            to = center - origin
            if np.linalg.norm(to) - radius > self._max_range_m:
                continue
            along = np.clip(ways @ to, 0.0, lengths)
            gaps = (to @ to) - 2.0 * along * (ways @ to) + along**2
            if gaps.min() < radius**2:
                return False
        return True


def least_distance_m(track_m: Array, centers_m: Array, radii_m: Array) -> float:
    """Least distance of a track [n, 3], flown straight between its points, from balls' surfaces."""
    least = np.inf
    start, way = track_m[:-1], np.diff(track_m, axis=0)
    length2 = np.maximum((way**2).sum(axis=1), 1e-12)
    for center, radius in zip(centers_m, radii_m, strict=True):
        share = np.clip(((center - start) * way).sum(axis=1) / length2, 0.0, 1.0)
        gaps = np.linalg.norm(start + share[:, None] * way - center, axis=1) - radius
        least = min(least, float(gaps.min()))
    return least
