"""Types of arrays, for all rooms; nothing heavier than NumPy comes with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
IndexArray = npt.NDArray[np.integer[Any]]
"""Indices of any width, as the stored trees keep them."""
BoolArray = npt.NDArray[np.bool_]
