"""A word to whoever waits: the first run compiles, and says so only when it takes long."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from clearway.cli.report import say

SLOW_S = 4.0


@contextmanager
def notice_when_slow() -> Iterator[None]:
    """Say what is going on if the block takes longer than a few seconds."""
    timer = threading.Timer(
        SLOW_S,
        say,
        ["still working: the first run compiles, half a minute or so; later runs start at once"],
    )
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
