"""The one decorator for hot loops: numba, compiled on first use and cached on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

from clearway.base.kernels.cache import KernelCache

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile with numba on first call; the machine code is kept between runs (`base.kernels`).

    One thread, IEEE arithmetic (NaN is honoured). Keeps the signature for type checkers.
    """
    dispatcher: Any = numba.njit(error_model="numpy")(function)
    if dispatcher is not function:  # as it is where numba is told to compile nothing
        dispatcher._cache = KernelCache(function)
    return cast(Function, dispatcher)


def read_only(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """A C-contiguous float64 view that cannot be written: one array type for compiled loops.

    Compiled code tells writable from read-only arrays; entry points that pass everything through
    here never compile a second version in flight. Copies only what is not contiguous float64.
    """
    view = np.ascontiguousarray(values, dtype=np.float64).view()
    view.setflags(write=False)
    return view
