"""Distance to obstacles on a regular grid of voxels, and what it says about ways through."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray

MOST_PIECES = 50_000
"""Of a straight way, looked at together."""
Distance = Callable[[FloatArray], FloatArray]
"""World points [n, 3] -> signed distance [n] in metres to the nearest surface."""

HALF_DIAGONAL = 0.5 * np.sqrt(3.0)
"""Of a voxel, in units of its width."""


@dataclass(frozen=True, eq=False)
class VoxelField:
    """Signed distances at the centres of cubic voxels, world frame."""

    origin_m: FloatArray
    """[3] centre of voxel (0, 0, 0)."""
    width_m: float
    distance_m: FloatArray
    """[nx, ny, nz]"""

    @classmethod
    def sample(
        cls,
        distance: Distance,
        low_m: FloatArray,
        high_m: FloatArray,
        anchor_m: FloatArray,
        width_m: float,
    ) -> VoxelField:
        """Voxels that cover a box, one of them centred on the anchor."""
        below = np.ceil((anchor_m - low_m) / width_m)
        counts = (below + np.ceil((high_m - anchor_m) / width_m)).astype(np.int64) + 1
        origin = anchor_m - below * width_m
        ticks = [origin[axis] + width_m * np.arange(counts[axis]) for axis in range(3)]
        centers = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        return cls(origin, width_m, distance(centers).reshape(counts))

    def centers_m(self, voxels: IntArray) -> FloatArray:
        """World points [n, 3] of flat voxel numbers [n]."""
        index = np.stack(np.unravel_index(voxels, self.distance_m.shape), axis=-1)
        result: FloatArray = self.origin_m + self.width_m * index
        return result

    def within(self, point_m: FloatArray, radius_m: float) -> IntArray:
        """Flat numbers of voxels whose centres lie within a radius of a world point."""
        ticks = [
            (self.origin_m[axis] + self.width_m * np.arange(count) - point_m[axis]) ** 2
            for axis, count in enumerate(self.distance_m.shape)
        ]
        squares = ticks[0][:, None, None] + ticks[1][None, :, None] + ticks[2][None, None, :]
        return np.flatnonzero(squares <= radius_m**2)

    def ceiling(self) -> VoxelField:
        """Upper bounds of the distance anywhere in each voxel instead of at its centre."""
        return replace(self, distance_m=self.distance_m + HALF_DIAGONAL * self.width_m)

    def refine(self, distance: Distance, where: BoolArray, factor: int) -> VoxelField:
        """A ceiling with each voxel cut in `factor` along each axis, sampled anew `where` marked.

        factor: odd. Elsewhere the parts keep their voxel's bound.
        """
        width = self.width_m / factor
        bounds = self.distance_m
        for axis in range(3):
            bounds = np.repeat(bounds, factor, axis=axis)
        voxels = np.argwhere(where)
        parts = np.stack(np.meshgrid(*[np.arange(factor)] * 3, indexing="ij"), axis=-1)
        index = (factor * voxels[:, None, :] + parts.reshape(1, -1, 3)).reshape(-1, 3)
        origin = self.origin_m - 0.5 * (factor - 1) * width
        bounds[tuple(index.T)] = distance(origin + width * index) + HALF_DIAGONAL * width
        return VoxelField(origin, width, bounds)

    def safe_steps(self, margin_m: float) -> tuple[IntArray, IntArray, FloatArray]:
        """Pairs of neighbouring voxels [e], [e] and the length [e] of the steps between them.

        A step of length l keeps the margin if the distances at its ends sum to 2 margin + l:
        a distance cannot change faster than the place.
        """
        flat = np.arange(self.distance_m.size).reshape(self.distance_m.shape)
        starts, ends, lengths = [], [], []
        for one, other, length in _neighbours(self.width_m):
            safe = self.distance_m[one] + self.distance_m[other] >= 2.0 * margin_m + length
            starts.append(flat[one][safe])
            ends.append(flat[other][safe])
            lengths.append(np.full(len(starts[-1]), length))
        return np.concatenate(starts), np.concatenate(ends), np.concatenate(lengths)


def _neighbours(
    width_m: float,
) -> Iterator[tuple[tuple[slice, ...], tuple[slice, ...], float]]:
    """Index ranges of voxels and of their neighbours, and how far apart; each pair once."""
    for step in product((-1, 0, 1), repeat=3):
        if step > (0, 0, 0):
            one = tuple(slice(max(-s, 0), -s if s > 0 else None) for s in step)
            other = tuple(slice(max(s, 0), s if s < 0 else None) for s in step)
            yield one, other, width_m * float(np.linalg.norm(step))


def segment_is_clear(
    distance: Distance, start_m: FloatArray, end_m: FloatArray, margin_m: float, step_m: float
) -> bool:
    """Whether the straight way between two points surely keeps a margin.

    A distance cannot change faster than the place: pieces that are far enough from everything for
    their length are clear, others are halved until they are no longer than a step. A way of which
    more than `MOST_PIECES` are in doubt counts as not clear: it runs along walls for kilometres.
    """
    way = end_m - start_m
    length = float(np.linalg.norm(way))
    pieces = np.array([[0.0, 1.0]])
    while len(pieces):
        if len(pieces) > MOST_PIECES:
            return False
        at_ends = distance(start_m + pieces.reshape(-1, 1) * way).reshape(-1, 2)
        spans = (pieces[:, 1] - pieces[:, 0]) * length
        doubtful = at_ends.sum(axis=1) < 2.0 * margin_m + spans
        if np.any(doubtful & ((spans <= step_m) | (at_ends.min(axis=1) < margin_m))):
            return False
        first, last = pieces[doubtful].T
        middle = 0.5 * (first + last)
        pieces = np.concatenate(
            [np.stack([first, middle], axis=1), np.stack([middle, last], axis=1)]
        )
    return True
