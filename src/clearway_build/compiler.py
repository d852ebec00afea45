"""The C++ compiler: `$CXX`, else the system's, else the one that comes with PyPI's `ziglang`."""

from __future__ import annotations

import importlib.util
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from clearway_build.errors import BuildError
from clearway_build.target import Target

ZIG = "ziglang==0.17.1"
"""The wheel that brings a compiler and the C libraries of the machines that wheels are made for."""
ON_PATH = ("g++", "clang++", "c++")
STANDARD = "-std=c++20"
PROBE = """
#include <concepts>
#include <vector>
template <std::integral T> T first(const std::vector<T>& x) { return x[0]; }
int answer() { return first(std::vector<int>{0}); }
"""
LONGEST_PROBE_S = 60.0


@dataclass(frozen=True)
class Compiler:
    """A compiler that works: how it is called, and what it says that it is."""

    command: tuple[str, ...]
    version: str


def find_compiler(target: Target) -> Compiler:
    """Return the compiler for a machine; raises BuildError with what was tried and what to type."""
    own = None if target.machine else os.environ.get("CXX")
    if own:
        try:
            found = _probe(shlex.split(own))
        except ValueError as cause:
            found = f"cannot be run: {cause}"
        if isinstance(found, str):
            raise BuildError(
                f"CXX={own}: {found}\nSet CXX to a C++20 compiler, or unset it to have one chosen."
            )
        return found
    tried = []
    for name in () if target.machine else ON_PATH:
        found = _probe([name])
        if isinstance(found, Compiler):
            return found
        tried.append(f"  {name}: {found}")
    if importlib.util.find_spec("ziglang") is None:
        tried.append("  ziglang: not installed")
    else:
        options = ["-target", target.triple] if target.machine else []
        found = _probe([sys.executable, "-m", "ziglang", "c++", *options])
        if isinstance(found, Compiler):
            return found
        tried.append(f"  ziglang: {found}")
    raise BuildError(
        "no C++20 compiler that works, which building clearway needs:\n"
        + "\n".join(tried)
        + f"\nType `sudo apt install g++`, or `pip install {ZIG}`."
    )


def requirements(target: Target) -> list[str]:
    """Return what has to be installed to build for a machine: Zig, where no compiler is there."""
    if target.machine:
        return [ZIG]
    if os.environ.get("CXX") or any(isinstance(_probe([name]), Compiler) for name in ON_PATH):
        return []
    return [ZIG]


def _probe(command: Sequence[str]) -> Compiler | str:
    """A compiler if it knows C++20 and finds its library; else, in a line, why not."""
    try:
        with tempfile.TemporaryDirectory() as scratch:
            probe = Path(scratch) / "probe.cpp"
            probe.write_text(PROBE)
            options = [STANDARD, "-c", str(probe), "-o", str(probe.with_suffix(".o"))]
            tried, said = (
                subprocess.run(
                    [*command, *what], capture_output=True, text=True, timeout=LONGEST_PROBE_S
                )
                for what in (options, ["--version"])
            )
    except FileNotFoundError:
        return "not found"
    except (OSError, IndexError, subprocess.TimeoutExpired) as cause:
        return f"cannot be run: {cause}"
    if tried.returncode:
        errors = [line for line in tried.stderr.splitlines() if "error" in line]
        return (errors or tried.stderr.splitlines() or ["does not know C++20"])[0].strip()
    return Compiler(tuple(command), (said.stdout.splitlines() or ["unknown"])[0])
