"""Where a result comes from: version, command, libraries, and the files that went in."""

from __future__ import annotations

import hashlib
import platform
import shlex
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from clearway.base.version import __version__

LIBRARIES = ("numpy",)
CHUNK = 1 << 20

_command: list[str] = []


def began_as(arguments: Sequence[str]) -> None:
    """Remember the command line of this process, without the program's name."""
    _command[:] = arguments


def provenance(inputs: Iterable[str | Path] = ()) -> dict[str, Any]:
    """What to store beside a result, as plain values.

    inputs: files that it was made of; each is named with its SHA-256, those that cannot be read
    with None. `command` is None where no command line began it.
    """
    return {
        "clearway": __version__,
        "command": shlex.join(["clearway", *_command]) if _command else None,
        "python": platform.python_version(),
        **{name: _version(name) for name in LIBRARIES},
        "inputs": {Path(path).name: sha256_of(Path(path)) for path in inputs},
    }


def sha256_of(path: Path) -> str | None:
    """Hash of a file's bytes; None where it is none that can be read."""
    if not path.is_file():
        return None
    found = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while block := file.read(CHUNK):
                found.update(block)
    except OSError:
        return None
    return found.hexdigest()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
