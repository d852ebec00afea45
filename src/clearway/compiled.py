"""The one decorator for hot loops: numba, compiled on first use and cached on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile with numba on first call; the machine code is cached beside the source.

    One thread, IEEE arithmetic (NaN is honoured). Keeps the signature for type checkers.
    """
    dispatcher: Any = numba.njit(cache=True, error_model="numpy")
    return cast(Function, dispatcher(function))
