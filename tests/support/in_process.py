"""The command line within the test's own process, built once: quick, and otherwise the same."""

from __future__ import annotations

import contextlib
import csv
import io
import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from typer.main import get_command

from clearway.cli.app import app


class Done(NamedTuple):
    """What a command left."""

    exit_code: int
    stdout: str
    stderr: str

    @property
    def returncode(self) -> int:
        """As a process of its own calls it."""
        return self.exit_code


@cache
def _command() -> Any:
    return get_command(app)


def clearway(*arguments: object, cwd: Path | None = None) -> Done:
    """Run `clearway`, in a folder if one is named; what is no exit of it comes up as it is."""
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(cwd or "."),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            _command()([str(argument) for argument in arguments], prog_name="clearway")
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
    return Done(code, out.getvalue(), err.getvalue())


def flown_in(folder: Path) -> tuple[dict[str, Any], npt.NDArray[np.float64]]:
    """JSON and positions [n, 3] of the flight of a folder's mission.toml."""
    options = ("--out", "out", "--no-plots", "--json")
    done = clearway("fly", "mission.toml", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = list(csv.DictReader((folder / "out" / "track.csv").read_text().splitlines()))
    track = np.array([[float(row[axis]) for axis in ("x_m", "y_m", "z_m")] for row in rows])
    return json.loads(done.stdout), track
