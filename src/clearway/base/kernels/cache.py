"""Compiled code of one function on disk: what ships with the package first, then what was kept.

Code is found by a stamp of all sources that it follows from (`kernels.stamp`), so that what is
stale is never even opened; files carry a checksum, and what is damaged is compiled anew.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, partial
from pathlib import Path
from struct import Struct
from typing import Any, BinaryIO

from llvmlite import binding
from numba.core import config
from numba.core.caching import _Cache

from clearway.base.errors import ClearwayError
from clearway.base.kernels.folders import (
    SHIPPED,
    Turns,
    opened_own,
    read_folders,
    write_whole,
    written_folder,
)
from clearway.base.kernels.interrupts import let_no_signal_in, signals_waiting
from clearway.base.kernels.names import number_apart
from clearway.base.kernels.news import NEWS, nowhere_to_keep
from clearway.base.kernels.rebuilt import KeptCode, kept_code, read, rebuilt, written
from clearway.base.kernels.stamp import PACKAGE, stamp_of

LEVEL = "x86-64-v3"
"""The common set of instructions that shipped code is made for."""
LEVEL_NEEDS = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
VERSION = 4
"""Raised whenever what was kept before must not be loaded, as when the layout of files changes."""
HEAD = Struct("<Q32s")
"""Before each part of a file: its length and checksum."""
Key = tuple[Any, ...]

let_no_signal_in()
number_apart()


class KernelCache(_Cache):
    """As numba asks for it, one for each function; touches no file before the first call."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        self._file = function.__code__.co_filename
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder that is written to; empty where none can be."""
        folder = written_folder()
        return str(folder or "")

    def enable(self) -> None:
        """Look for code, and keep it."""
        self._enabled = True

    def disable(self) -> None:
        """Neither look for code nor keep it."""
        self._enabled = False

    def flush(self) -> None:
        """Nothing to do: what is stale is never looked at."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Code for a signature; None where it has to be compiled, which then begins."""
        name, found = self._name(), None
        if self._enabled and name is not None:
            codegen = target_context.codegen()
            found = self._found(name, sig, codegen, target_context)
            if found is None and written_folder() is not None:
                turns().take(name)
                found = self._found(name, sig, codegen, target_context)
                if found is not None:
                    turns().leave(name)
        if found is None:
            target_context.refresh()
            NEWS.begins()
        else:
            NEWS.loaded += 1
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, if anything can be kept."""
        name, folder = self._name(), written_folder()
        if self._enabled and name is not None and _can_be_kept(data):
            if folder is None:
                _say_once()
            else:
                key = self._key(sig, data.codegen.magic_tuple())
                try:
                    write_whole(folder / _file_name(name, key), _packed(key, data))
                except OSError:
                    folder = None
                    _say_once()
                turns().leave(name)
        NEWS.ends(f"{self._function.__module__}.{self._function.__qualname__}", folder)

    def _found(self, name: str, sig: Any, codegen: Any, target_context: Any) -> Any:
        own = codegen.magic_tuple()
        places = [(folder, own) for folder in read_folders()]
        if SHIPPED.is_dir():
            places.insert(0, (SHIPPED, (own[0], LEVEL, "")))
            if not runs_level():
                del places[0]
        for place, machine in places:
            key = self._key(sig, machine)
            file = place / _file_name(name, key)
            kept = _read(file, key)
            if kept is not None:
                with signals_waiting():
                    return rebuilt(kept, partial(_bitcode, file), target_context)
        return None

    def _name(self) -> str | None:
        """Folder and beginning of the files' names; None where sources cannot be told apart."""
        try:
            stamp = stamp_of(self._file)
            module = ".".join(Path(self._file).relative_to(PACKAGE).with_suffix("").parts)
        except (OSError, ValueError):
            return None
        code = self._function.__code__
        return f"{module}-{stamp[:20]}/{self._function.__qualname__}-{code.co_firstlineno}"

    def _key(self, sig: Any, machine: tuple[str, ...]) -> Key:
        """What tells apart the codes that are kept of one function."""
        code = hashlib.sha256(self._function.__code__.co_code).hexdigest()
        return (VERSION, str(sig), machine, sys.implementation.cache_tag, code)


@lru_cache(maxsize=1)
def runs_level() -> bool:
    """Whether this machine runs shipped code, and nobody asked for code of another kind."""
    if getattr(config, "CPU_NAME", None) not in (None, LEVEL):
        return False
    has = binding.get_host_cpu_features()
    return all(has.get(need, False) for need in LEVEL_NEEDS)


@lru_cache(maxsize=1)
def turns() -> Turns:
    """The turns of processes that keep code in the same folder."""
    folder = written_folder()
    assert folder is not None
    return Turns(folder)


def _file_name(name: str, key: Key) -> str:
    return f"{name}.{key[3]}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.kernel"


def _can_be_kept(result: Any) -> bool:
    """Whether code holds no addresses of this process."""
    return not result.library.has_dynamic_globals and all(one.can_cache for one in result.lifted)


def _packed(key: Key, result: Any) -> bytes:
    """What is loaded and what is linked, each with its length and checksum before it."""
    kept, bitcode = kept_code(result)
    return b"".join(
        HEAD.pack(len(part), hashlib.sha256(part).digest()) + part
        for part in (written((key, kept)), bitcode)
    )


def _part(opened: BinaryIO) -> bytes | None:
    """The next part of a file; None where it is damaged."""
    head = opened.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    length, checksum = HEAD.unpack(head)
    part = opened.read(length)
    return part if hashlib.sha256(part).digest() == checksum else None


def _read(path: Path, key: Key) -> KeptCode | None:
    """What a file holds for a key; None where there is none, or it is damaged."""
    try:
        with opened_own(path) as opened:
            part = _part(opened)
            if part is None or not _ends_well(opened):
                return None
        stored, kept = read(part)
    except Exception:  # No file, or whatever a type of someone else's raises: it is compiled anew.
        return None
    return kept if stored == key else None


def _ends_well(opened: BinaryIO) -> bool:
    """Whether the second part is as long as it says; it is read only where it is linked."""
    head = opened.read(HEAD.size)
    if len(head) < HEAD.size:
        return False
    return opened.tell() + int(HEAD.unpack(head)[0]) == os.fstat(opened.fileno()).st_size


def _bitcode(path: Path) -> bytes:
    """What other code is linked from; where that is damaged, the file goes, to be made anew."""
    part = None
    with suppress(OSError), opened_own(path) as opened:
        if _part(opened) is not None:
            part = _part(opened)
    if part is None:
        with suppress(OSError):
            path.unlink()
        raise ClearwayError(f"{path}: compiled code is damaged; the next run makes it anew")
    return part


@lru_cache(maxsize=1)
def _say_once() -> None:
    nowhere_to_keep()
