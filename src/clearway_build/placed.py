"""A core put into a checkout, with a stamp of the sources that it was made from."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

from clearway_build.build import CORE
from clearway_build.translate import READ

STAMP = "_core.stamp"


def place(root: Path, core: Path) -> Path:
    """Put a core into the checkout's package in one move, and beside it the stamp.

    The stamp has a line for every file that the translator has read: hash, time of the last change,
    path below `src` (`clearway.base.core_file` reads it).
    """
    source = root / "src"
    base = source / "clearway" / "base"
    read = (root / "build" / "core" / "source" / READ).read_text().splitlines()
    (base / STAMP).unlink(missing_ok=True)
    half = base / f".{CORE}"
    shutil.copyfile(core, half)
    half.replace(base / CORE)
    lines = []
    for name, digest in (line.rsplit(" ", 1) for line in read):
        path = source / name
        changed_ns = path.stat().st_mtime_ns
        if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            changed_ns = 0  # Edited while the core was made: it is stale, and looked at again.
        lines.append(f"{digest} {changed_ns} {name}\n")
    (base / STAMP).write_text("".join(lines))
    return base / CORE
