"""What libraries raise on damaged files, told in one way: which file, and what they made of it."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

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
LONGEST_COMPLAINT = 160
TOO_MUCH = "it takes more memory than such a file can need"
"""Of a message about a file."""


@contextmanager
def damage_told(
    path: str | Path, kind: str, further: tuple[type[Exception], ...] = ()
) -> Iterator[None]:
    """Turn complaints of a library, `further` ones of its own too, into an InputError.

    Numbers that overflow or are none are no complaint: what is made of them is checked as values.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except InputError as error:
        if Path(path).stem in error.source or Path(error.source).is_file():
            raise
        problems = [f"{error.source}: {problem}" for problem in error.problems]
        raise InputError(str(path), problems) from error
    except ClearwayError:
        raise
    except (*COMPLAINTS, *further) as cause:
        reason = " ".join(str(cause).split())[:LONGEST_COMPLAINT]
        if isinstance(cause, MemoryError):
            reason = TOO_MUCH
        raise InputError(
            str(path), f"damaged or truncated {kind} ({type(cause).__name__}: {reason})"
        ) from cause
