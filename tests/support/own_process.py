"""The command line in a process of its own, as users run it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

CALL = "from clearway.cli.app import main; main()"
CLEARWAY = [sys.executable, "-c", CALL]


def run_clearway(
    *arguments: object, cwd: Path | None = None, absent: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `clearway`, in a folder and without a module if they are named."""
    first = "" if absent is None else f"import sys; sys.modules[{absent!r}] = None; "
    command = [sys.executable, "-c", first + CALL, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
