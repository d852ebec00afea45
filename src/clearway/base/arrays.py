"""Types of arrays, for all rooms; nothing heavier than NumPy comes with them.

Compiled loops state the type and the dimensions of every array that they take: the build of the
core reads these names (`clearway_build.translate`). A digit is the number of dimensions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
IndexArray = npt.NDArray[np.integer[Any]]
"""Indices of any width, as the stored trees keep them."""
BoolArray = npt.NDArray[np.bool_]

Floats = npt.NDArray[np.float64]
Floats2 = npt.NDArray[np.float64]
Floats3 = npt.NDArray[np.float64]
Floats4 = npt.NDArray[np.float64]
Floats5 = npt.NDArray[np.float64]
StridedFloats = npt.NDArray[np.float64]
StridedFloats2 = npt.NDArray[np.float64]
"""Not contiguous: a column of another array, for example."""
Ints = npt.NDArray[np.int64]
Ints2 = npt.NDArray[np.int64]
Ints3 = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Bools2 = npt.NDArray[np.bool_]
Bools3 = npt.NDArray[np.bool_]
Int32s = npt.NDArray[np.int32]
Int32s2 = npt.NDArray[np.int32]
Int16s = npt.NDArray[np.int16]
Int8s = npt.NDArray[np.int8]
UInt8s = npt.NDArray[np.uint8]
UInt8s2 = npt.NDArray[np.uint8]
UInt8s3 = npt.NDArray[np.uint8]
UInt64s = npt.NDArray[np.uint64]
UInt64s2 = npt.NDArray[np.uint64]
UInt64s3 = npt.NDArray[np.uint64]
