"""Distances to boxes, balls, bars and plates by geometry of the tests' own: nothing of clearway's.

A shape is a box, perhaps flat, thin or a mere point, turned and moved, and inflated by a radius.
The distance to one is a convex function of the place, so its least along a straight line is found
by sections.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
SECTIONS = 45
"""Each takes a third off: of 100 m a micrometre is left."""


@dataclass(frozen=True)
class Solids:
    """Shapes: centres [n, 3], axes [n, 3, 3] (rows are local axes), halves [n, 3], radii [n]."""

    centers_m: Array
    axes: Array
    halves_m: Array
    radii_m: Array

    @classmethod
    def of(cls, shapes: Iterable[Any]) -> Solids:
        """From what has position_m, orientation_rad, size_m and radius_m, as obstacles do."""
        shapes = list(shapes)
        return cls(
            np.array([shape.position_m for shape in shapes], dtype=float).reshape(-1, 3),
            np.array([_axes(*shape.orientation_rad) for shape in shapes]).reshape(-1, 3, 3),
            np.array([_halves(shape.size_m) for shape in shapes]).reshape(-1, 3),
            np.array([shape.radius_m for shape in shapes], dtype=float),
        )

    def one_m(self, index: int, points_m: Array) -> Array:
        """[m] signed distance of points [m, 3] to the surface of one shape."""
        local = (points_m - self.centers_m[index]) @ self.axes[index].T
        over = np.abs(local) - self.halves_m[index]
        outside = np.sqrt((np.maximum(over, 0.0) ** 2).sum(axis=1))
        inside = np.minimum(over.max(axis=1), 0.0)
        return np.asarray(outside + inside - self.radii_m[index])

    def distance_m(self, points_m: npt.ArrayLike) -> Array:
        """[m] signed distance of points [m, 3] to the nearest surface; inf without any."""
        points = np.atleast_2d(np.asarray(points_m, dtype=float))
        nearest = np.full(len(points), np.inf)
        for index in range(len(self.radii_m)):
            nearest = np.minimum(nearest, self.one_m(index, points))
        return nearest

    def boxes_m(self) -> tuple[Array, Array]:
        """Least and greatest corners [n, 3] of a box about each, along the axes of the world."""
        reach = np.einsum("nji,nj->ni", np.abs(self.axes), self.halves_m) + self.radii_m[:, None]
        return self.centers_m - reach, self.centers_m + reach

    def nearest_on_track_m(self, track_m: npt.ArrayLike) -> float:
        """Least distance of a track [m, 3], straight between its places, to any surface."""
        track = np.asarray(track_m, dtype=float).reshape(-1, 3)
        if len(track) == 1:
            return float(self.distance_m(track)[0])
        start, end = track[:-1], track[1:]
        length = np.linalg.norm(end - start, axis=1)
        least = np.inf
        for index in range(len(self.radii_m)):
            at = self.one_m(index, track)
            least = min(least, float(at.min()))
            # A distance changes by no more than the way.
            may = 0.5 * (at[:-1] + at[1:] - length) < least
            if may.any():
                least = min(least, float(self._between(index, start[may], end[may]).min()))
        return least

    def _between(self, index: int, start: Array, end: Array) -> Array:
        """[m] least distance to one shape on straight lines: a convex function, by thirds."""
        low, high = np.zeros(len(start)), np.ones(len(start))
        for _ in range(SECTIONS):
            first, second = low + (high - low) / 3.0, high - (high - low) / 3.0
            at_first = self.one_m(index, start + first[:, None] * (end - start))
            at_second = self.one_m(index, start + second[:, None] * (end - start))
            low = np.where(at_first > at_second, first, low)
            high = np.where(at_first > at_second, high, second)
        middle = 0.5 * (low + high)
        return self.one_m(index, start + middle[:, None] * (end - start))


def _halves(size_m: Any) -> Array:
    halves = np.zeros(3)
    halves[: len(size_m)] = 0.5 * np.asarray(size_m, dtype=float)
    return halves


def _axes(roll: float, pitch: float, yaw: float) -> Array:
    """Local axes as rows: rolled about x, then nose down about y, then left about z."""
    about_x = np.array(
        [[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]
    )
    about_y = np.array(
        [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    )
    about_z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return np.asarray((about_z @ about_y @ about_x).T)
