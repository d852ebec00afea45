"""Ctrl-C while compiled code is made, loaded or runs: raised after that, never in the middle of it.

numba asks a function of Python for the class of each array that compiled code returns. Python looks
at pending signals whenever one of its functions begins, so that Ctrl-C would be raised there, where
numba does not look for errors: a SystemError nearly always, and sometimes the end of the process.
A cache in C in front of that function leaves Python nothing to begin. While LLVM makes or loads
code, which calls back into Python too, the handlers themselves wait: blocked signals would not,
since the kernel hands them to another thread of the process, of which Python takes them as well.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from types import FrameType
from typing import Any

from numba.core import serialize

WAITING = (signal.SIGINT, signal.SIGALRM)


def let_no_signal_in() -> None:
    """Put a cache before what numba asks, once; numba remembers its own answers for ever too."""
    asked = getattr(serialize, "_numba_unpickle", None)
    if asked is not None and not hasattr(asked, "cache_info"):
        serialize._numba_unpickle = lru_cache(maxsize=None)(asked)


class _Gate:
    """Handlers of signals, put off until the gate is open again; of the main thread alone, since
    Python calls them nowhere else."""

    def __init__(self) -> None:
        self.depth = 0
        self._handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}
        self._came: list[tuple[Callable[[int, FrameType | None], Any], int]] = []

    def shut(self) -> None:
        self.depth += 1
        if self.depth == 1:
            for number in WAITING:
                handler = signal.getsignal(number)
                if callable(handler):
                    self._handlers[number] = handler
                    signal.signal(number, self._comes)

    def open(self) -> None:
        self.depth = max(0, self.depth - 1)
        if self.depth == 0:
            while self._handlers:
                number, handler = self._handlers.popitem()
                signal.signal(number, handler)
            self.let_in()

    def let_in(self) -> None:
        """Call the handlers of what came."""
        while self._came:
            handler, number = self._came.pop()
            handler(number, None)

    def _comes(self, number: int, frame: FrameType | None) -> None:
        del frame
        self._came.append((self._handlers[number], number))


_GATE = _Gate()


def waits(number: int) -> Callable[[int, FrameType | None], Any] | None:
    """The handler of a signal that is put off now; None where none is."""
    return _GATE._handlers.get(number)


@contextmanager
def signals_waiting() -> Iterator[None]:
    """Signals are told when this is over."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    try:
        _GATE.shut()
        yield
    finally:
        _GATE.open()


def compiled_undisturbed(dispatcher: Any) -> Callable[[Any], Any]:
    """Compiling of a loop during which signals wait: what is left half made in LLVM ends the
    process sooner or later. Between a loop and those that it calls they are let in."""
    compile_it, known = dispatcher.compile, dispatcher.overloads

    def compile_whole(signature: Any) -> Any:
        with signals_waiting():
            before = len(known)
            found = compile_it(signature)
            if len(known) > before and _GATE.depth > 1:
                _GATE.let_in()
            return found

    return compile_whole
