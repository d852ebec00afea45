"""Results that are whole or absent: written to the side, moved into place at the end."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from clearway.base.errors import InputError, naming

RESULTS = Path("clearway-out")
"""Where commands write unless told otherwise, below the working folder."""
LINK = "a link, which may lead anywhere; remove it, or give another folder"
"""Of a message."""


def name_results_folder(name: str) -> Path:
    """The folder of results called by a name, which may hold any letters but leads nowhere else."""
    letters = "".join(c if c.isalnum() or c in " ._-+" else "-" for c in name)
    return RESULTS / (letters.strip(" .-") or "unnamed")


@contextmanager
def stage_folder(folder: str | Path) -> Iterator[Path]:
    """A scratch folder whose files move into `folder` when the block ends without an error.

    Files of the same name in an existing `folder` are replaced, others stay. After an error
    nothing is left. Raises InputError where the folder cannot be written, or a link in it leads
    elsewhere.
    """
    target = Path(folder).absolute()
    with naming(folder, "written"):
        existing = nearest_folder(target)
        scratch = _scratch(target, existing)
    try:
        with naming(folder, "written"):
            yield scratch
            _move(scratch, target)
    finally:
        _drop(scratch)


@contextmanager
def stage_file(path: str | Path) -> Iterator[Path]:
    """A scratch file that takes the place of `path` when the block ends without an error.

    After an error what was there before stays. What is no file (`/dev/stdout`, a pipe) is written
    into and stays what it is. A link is replaced, and not what it leads to. Raises InputError where
    it cannot be written.
    """
    if _is_stream(Path(path)):
        with naming(path, "written"):
            yield Path(path)
        return
    with naming(path, "written"):
        target = Path(path).absolute()
        into = nearest_folder(target.parent)
        scratch = _scratch(target, into)
    try:
        with naming(path, "written"):
            yield scratch / target.name
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(scratch / target.name, target)
    finally:
        _drop(scratch)


def _scratch(target: Path, folder: Path) -> Path:
    made = Path(tempfile.mkdtemp(prefix=f".{target.name}-", suffix=".part", dir=folder))
    _there.add(made)
    return made


def _drop(scratch: Path) -> None:
    shutil.rmtree(scratch, ignore_errors=True)
    _there.discard(scratch)


def remove_scratch() -> None:
    """Remove all scratch folders, before a process ends without leaving its blocks."""
    for scratch in tuple(_there):
        _drop(scratch)


_there: set[Path] = set()
"""Scratch folders of blocks that have not ended."""


def _is_stream(path: Path) -> bool:
    """Whether a path stands for something that is written to, not for a file of its own."""
    beside = path.absolute().parts[1:2] in (("dev",), ("proc",))
    return path.exists() and not path.is_dir() and (beside or not path.is_file())


def nearest_folder(target: Path) -> Path:
    """The folder itself or its nearest existing parent: a scratch folder there moves at once."""
    for folder in (target, *target.parents):
        if folder.exists():
            if not folder.is_dir():
                raise NotADirectoryError(20, f"{folder} is a file, not a folder")
            return folder
    raise FileNotFoundError(2, "no such folder")


def leads_elsewhere(folder: Path, name: str | Path) -> Path | None:
    """The first link between a folder and what has a name in it; None where there is none.

    Who fills a folder can lead what is written or removed by name to any place by such a link.
    """
    above = [folder / each for each in Path(name).parents]
    return next((each for each in above[-2::-1] if each.is_symlink()), None)


@contextmanager
def growing_file(path: Path) -> Iterator[IO[bytes]]:
    """A file, open to be read and added to, made if it is not there; never another one that a link
    leads to. Raises InputError where it cannot be written."""
    with naming(path, "written"):
        if path.is_symlink():
            raise InputError(str(path), f"cannot be written: it is {LINK}")
        handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    # Unbuffered: what a full disk refused is not tried again when the file is closed.
    with os.fdopen(handle, "a+b", buffering=0) as file:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
            raise InputError(str(path), "cannot be written: it is no file, or has other names too")
        yield file


def _move(scratch: Path, target: Path) -> None:
    """Each file into its place; `os.replace` puts one there whole or not at all, and replaces a
    link, not what it leads to."""
    names = sorted(path.relative_to(scratch) for path in scratch.rglob("*") if path.is_file())
    for name in names:
        link = leads_elsewhere(target, name)
        if link is not None:
            raise InputError(str(link), f"cannot be written into: it is {LINK}")
    for name in names:
        destination = target / name
        destination.parent.mkdir(parents=True, exist_ok=True)
        os.replace(scratch / name, destination)
