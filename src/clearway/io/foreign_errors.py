"""What libraries raise on damaged files, told in one way: which file, and what they made of it."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clearway.base.errors import ClearwayError, InputError

COMPLAINTS: tuple[type[Exception], ...] = (
    ValueError,
    RuntimeError,
    TypeError,
    LookupError,
    AttributeError,
    AssertionError,
    ArithmeticError,
    OSError,
    EOFError,
    MemoryError,
    struct.error,
    sqlite3.Error,
)
LONGEST = 160


@contextmanager
def damage_told(
    path: str | Path, kind: str, further: tuple[type[Exception], ...] = ()
) -> Iterator[None]:
    """Turn complaints of a library, `further` ones of its own too, into an InputError."""
    try:
        yield
    except ClearwayError:
        raise
    except (*COMPLAINTS, *further) as cause:
        reason = " ".join(str(cause).split())[:LONGEST]
        raise InputError(
            str(path), f"damaged or truncated {kind} ({type(cause).__name__}: {reason})"
        ) from cause
