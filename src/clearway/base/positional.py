"""Arguments by position beyond the second: deprecated in the public names, for one version."""

from __future__ import annotations

import functools
import inspect
import sys
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

ALLOWED = 2
"""Arguments that may be given by position, besides the object or class itself."""

Public = TypeVar("Public", bound=Callable[..., Any])


def keywords_beyond_two(public: Public) -> Public:
    """A public class, method or function that warns where more than two come by position.

    Calls from within clearway are left alone; the check costs well under a microsecond.
    """
    if isinstance(public, type):
        set_init = public.__init__  # type: ignore[misc]
        public.__init__ = _warned(set_init, public.__name__, 1)  # type: ignore[misc]
        return public
    first = next(iter(inspect.signature(public).parameters), "")
    bound = int(first in ("self", "cls"))
    return _warned(public, public.__qualname__, bound)  # type: ignore[return-value]


def _warned(function: Callable[..., Any], name: str, bound: int) -> Callable[..., Any]:
    limit = ALLOWED + bound

    @functools.wraps(function)
    def checked(*args: Any, **named: Any) -> Any:
        if len(args) > limit and not _within_clearway():
            beyond = list(inspect.signature(function).parameters)[limit : len(args)]
            warnings.warn(
                f"{name}: more than {ALLOWED} arguments by position are deprecated and will be "
                f"refused in the next version; name {', '.join(beyond)}",
                DeprecationWarning,
                stacklevel=2,
            )
        return function(*args, **named)

    return checked


def _within_clearway() -> bool:
    """Whether the caller of the checked function is clearway's own code."""
    caller = sys._getframe(2).f_globals.get("__name__", "")
    return str(caller).partition(".")[0] == "clearway"
