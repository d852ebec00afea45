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
SUPPORT = REPOSITORY / "tests" / "support"


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
book = Book("python", most_calls=3)
book.open()
import clearway as cw
cw.fly(cw.read_mission(sys.argv[1]).with_values("simulation", time_limit_s=10.0))
print(len(book.calls))
"""
EXAMPLES = REPOSITORY / "examples" / "missions"
MISSIONS = (
    *("static-obstacles", "intruders", "mixed"),
    *(str(EXAMPLES / name) for name in ("rules.toml", "plants/quadrotor-forest.toml")),
)


@pytest.mark.parametrize(
    "mission",
    [
        MISSIONS[2],
        *(pytest.param(one, marks=pytest.mark.nightly) for one in MISSIONS if one != MISSIONS[2]),
    ],
    ids=lambda one: Path(one).stem,
)
def test_first_calls_give_what_plain_python_gives(mission: str) -> None:
    """Both call the same C library, so that this holds with any."""
    done = subprocess.run(
        [sys.executable, "-c", FIRST_CALLS, mission],
        env={**os.environ, "PYTHONPATH": str(SUPPORT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 30


@pytest.mark.nightly
def test_loops_tests_pass_where_numba_checks_the_core() -> None:
    tests = [f"tests/{name}" for name in ("obstacles", "reach", "sensors", "traffic", "vehicle")]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "checked_core", *tests],
        env={**os.environ, "PYTHONPATH": str(SUPPORT), "CLEARWAY_CHECKED": "numba"},
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]
