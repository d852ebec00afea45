"""A core put into a checkout, with a stamp of the sources that it was made from."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

from clearway_build.build import CORE

STAMP = "_core.stamp"
MARK = b"@compiled"


def place(root: Path, core: Path) -> Path:
    """Put a core into the checkout's package in one move, and beside it the stamp.

    The stamp has a line for every file with kernels, and for what else the translator has read:
    hash, time of the last change, path within the package (`clearway.base.core_file` reads it).
    """
    package = root / "src" / "clearway"
    base = package / "base"
    read = root / "build" / "core" / "source" / "read.txt"
    besides = read.read_text().splitlines() if read.is_file() else []
    files = {path for path in package.rglob("*.py") if MARK in path.read_bytes()}
    files |= {path for path in map(package.joinpath, besides) if path.is_file()}
    (base / STAMP).unlink(missing_ok=True)
    half = base / f".{CORE}"
    shutil.copyfile(core, half)
    half.replace(base / CORE)
    lines = [
        f"{hashlib.sha256(path.read_bytes()).hexdigest()} {path.stat().st_mtime_ns} "
        f"{path.relative_to(package)}\n"
        for path in sorted(files)
    ]
    (base / STAMP).write_text("".join(lines))
    return base / CORE
