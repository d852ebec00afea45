"""Memory that is free in the process, given back to the system."""

from __future__ import annotations

import ctypes
import gc
import sys


def give_back() -> None:
    """Give back what a long flight has left free in between; nothing where the system has no way.

    glibc keeps freed pieces between others that are in use, tens of megabytes after an hour.
    """
    gc.collect()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)
