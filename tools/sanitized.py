"""The core under sanitizers: `python -m tools.sanitized`, which `make sanitized` runs.

The loops' tests and damaged files of every format run with a core that checks every index, watched
by the address and undefined-behaviour sanitizers of g++. Whatever these find ends the process that
did it, so that the test or the file fails.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from clearway_build.build import CORE, build_core

ROOT = Path(__file__).parent.parent
TREE = ROOT / "clearway-out" / "sanitized"
"""A copy of the package with such a core; what lies in the checkout stays."""
TESTS = ("avoidance", "live", "obstacles", "reach", "sensors", "traffic", "vehicle")
"""Folders of tests that call loops."""
WATCHED = {
    "CXX": "g++",
    "PYTHONMALLOC": "malloc",
    "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1",  # Python frees little at its end.
    "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1",
}


def main() -> int:
    """Build, test, fuzz; returns the first exit status that is not 0."""
    parser = argparse.ArgumentParser(prog="python -m tools.sanitized", description=__doc__)
    parser.add_argument("--count", type=int, default=5000, help="damaged files to try")
    parser.add_argument("--tests", nargs="*", default=[f"tests/{name}" for name in TESTS])
    given = parser.parse_args()
    os.environ["CXX"] = WATCHED["CXX"]
    core = build_core(ROOT, flavour="sanitized").path
    shutil.rmtree(TREE, ignore_errors=True)
    left = shutil.ignore_patterns("__pycache__", "_core*")
    shutil.copytree(ROOT / "src" / "clearway", TREE / "clearway", ignore=left)
    shutil.copy(core, TREE / "clearway" / "base" / CORE)
    environment = os.environ | WATCHED | {"PYTHONPATH": str(TREE), "LD_PRELOAD": _runtimes()}
    fuzz = ["tools.fuzz", "--count", str(given.count), "--minutes", "600"]
    for command in (["pytest", "-n", "2", "--dist", "loadfile", *given.tests], fuzz):
        ended = subprocess.run([sys.executable, "-m", *command], cwd=ROOT, env=environment)
        if ended.returncode:
            return ended.returncode
    return 0


def _runtimes() -> str:
    """What must be loaded before Python itself."""
    return " ".join(
        subprocess.run(
            ["g++", f"-print-file-name={name}"], capture_output=True, text=True, check=True
        ).stdout.strip()
        for name in ("libasan.so", "libubsan.so")
    )


if __name__ == "__main__":
    sys.exit(main())
