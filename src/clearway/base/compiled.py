"""The decorator for hot loops: each is replaced by its translation in the compiled core.

Loops stay plain Python, which the build translates to C++ (`clearway_build`). The environment
variable CLEARWAY_CORE switches to another way to run the same source: `numba` compiles it at the
first call (a developer's reference, with the extra of that name), `python` runs it as it stands.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from clearway.base.core_file import CoreError, find_compiled_loop

Function = TypeVar("Function", bound=Callable[..., Any])

CORE = os.environ.get("CLEARWAY_CORE", "")
"""Which way loops run: empty for the compiled core, else one of `OTHERS`."""
OTHERS = ("numba", "python")


def compiled(function: Function) -> Function:
    """Replace a loop by compiled code that takes and returns the same, bit for bit.

    Raises CoreError where the core, or what CLEARWAY_CORE names, cannot be used.
    """
    if not CORE:
        return cast(Function, find_compiled_loop(function))
    if CORE not in OTHERS:
        raise CoreError(f"CLEARWAY_CORE={CORE}: type one of {', '.join(OTHERS)}, or unset it")
    if CORE == "python":
        # Of infinities and what is not a number the core makes the same, and warns of neither.
        return np.errstate(all="ignore")(function)
    try:
        numba: Any = import_module("numba")
    except ImportError as cause:
        raise CoreError(
            f"CLEARWAY_CORE=numba: {cause}. Type `pip install 'clearway[numba]'`, or unset it."
        ) from cause
    return cast(Function, numba.njit(error_model="numpy")(function))


def make_plain_array(
    values: npt.NDArray[Any], dtype: npt.DTypeLike = np.float64
) -> npt.NDArray[Any]:
    """Return an array that a loop may write to: writable, C-contiguous, of a type.

    Copies only what is of another kind.
    """
    if values.flags.carray and values.dtype == dtype:
        return values
    return np.array(values, dtype=dtype, order="C")


def seal(fresh: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return an array that nobody else writes, from now on read only."""
    fresh.setflags(write=False)
    return fresh


def read_only(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return a C-contiguous float64 view that cannot be written.

    Copies only what is not contiguous float64.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:
        flags = values.flags
        if flags.c_contiguous and not flags.writeable and flags.aligned:
            return values
    view = np.ascontiguousarray(values, dtype=np.float64).view()
    view.setflags(write=False)
    return view
