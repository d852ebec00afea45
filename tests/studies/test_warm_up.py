"""`clearway warm-up`: after it, flights, their recordings and pictures find all loops compiled."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SPIED = """
import sys
from clearway.base.kernels.cache import KernelCache

asked, load = set(), KernelCache.load_overload

def told(cache, signature, target):
    asked.add((cache._function.__module__, cache._function.__qualname__, str(signature)))
    return load(cache, signature, target)

KernelCache.load_overload = told
"""
WARM_UP = """
from clearway.studies.warm_up import pieces

for name in sys.argv[1:]:
    pieces()[name]()
"""
COMMAND = """
from clearway.cli.app import main

try:
    main()
except SystemExit as ended:
    assert ended.code in (0, None, 1), ended.code
"""
TELL = """
print("asked", *map("\\t".join, sorted(asked)), sep="\\n")
"""


def loops_of(work: str, *arguments: str, cwd: Path) -> set[str]:
    """The loops that a process asks for, each with the types that it asks for."""
    command = [sys.executable, "-c", SPIED + work + TELL, *arguments]
    ended = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return set(ended.stdout.partition("asked\n")[2].splitlines())


def test_what_a_flight_writes_and_draws_asks_for_no_other_loops(tmp_path: Path) -> None:
    pieces = ("reach sets compared", "mission mixed", "longer flights", "a recording")
    known = loops_of(WARM_UP, *pieces, cwd=tmp_path)
    asked = loops_of(COMMAND, "fly", "mixed", cwd=tmp_path)
    assert (tmp_path / "clearway-out" / "mixed" / "run.mcap").is_file()
    assert len(asked) > 50
    assert not asked - known
