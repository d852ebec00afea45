"""What a simulated sensor sees and a simulated flight must miss: the truth about space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from clearway.base.frames import FloatArray


class World(Protocol):
    """Solid things in the world frame: map shapes, point clouds, or both."""

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """[n] signed distance from points [n, 3] to the nearest surface; inf in an empty world."""
        ...

    def cast(self, origin_m: FloatArray, directions: FloatArray, max_range_m: float) -> FloatArray:
        """[n] range of the first surface along unit vectors [n, 3]; inf where none in range."""
        ...


@dataclass(frozen=True, slots=True)
class CombinedWorld:
    """Several worlds as one; none at all is empty space."""

    worlds: Sequence[World]

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """[n] smallest of the worlds' distances."""
        nearest = np.full(len(points_m), np.inf)
        for world in self.worlds:
            nearest = np.minimum(nearest, world.distance_m(points_m))
        return nearest

    def cast(self, origin_m: FloatArray, directions: FloatArray, max_range_m: float) -> FloatArray:
        """[n] nearest of the worlds' surfaces."""
        nearest = np.full(len(directions), np.inf)
        for world in self.worlds:
            nearest = np.minimum(nearest, world.cast(origin_m, directions, max_range_m))
        return nearest
