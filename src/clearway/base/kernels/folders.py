"""Where compiled code is kept between runs, and that no two processes compile the same at once."""

from __future__ import annotations

import os
import shutil
import time
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from clearway.base.cache_folder import NAMED, cache_folder, is_own, is_own_file, make_own
from clearway.base.kernels.stamp import PACKAGE

SHIPPED = Path(__file__).parent / "shipped"
"""Compiled code that comes with the package; never written to by a flight."""
KEPT_STAMPS = 4
"""Of each file of the package, of how many of its states compiled code is kept."""
LONGEST_WAIT_S = 120.0
"""How long the same work of another process is waited for."""


@lru_cache(maxsize=1)
def written_folder() -> Path | None:
    """Where compiled code is written to: `CLEARWAY_CACHE`, else beside the package, else in the
    user's cache; None where none of them can be written, or others can write into them too."""
    for folder in read_folders():
        with suppress(OSError):
            make_own(folder)
            if os.access(folder, os.W_OK | os.X_OK):
                return folder
    return None


@lru_cache(maxsize=1)
def read_folders() -> tuple[Path, ...]:
    """Where compiled code is looked for: what another user has compiled beside the package is there
    to be read for whoever cannot write to it. Those too that are not there yet: processes that
    begin side by side find what each of them keeps."""
    beside, users = PACKAGE / "__pycache__", cache_folder()
    places = [users, beside] if os.environ.get(NAMED) else [beside, users]
    folders = [place / "compiled" for place in places if place is not None]
    return tuple(folder for folder in folders if is_own(folder, _package(folder)))


def opened_own(path: Path) -> BinaryIO:
    """A file of compiled code, open; raises OSError, as where anybody else may have written it."""
    package = _package(path)
    file = path.open("rb")
    if is_own(path.parent, package) and is_own_file(os.fstat(file.fileno()), package):
        return file
    file.close()
    raise PermissionError(f"{path}: others can write it")


def _package(path: Path) -> Path | None:
    """The package, of what lies within it."""
    return PACKAGE if path.is_relative_to(PACKAGE) else None


def write_whole(path: Path, data: bytes) -> None:
    """Write beside the target and move into place; raises OSError."""
    if not path.parent.is_dir():
        make_own(path.parent)
        _forget_old(path.parent)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(data)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _forget_old(newest: Path) -> None:
    """Drop folders of the same file in older states than the last few."""
    name = newest.name.rpartition("-")[0]
    others = []
    for folder in newest.parent.glob(f"{name}-*"):
        with suppress(OSError):
            if folder.name.rpartition("-")[0] == name and folder != newest:
                others.append((folder.stat().st_mtime, folder))
    for _, folder in sorted(others, reverse=True)[KEPT_STAMPS - 1 :]:
        shutil.rmtree(folder, ignore_errors=True)


class Turns:
    """One process at a time for each name: bytes of one file are locked; where that cannot be done,
    nobody waits. The system frees what a process that has ended held."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "turns"
        self._file = -1

    def take(self, name: str) -> None:
        """Wait until no other process has the turn, or for long enough."""
        with suppress(ImportError, OSError):
            import fcntl

            if self._file < 0:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            until = time.monotonic() + LONGEST_WAIT_S
            while time.monotonic() < until:
                try:
                    fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _place(name))
                except (BlockingIOError, PermissionError):
                    time.sleep(0.02)
                else:
                    return

    def leave(self, name: str) -> None:
        """Let the next process have its turn."""
        with suppress(ImportError, OSError):
            import fcntl

            if self._file >= 0:
                fcntl.lockf(self._file, fcntl.LOCK_UN, 1, _place(name))


def _place(name: str) -> int:
    """A byte of the file for a name, the same in every process."""
    import zlib

    return zlib.crc32(name.encode())
