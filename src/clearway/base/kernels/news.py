"""Who is told that something is being compiled: whoever waits, and whoever asks."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FIRST_S, NEXT_S = 1.5, 10.0
"""Seconds of compiling after which a word is due, and those until the next."""
Listener = Callable[[str], None]
"""Called with the name of each loop once it is compiled."""

_log = logging.getLogger("clearway")


@dataclass
class CompileNews:
    """What this process has compiled and loaded so far."""

    loaded: int = 0
    compiled: int = 0
    spent_s: float = 0.0
    listener: Listener | None = None
    _begun: list[float] = field(default_factory=list)
    _next_s: float = FIRST_S

    def begins(self) -> None:
        """A loop is being compiled, perhaps within another that calls it."""
        self._begun.append(time.monotonic())

    def ends(self, name: str, kept_in: Path | None) -> None:
        """It is compiled; say so if that takes long altogether."""
        since = self._begun.pop() if self._begun else time.monotonic()
        self.compiled += 1
        spent_s = self.spent_s + time.monotonic() - (self._begun[0] if self._begun else since)
        if not self._begun:
            self.spent_s = spent_s
        if self.listener is not None:
            self.listener(name)
        elif spent_s >= self._next_s:
            self._next_s = spent_s + NEXT_S
            kept = f"kept in {kept_in} for later runs" if kept_in else "kept nowhere"
            _log.warning(
                "clearway compiles for this machine, once: %d loop%s in %.0f s so far, %s",
                self.compiled,
                "" if self.compiled == 1 else "s",
                spent_s,
                kept,
            )


NEWS = CompileNews()


@contextmanager
def told_to(listener: Listener) -> Iterator[None]:
    """Tell a listener instead of the log while the block runs."""
    before, NEWS.listener = NEWS.listener, listener
    try:
        yield
    finally:
        NEWS.listener = before


def nowhere_to_keep() -> None:
    """Say that compiled code cannot be written anywhere."""
    named = os.environ.get("CLEARWAY_CACHE")
    tried = f"CLEARWAY_CACHE ({named})" if named else "the user's cache folder"
    _log.warning(
        "compiled code cannot be kept: neither beside the package nor in %s can anything be "
        "written, so every run compiles anew; CLEARWAY_CACHE names a folder that can",
        tried,
    )
