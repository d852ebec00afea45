"""Arrays that are kept but seldom looked at, compressed without loss."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import FloatArray, IntArray
from clearway.base.brief import one_line

LEVEL = 1
"""Of compression: the quickest, since most of what is packed is nobody's to look at."""


@dataclass(frozen=True, slots=True, eq=False)
class PackedArrays:
    """Several arrays in one piece of memory; `unpack` makes equal ones."""

    data: bytes
    kinds: tuple[tuple[str, tuple[int, ...]], ...]
    """Type and shape of each."""

    @classmethod
    def of(cls, *arrays: npt.NDArray[Any]) -> PackedArrays:
        """Pack arrays of plain numbers."""
        data = b"".join(array.tobytes() for array in arrays)
        kinds = tuple((array.dtype.str, array.shape) for array in arrays)
        return cls(zlib.compress(data, LEVEL), kinds)

    def unpack(self) -> tuple[npt.NDArray[Any], ...]:
        """The arrays, made anew at every call."""
        data, start, arrays = bytearray(zlib.decompress(self.data)), 0, []
        for kind, shape in self.kinds:
            count = int(np.prod(shape))
            arrays.append(np.frombuffer(data, kind, count, start).reshape(shape))
            start += arrays[-1].nbytes
        return tuple(arrays)

    def __repr__(self) -> str:
        return one_line("PackedArrays", (f"{len(self.kinds)} in {len(self.data)} bytes",))


@dataclass(frozen=True, slots=True, eq=False)
class PackedVoxels:
    """Which cubes of a fixed lattice hold any of some points."""

    voxel_m: float
    low: tuple[int, ...]
    """The lowest cube along each axis."""
    shape: tuple[int, ...]
    """Cubes along each axis, of the box that holds all."""
    steps: PackedArrays
    """From each cube to the next one, in the row of all of that box, the first from before it."""

    @classmethod
    def of(cls, points_m: FloatArray, voxel_m: float) -> PackedVoxels:
        """Pack the cubes that hold points [n, 3]."""
        if not len(points_m):
            return cls(voxel_m, (0, 0, 0), (0, 0, 0), PackedArrays.of(np.zeros(0, dtype=np.int64)))
        low, shape, flat = _in_a_row(points_m, voxel_m)
        flat.sort()
        steps = np.diff(flat, prepend=-1)
        steps = steps[steps > 0]
        small = np.int32 if steps.max() < 2**31 else np.int64
        packed = PackedArrays.of(steps.astype(small))
        return cls(voxel_m, tuple(low.tolist()), tuple(shape.tolist()), packed)

    def centers_m(self) -> FloatArray:
        """[n, 3] the middles of the cubes: `voxel_centers` of the points."""
        (steps,) = self.steps.unpack()
        if not len(steps):
            return np.zeros((0, 3))
        index = np.stack(np.unravel_index(np.cumsum(steps, dtype=np.int64) - 1, self.shape), axis=1)
        return np.asarray((index + np.array(self.low) + 0.5) * self.voxel_m)


def voxel_centers(points_m: FloatArray, voxel_m: float) -> FloatArray:
    """[n, 3] centres of the cubes of a fixed lattice that hold points, in a fixed order."""
    return PackedVoxels.of(points_m, voxel_m).centers_m()


def one_a_voxel(points_m: FloatArray, voxel_m: float) -> IntArray:
    """[n] index of the first point in each cube of a fixed lattice that holds any."""
    if not len(points_m):
        return np.zeros(0, dtype=np.int64)
    return np.unique(_in_a_row(points_m, voxel_m)[2], return_index=True)[1]


def _in_a_row(points_m: FloatArray, voxel_m: float) -> tuple[IntArray, IntArray, IntArray]:
    """The lowest cube [3] of those that hold points [n, 3], how many there are along each axis of
    their box [3], and the number in it of each point's cube [n]."""
    index = np.floor(points_m / voxel_m).astype(np.int64)
    low = index.min(axis=0)
    index -= low
    shape = index.max(axis=0) + 1
    return low, shape, np.ravel_multi_index(tuple(index.T), tuple(shape))
