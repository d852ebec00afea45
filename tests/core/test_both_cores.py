"""Flights by the compiled core are the flights by numba, to the last bit of their tracks."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from clearway.studies.campaigns.results import read_results
from clearway.studies.campaigns.row import without_timings
from own_process import CLEARWAY
from repository import REPOSITORY

FLIGHTS = Path(__file__).with_name("flights.toml")


def sources() -> str:
    """A hash of all that a core and its flights are made of."""
    found = hashlib.sha256()
    for path in sorted((REPOSITORY / "src").rglob("*.[ph][yp]*")):
        if "__pycache__" not in path.parts:
            found.update(path.read_bytes())
    return found.hexdigest()[:16]


OUT = REPOSITORY / "clearway-out" / "both-cores" / sources()
"""Kept: a run that was stopped goes on, unless the sources have changed."""


def folder(core: str) -> Path:
    """Of the results of a core."""
    return OUT / (core or "core")


def flying(core: str) -> subprocess.Popen[str]:
    """The campaign, flown by one process: numba compiles in each."""
    return subprocess.Popen(
        [
            *CLEARWAY,
            "campaign",
            str(FLIGHTS),
            "--workers",
            "1",
            "--out",
            str(OUT / (core or "core")),
        ],
        env={**os.environ, "CLEARWAY_CORE": core},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def rows(core: str) -> dict[str, dict[str, Any]]:
    found, _ = read_results(folder(core) / "results.parquet")
    return {row.key: without_timings(row) for row in found}


@pytest.mark.nightly
def test_flights_are_equal_to_the_bit() -> None:
    for process in [flying("numba"), flying("")]:
        _, told = process.communicate()
        assert process.returncode in (0, 1, 3), told
    by_core, by_numba = rows(""), rows("numba")
    assert len(by_core) >= 200
    assert by_core == by_numba


FIRST_CALLS = """
import sys
from checked_core import Book
book = Book("python", most_calls={most})
book.open()
import clearway as cw
file = cw.read_mission({mission!r}).changed("simulation", time_limit_s={seconds})
cw.fly(file)
print(len(book.calls))
"""


@pytest.mark.parametrize("mission", ["static-obstacles", "mixed"])
def test_the_first_calls_of_a_flight_give_what_plain_python_gives(mission: str) -> None:
    """Both call the same C library, so that this holds with any."""
    code = FIRST_CALLS.format(most=2, mission=mission, seconds=2.0)
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(REPOSITORY / "tests" / "support")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 30
