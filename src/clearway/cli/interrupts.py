"""Ctrl-C that ends a command soon, whatever a library is doing at that moment."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType

GRACE_S = 0.7
"""How long a command may take to come to Ctrl-C, before it is ended where it is."""
INTERRUPTED = 130


def end_soon_on_interrupt() -> None:
    """Raise KeyboardInterrupt at Ctrl-C as ever, but end the process where that does not come.

    Python handles no signal until a library returns. A thread then ends the process, after it has
    removed the scratch folders. A handler that replaces this one, as in a live session, is left
    alone.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return
    raised = threading.Event()

    def interrupt(number: int, frame: FrameType | None) -> None:
        raised.set()
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, interrupt)
    told, telling = os.pipe()
    os.set_blocking(telling, False)
    signal.set_wakeup_fd(telling, warn_on_full_buffer=False)
    # The thread takes no signal itself: whoever blocks one in this thread means the process.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    threading.Thread(target=_watch, args=(told, raised, interrupt), daemon=True).start()
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _watch(told: int, raised: threading.Event, handler: object) -> None:
    while numbers := os.read(told, 64):
        is_due = signal.SIGINT in numbers and not raised.wait(GRACE_S)
        if is_due and signal.getsignal(signal.SIGINT) is handler:
            _end()


def _end() -> None:
    from clearway.io.staging import remove_scratch

    remove_scratch()
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)
