"""The decorators for hot loops: numba, compiled on first use and cached on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

from clearway.base.kernels.cache import KernelCache
from clearway.base.kernels.interrupts import compiled_undisturbed

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile with numba on first call; the machine code is kept between runs (`base.kernels`).

    One thread, IEEE arithmetic (NaN is honoured). Keeps the signature for type checkers.
    """
    return _kept(function, counts=True)


def borrowing(function: Function) -> Function:
    """As `compiled`, for what makes no arrays and returns none, but numbers or nothing.

    It borrows the arrays that it is given and counts no references to them. Counting takes longer
    than the arithmetic of most loops, at every look into a tuple of arrays; so loops that matter
    stand in such functions, and who calls them makes the arrays. Whatever it calls must return
    numbers or nothing too, or what that returns is never freed (`tests/base/test_compiled.py`).
    """
    return _kept(function, counts=False)


def inlined(function: Function) -> Function:
    """As `borrowing`, and written into whoever calls it.

    An array is passed as half a dozen numbers, a tuple of arrays as a hundred, which takes as long
    as a short loop. For what is called from one place or two, and very often.
    """
    return _kept(function, counts=False, written_in=True)


def _kept(function: Function, *, counts: bool, written_in: bool = False) -> Function:
    # Told either way: what is left open, a function takes over from whoever calls it first.
    options: dict[str, Any] = {
        "error_model": "numpy",
        "_nrt": counts,
        "forceinline": written_in,
    }
    dispatcher: Any = numba.njit(**options)(function)
    if dispatcher is not function:  # as it is where numba is told to compile nothing
        dispatcher._cache = KernelCache(function)
        dispatcher.compile = compiled_undisturbed(dispatcher)
    return cast(Function, dispatcher)


def plain(values: npt.NDArray[Any], dtype: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
    """An array of the kind that compiled loops mostly get: writable, C-contiguous, of a type.

    For what may be anybody's: of another kind, a loop would be compiled anew. Copies only then.
    """
    if values.flags.carray and values.dtype == dtype:
        return values
    return np.array(values, dtype=dtype, order="C")


def sealed(fresh: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """An array that nobody else writes, from now on read only: of one kind for compiled loops."""
    fresh.setflags(write=False)
    return fresh


def read_only(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """A C-contiguous float64 view that cannot be written: one array type for compiled loops.

    Compiled code tells writable from read-only arrays; entry points that pass everything through
    here never compile a second version in flight. Copies only what is not contiguous float64.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:
        flags = values.flags
        if flags.c_contiguous and not flags.writeable and flags.aligned:
            return values
    view = np.ascontiguousarray(values, dtype=np.float64).view()
    view.setflags(write=False)
    return view
