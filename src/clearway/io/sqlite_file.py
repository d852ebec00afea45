"""SQLite files of strangers, read within bounds: their schema can hold programs."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any
from urllib.parse import quote

from clearway.base.errors import InputError

STEPS = 100_000
STEPS_A_BYTE = 20
MOST_STEPS = 20_000_000
"""Of SQLite's machine: how often it is looked at, and what a file of its size may need."""
MOST_VALUE_BYTES = 256_000_000
LEAST_VALUE_BYTES = 1_000_000
"""Of one text or blob, which is never larger than its file: bounds of what may be made of one."""
ROW_BYTES = 8
FEW_ROWS = 1_000
"""What a row takes of a file at least; so many are read of any file."""
LONGEST_PATTERN = 50
"""Of LIKE, which takes exponential time."""
INTERRUPTED = "interrupted"
"""What SQLite says of a query that was ended."""
PLAIN = re.compile(r"\s*CREATE\s+(TABLE|(UNIQUE\s+)?INDEX)\b", re.IGNORECASE)
"""Begins what a recorder has in its schema; views, triggers and virtual tables run programs."""
GENERATED = (2, 3)
"""In `hidden` of `table_xinfo`: columns that are computed."""


@contextmanager
def open_sqlite(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a file to be read: as long as its size may need, with values that fit into it.

    Raises KeyboardInterrupt where Ctrl-C ended a query, of which SQLite only says that it was
    interrupted.
    """
    size = path.stat().st_size
    left = MOST_STEPS + STEPS_A_BYTE * size
    place = f"file:{quote(str(path.absolute()))}?immutable=1"

    def look() -> int:
        nonlocal left
        left -= STEPS
        return int(left < 0)

    with closing(sqlite3.connect(place, uri=True)) as base:
        most = min(MOST_VALUE_BYTES, max(LEAST_VALUE_BYTES, size))
        base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, most)
        base.setlimit(sqlite3.SQLITE_LIMIT_LIKE_PATTERN_LENGTH, LONGEST_PATTERN)
        base.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        base.execute("PRAGMA trusted_schema = OFF")
        base.set_progress_handler(look, STEPS)
        try:
            yield base
        except sqlite3.OperationalError as cause:
            if INTERRUPTED not in str(cause):
                raise
            if left >= 0:
                raise KeyboardInterrupt from cause
            raise InputError(str(path), "reading it does not come to an end") from cause


def query_rows(path: Path, cursor: sqlite3.Cursor) -> Iterator[Any]:
    """The rows of a query; InputError for more than a file of its size can hold."""
    most = FEW_ROWS + path.stat().st_size // ROW_BYTES
    yield from islice(cursor, most)
    if next(cursor, None) is not None:
        raise InputError(str(path), f"damaged: more than the {most:,} rows that fit into it")


def refuse_programs(path: Path, base: sqlite3.Connection) -> None:
    """Raise InputError for a schema with anything but tables, whose columns are all stored, and
    their indices."""
    found = base.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL")
    for name, text in query_rows(path, found):
        if not isinstance(text, str) or not PLAIN.match(text):
            kind = " ".join(str(text).split()[:2])
            raise InputError(str(path), f"no recording: {name!s:.40} is made by {kind:.40}")
        columns = base.execute("SELECT hidden FROM pragma_table_xinfo(?)", (name,))
        if any(hidden in GENERATED for (hidden,) in columns):
            raise InputError(str(path), f"no recording: {name!s:.40} has computed columns")
