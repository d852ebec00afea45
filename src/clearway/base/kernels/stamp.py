"""What compiled code follows from, as a hash: its file, all that it imports, and the compiler.

Hot loops take constants, other loops and the order of a tuple's fields from files that they import.
So code counts as fresh only if none of those has changed, however far away and whatever the times
of files say.
"""

from __future__ import annotations

import hashlib
import os
import re
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import llvmlite
import numba
from numba.core import config

PACKAGE = Path(__file__).parents[2]
_ROOT = str(PACKAGE)
_THIS = os.path.dirname(__file__)
_BEGAN_S = time.time() - 0.05  # Times of files lag behind the clock.
_IMPORTS = re.compile(
    rf"^[ \t]*from[ \t]+{PACKAGE.name}((?:\.\w+)*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)"
    rf"|^[ \t]*import[ \t]+{PACKAGE.name}((?:\.\w+)+)",
    re.MULTILINE,
)
_NAME = re.compile(r"\w+")


@cache
def stamp_of(file: str) -> str:
    """Hexadecimal hash for one file of the package.

    Raises OSError where sources cannot be read, or have changed since this process began, which may
    run what they were before.
    """
    digest = hashlib.sha256(repr(_compiler()).encode())
    for each in sorted(files_behind(file)):
        digest.update(f"{each[len(_ROOT) :]}\n".encode())
        digest.update(_content(each)[0])
    return digest.hexdigest()


def files_behind(file: str) -> frozenset[str]:
    """The file and all files of the package that it imports, directly or not, also for types;
    without those that only keep what was compiled."""
    found, waiting = {file}, [file]
    while waiting:
        fresh = {f for f in _content(waiting.pop())[1] - found if not f.startswith(_THIS)}
        found |= fresh
        waiting += fresh
    return frozenset(found)


@cache
def _content(file: str) -> tuple[bytes, frozenset[str]]:
    """Hash of a file, and which files of the package it imports."""
    with open(file, "rb") as opened:
        if os.fstat(opened.fileno()).st_mtime > _BEGAN_S:
            raise OSError(f"{file} has changed since this process began")
        source = opened.read()
    return hashlib.sha256(source).digest(), frozenset(_imported(source.decode()))


def _imported(source: str) -> Iterator[str]:
    for origin, names, module in _IMPORTS.findall(source):
        here = _file_of(origin or module)
        if here:
            yield here
        if here.endswith("__init__.py"):
            for name in _NAME.findall(names):
                there = _file_of(f"{origin}.{name}")
                if there:
                    yield there


@cache
def _file_of(dotted: str) -> str:
    """The file of a module by its name after the package's, as in `.base.grid`; empty if none."""
    place = _ROOT + dotted.replace(".", "/")
    return next((f for f in (f"{place}.py", f"{place}/__init__.py") if os.path.isfile(f)), "")


def _compiler() -> tuple[object, ...]:
    """Of the compiler, whatever changes what it makes of the same source."""
    return (
        numba.__version__,
        llvmlite.__version__,
        bool(getattr(config, "USING_SVML", False)),
        *(str(getattr(config, name, "")) for name in ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE")),
    )
