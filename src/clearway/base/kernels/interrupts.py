"""Ctrl-C while compiled code runs or is loaded: raised after that, never in the middle of it.

numba asks a function of Python for the class of each array that compiled code returns. Python looks
at pending signals whenever one of its functions begins, so that Ctrl-C would be raised there, where
numba does not look for errors: a SystemError nearly always, and sometimes the end of the process.
A cache in C in front of that function leaves Python nothing to begin.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from numba.core import serialize


def let_no_signal_in() -> None:
    """Put a cache before what numba asks, once; numba remembers its own answers for ever too."""
    asked = getattr(serialize, "_numba_unpickle", None)
    if asked is not None and not hasattr(asked, "cache_info"):
        serialize._numba_unpickle = lru_cache(maxsize=None)(asked)


@contextmanager
def signals_waiting() -> Iterator[None]:
    """Signals come when this is over: LLVM calls back into Python while it takes code in."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGALRM))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
