"""Results that are whole or absent: written aside, moved into place at the end."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clearway.base.errors import naming

RESULTS = Path("clearway-out")
"""Where commands write unless told otherwise, below the working folder."""


def folder_of(name: str) -> Path:
    """The folder of results called by a name, which may hold any letters but leads nowhere else."""
    letters = "".join(c if c.isalnum() or c in " ._-+" else "-" for c in name)
    return RESULTS / (letters.strip(" .-") or "unnamed")


@contextmanager
def staged(folder: str | Path) -> Iterator[Path]:
    """A scratch folder whose files move into `folder` when the block ends without an error.

    Files of the same name in an existing `folder` are replaced, others stay. After an error
    nothing is left. Raises InputError where the folder cannot be written.
    """
    target = Path(folder).absolute()
    with naming(folder, "written"):
        existing = nearest_folder(target)
        scratch = Path(tempfile.mkdtemp(prefix=f".{target.name}-", suffix=".part", dir=existing))
    try:
        with naming(folder, "written"):
            yield scratch
            _move(scratch, target)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


@contextmanager
def staged_file(path: str | Path) -> Iterator[Path]:
    """A scratch file that takes the place of `path` when the block ends without an error.

    After an error what was there before stays. What is no file (`/dev/stdout`, a pipe) is written
    into and stays what it is. Raises InputError where it cannot be written.
    """
    if _is_stream(Path(path)):
        with naming(path, "written"):
            yield Path(path)
        return
    with naming(path, "written"):
        target = Path(path).resolve()
        into = nearest_folder(target.parent)
        scratch = Path(tempfile.mkdtemp(prefix=f".{target.name}-", suffix=".part", dir=into))
    try:
        with naming(path, "written"):
            yield scratch / target.name
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(scratch / target.name, target)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


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


def _move(scratch: Path, target: Path) -> None:
    """Each file into its place; `os.replace` puts one there whole or not at all."""
    for source in sorted(path for path in scratch.rglob("*") if path.is_file()):
        destination = target / source.relative_to(scratch)
        destination.parent.mkdir(parents=True, exist_ok=True)
        os.replace(source, destination)
