"""The journal of a campaign under way: a line a flight, on disk before the next one is counted.

A process may be killed at any moment. What it wrote last may then be torn: that line is cut off
when the campaign goes on, and its flight is flown again.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Generic, TypeVar

from clearway.base.errors import InputError, naming
from clearway.io.staging import growing_file

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Row = TypeVar("Row", bound="DataclassInstance")


class Journal(Generic[Row]):
    """An open journal; `rows` are those that were in it."""

    def __init__(self, file: IO[bytes], path: Path, rows: list[Row]) -> None:
        self._file, self._path = file, path
        self.rows = rows

    def append(self, row: Row) -> None:
        """Write a row; on return it is on disk. Raises InputError where it cannot be written."""
        with naming(self._path, "written"):
            _append(self._file, asdict(row))


@contextmanager
def open_journal(
    path: Path, settings: dict[str, str], kind: Callable[..., Row]
) -> Iterator[Journal[Row]]:
    """Open or begin a journal, for this process alone.

    settings: what the rows in it must have in common; raises InputError where those of the journal
    differ, where another process has it open, and where it cannot be written. kind: the dataclass
    of its rows.
    """
    with naming(path, "written"):
        path.parent.mkdir(parents=True, exist_ok=True)
    with growing_file(path) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not path.exists() or not os.path.samestat(os.fstat(file.fileno()), path.stat()):
                # Another process has just ended its campaign, and removed the journal.
                raise BlockingIOError
        except BlockingIOError as cause:
            raise InputError(str(path), "another campaign is writing to it") from cause
        with naming(path, "written"):
            rows = _begin(file, path, settings, kind)
        yield Journal(file, path, rows)


def check_settings(source: str, found: dict[str, Any], wanted: dict[str, str]) -> None:
    """Raise InputError where results were made with other settings than those wanted."""
    other = [
        f"{name} {found.get(name)!r} there, {value!r} now"
        for name, value in wanted.items()
        if found.get(name) != value
    ]
    if other:
        raise InputError(
            source,
            f"holds flights of other settings ({'; '.join(other)}): choose another --out, or "
            "remove it",
        )


def _begin(
    file: IO[bytes], path: Path, settings: dict[str, str], kind: Callable[..., Row]
) -> list[Row]:
    """Rows of whole lines; the file ends after the last of them, and has a head."""
    file.seek(0)
    head, *lines = _whole_lines(file) or [{}]
    if not head:
        _append(file, settings)
        _sync_folder(path.parent)
        return []
    check_settings(str(path), head, settings)
    return [kind(**line) for line in lines]


def _whole_lines(file: IO[bytes]) -> list[dict[str, Any]]:
    """Objects of the lines up to the first torn one; the file is cut there."""
    objects = []
    good = 0
    for line in file.read().splitlines(keepends=True):
        try:
            found = json.loads(line) if line.endswith(b"\n") else None
        except ValueError:
            found = None
        if not isinstance(found, dict):
            break
        objects.append(found)
        good += len(line)
    file.truncate(good)
    return objects


def _append(file: IO[bytes], values: dict[str, Any]) -> None:
    left = json.dumps(values, allow_nan=False).encode() + b"\n"
    while left:
        left = left[file.write(left) :]
    os.fsync(file.fileno())


def _sync_folder(folder: Path) -> None:
    """A new file's name is on disk only when its folder is."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
