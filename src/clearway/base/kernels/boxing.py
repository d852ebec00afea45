"""Ctrl-C while compiled code runs: raised after it has returned, never in the middle of that.

numba asks a function of Python for the class of each array that compiled code returns. Python looks
at pending signals whenever one of its functions begins, so that Ctrl-C would be raised there, where
numba does not look for errors: a SystemError nearly always, and sometimes the end of the process.
A cache in C in front of that function leaves Python nothing to begin.
"""

from __future__ import annotations

from functools import lru_cache

from numba.core import serialize


def let_no_signal_in() -> None:
    """Put a cache before what numba asks, once; numba remembers its own answers for ever too."""
    asked = getattr(serialize, "_numba_unpickle", None)
    if asked is not None and not hasattr(asked, "cache_info"):
        serialize._numba_unpickle = lru_cache(maxsize=None)(asked)
