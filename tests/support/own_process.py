"""The command line in a process of its own, as users run it."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

CALL = "from clearway.cli.app import main; main()"
CLEARWAY = [sys.executable, "-c", CALL]


def run_clearway(
    *arguments: object, cwd: Path | None = None, absent: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `clearway`, in a folder and without a module if they are named."""
    first = "" if absent is None else f"import sys; sys.modules[{absent!r}] = None; "
    command = [sys.executable, "-c", first + CALL, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)


def flown_in(folder: Path) -> tuple[dict[str, Any], npt.NDArray[np.float64]]:
    """JSON and positions [n, 3] of the flight of a folder's mission.toml."""
    options = ("--out", "out", "--no-plots", "--json")
    done = run_clearway("fly", "mission.toml", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = list(csv.DictReader((folder / "out" / "track.csv").read_text().splitlines()))
    track = np.array([[float(row[axis]) for axis in ("x_m", "y_m", "z_m")] for row in rows])
    return json.loads(done.stdout), track
