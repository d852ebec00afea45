"""A world of balls, independent of the library's own shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class BallWorld:
    """Balls at centres [n, 3] with radii [n]; NumPy, for tests only."""

    centers_m: Array
    radii_m: Array

    @classmethod
    def of(cls, *balls: tuple[tuple[float, float, float], float]) -> BallWorld:
        return cls(
            np.array([center for center, _ in balls], dtype=float).reshape(-1, 3),
            np.array([radius for _, radius in balls], dtype=float),
        )

    def distance_m(self, points_m: Array) -> Array:
        offsets = np.asarray(points_m)[:, None, :] - self.centers_m
        distances: Array = np.linalg.norm(offsets, axis=-1) - self.radii_m
        return np.min(distances, axis=1, initial=np.inf)

    def cast(self, origin_m: Array, directions: Array, max_range_m: float) -> Array:
        offset = self.centers_m - origin_m
        along = directions @ offset.T
        discriminant = along**2 - np.sum(offset**2, axis=1) + self.radii_m**2
        entry = along - np.sqrt(np.maximum(discriminant, 0.0))
        entry = np.where((discriminant >= 0.0) & (entry >= 0.0), entry, np.inf)
        nearest: Array = np.min(entry, axis=1, initial=np.inf)
        return np.where(nearest <= max_range_m, nearest, np.inf)
