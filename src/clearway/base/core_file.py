"""The file of the compiled core, and why it may be of no use."""

from __future__ import annotations

import hashlib
import os
import platform
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from clearway.base.errors import ClearwayError

BASE = Path(__file__).parent
CORE = "_core.abi3.so"
STAMP = "_core.stamp"
MACHINES = {3: "x86", 40: "arm", 62: "x86_64", 183: "aarch64", 243: "riscv64"}
"""Processors by the number that stands in the head of such a file."""
ELF = b"\x7fELF"
"""Begins every such file."""
MACHINE_AT = slice(18, 20)
"""Where in the head it stands."""
REBUILD = "Type `make core` in the checkout"
AS_PYTHON = "set CLEARWAY_CORE=python to run the source as it stands"
REINSTALL = "Type `pip install --force-reinstall clearway`"


class CoreError(ClearwayError):
    """The compiled core cannot be used; says why and what to type."""


def find_compiled_loop(function: Any) -> Any:
    """Return the loop of the core for a function; raises CoreError where the core has none such.

    A loop that loops alone call is in the core, but not for Python: then the function itself.
    """
    name, core = f"{function.__module__}.{function.__qualname__}", load_core()
    if name not in loop_names():
        raise CoreError(f"{name} is not in the compiled core. {REBUILD}, or {AS_PYTHON}.")
    return getattr(core, name, function)


@cache
def loop_names() -> frozenset[str]:
    """Return the names of all loops of the core, with their modules."""
    return frozenset(load_core().loops.split())


@cache
def load_core(base: Path = BASE) -> Any:
    """Return the compiled core; raises CoreError if it is absent, stale or of another machine."""
    changed = find_changed_sources(base / STAMP, base.parent.parent)
    if changed and (base / CORE).is_file():
        more = f" and {len(changed) - 1} more" if changed[1:] else ""
        raise CoreError(
            f"the compiled core is older than {changed[0]}{more}: it would fly other loops than "
            f"the source shows. {REBUILD}, or {AS_PYTHON}."
        )
    try:
        if is_cut_off(base / CORE):  # Loading it would end Python.
            raise ImportError("the file is cut off")
        return import_module("clearway.base._core")
    except ImportError as cause:
        raise CoreError(why_unusable(base / CORE, cause)) from cause


def is_cut_off(core: Path) -> bool:
    """Return whether a file of 64 bits ends before its last table, by what its head says."""
    try:
        with core.open("rb") as file:
            head = file.read(64)
    except OSError:
        return False
    if not head.startswith(ELF):
        return False
    tables = int.from_bytes(head[40:48], "little")
    size, count = (int.from_bytes(head[at : at + 2], "little") for at in (58, 60))
    return len(head) < 64 or core.stat().st_size < tables + size * count


def find_changed_sources(stamp: Path, source: Path) -> list[str]:
    """Return the files that differ from what the core was made of; none where there is no stamp.

    Only an editable install has a stamp. A file is read only where its time of change differs.
    """
    try:
        lines = stamp.read_text().splitlines()
    except OSError:
        return []
    changed = []
    for line in lines:
        digest, changed_ns, name = line.split(" ", 2)
        path = f"{source}/{name}"
        try:
            same = os.stat(path).st_mtime_ns == int(changed_ns)
            if not same and hashlib.sha256(Path(path).read_bytes()).hexdigest() != digest:
                changed.append(name)
        except OSError:
            changed.append(name)
    return changed


def why_unusable(core: Path, cause: ImportError) -> str:
    """Say why a core cannot be loaded, and what to type."""
    if not core.is_file():
        return f"the compiled core is absent ({core}). {REBUILD}, else: {REINSTALL}."
    with core.open("rb") as file:
        head = file.read(MACHINE_AT.stop)
    built_for = MACHINES.get(int.from_bytes(head[MACHINE_AT], "little"), "another machine")
    whole = head.startswith(ELF) and len(head) == MACHINE_AT.stop
    if whole and built_for != platform.machine():
        return f"{core} is built for {built_for}, this is {platform.machine()}. {REINSTALL}."
    return f"{core} cannot be loaded: {cause}. {REBUILD}, else: {REINSTALL}."
