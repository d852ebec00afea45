"""The core compiled: object files of what has not changed are kept, the rest side by side."""

from __future__ import annotations

import hashlib
import os
import subprocess
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from clearway_build.compiler import STANDARD, Compiler, find_compiler
from clearway_build.errors import BuildError
from clearway_build.headers import OWN, find_headers
from clearway_build.target import HERE, Target
from clearway_build.translate import NotTranslatableError, write_sources

CORE = "_core.abi3.so"
FOLDED = "sin cos tan asin acos atan atan2 sinh cosh tanh exp expm1 log log1p log2 log10 pow hypot"
"""What a compiler computes ahead with roundings of its own, if it may: left to the C library."""
FLAGS = (
    *(STANDARD, "-fPIC", "-fvisibility=hidden", "-fvisibility-inlines-hidden"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv"),
    *("-Werror=float-conversion", "-Werror=sign-compare"),
    *("--param=ggc-min-expand=50", "--param=ggc-min-heapsize=100000"),
    *(f"-fno-builtin-{name}" for name in (*FOLDED.split(), "erf", "erfc", "fmod", "cbrt")),
)
"""By the two of memory g++ holds 490 MB at most, not 600, in the same time; others ignore them."""
FLAVOURS = {
    "fast": ("-O2", "-DNDEBUG"),
    "checked": ("-O1", "-g", "-DCLEARWAY_CHECKED"),
    "sanitized": ("-O1", "-g", "-DCLEARWAY_CHECKED", "-fsanitize=address,undefined"),
}
"""What a core can be built for: flights, runs with every index checked, runs under sanitizers."""
ONE_COMPILER_BYTES = 600e6
"""What one compiler may hold at its worst."""
SHOWN_LINES = 12
"""Lines of a compiler's complaint that are shown."""


@dataclass(frozen=True)
class Built:
    """A core, and in one line how it came about."""

    path: Path
    report: str


def build_core(root: Path, target: Target = HERE, flavour: str = "fast") -> Built:
    """Translate the kernels of a checkout, compile what has changed, and link the core.

    Everything is written into `build/core` of the checkout. Raises BuildError.
    """
    began = time.perf_counter()
    work, source = root / "build" / "core", root / "src"
    headers, compiler = find_headers(work / "headers"), find_compiler(target)
    folder = work / f"{target.folder}-{flavour}"
    folder.mkdir(parents=True, exist_ok=True)
    flags = (*FLAGS, *FLAVOURS[flavour])
    shared = _digest(
        " ".join((compiler.version, headers.versions, *flags)).encode(),
        *(path.read_bytes() for path in sorted(OWN.iterdir())),
    )
    core, made_from = folder / CORE, folder / "made_from"
    state = _digest(shared.encode(), *(path.read_bytes() for path in sorted(source.rglob("*.py"))))
    if core.is_file() and made_from.is_file() and made_from.read_text() == state:
        return Built(core, "core: as its sources")
    try:
        sources = write_sources(source, work / "source")
    except NotTranslatableError as cause:
        raise BuildError(
            f"{cause}\nOnly a subset of Python is translated: docs/core.md."
        ) from cause
    objects = {
        folder / f"{one.stem}-{_digest(shared.encode(), one.read_bytes())}.o": one
        for one in sources
    }
    wanted = {made: one for made, one in objects.items() if not made.is_file()}
    includes = [part for place in headers.folders for part in ("-isystem", str(place))]

    def compiled(made: Path, one: Path) -> None:
        _run(compiler, [*flags, *includes, "-c", str(one)], made, f"{one.name} cannot be compiled")

    with ThreadPoolExecutor(_side_by_side()) as pool:
        list(pool.map(compiled, wanted.keys(), wanted.values()))
    strip = ["-Wl,-s"] if flavour == "fast" else []
    link = ["-shared", *FLAVOURS[flavour], *strip, *map(str, objects)]
    _run(compiler, link, core, "the core cannot be linked")
    for old in set(folder.glob("*.o")) - set(objects):
        old.unlink()
    made_from.write_text(state)
    parts = f"{len(wanted)} of {len(objects)} parts compiled"
    took = time.perf_counter() - began
    return Built(core, f"core: {parts} in {took:.1f} s by {compiler.version}")


def _digest(*parts: bytes) -> str:
    found = hashlib.sha256()
    for part in parts:
        found.update(len(part).to_bytes(8, "little") + part)
    return found.hexdigest()[:16]


def _run(compiler: Compiler, options: Sequence[str], made: Path, problem: str) -> None:
    """One call of the compiler, whose result stands there whole or not at all."""
    half = made.with_name(f"{os.getpid()}-{made.name}")
    try:
        ended = subprocess.run(
            [*compiler.command, *options, "-o", str(half)], capture_output=True, text=True
        )
        if ended.returncode == 0 and half.is_file():
            half.replace(made)
            return
    except OSError as cause:
        raise BuildError(f"{problem}: {compiler.command[0]} cannot be run: {cause}") from cause
    finally:
        half.unlink(missing_ok=True)
    said = ended.stderr.strip().splitlines() or [f"it ended with {ended.returncode}"]
    killed = "\nIt was killed: is there enough memory?" if ended.returncode < 0 else ""
    raise BuildError(f"{problem} by {compiler.version}:\n" + "\n".join(said[:SHOWN_LINES]) + killed)


def _side_by_side() -> int:
    """How many compilers run at once: a core each, in half of the memory at most."""
    cores = len(os.sched_getaffinity(0))
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return max(1, min(cores, int(memory / 2 / ONE_COMPILER_BYTES)))
