"""The wheel for aarch64 flies as this machine does, to the last bit: under emulation."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from aarch64 import AbsentError, emulated_python
from clearway.missions.mission_file import list_built_in_missions
from repository import REPOSITORY

KEPT = REPOSITORY / "clearway-out" / "aarch64"
FLOWN = """
import hashlib, platform, sys
import clearway as cw
run = cw.fly(cw.read_mission(sys.argv[1]))
print(platform.machine(), hashlib.sha256(run.time_s.tobytes() + run.states.tobytes()).hexdigest())
"""


@pytest.fixture(scope="module")
def emulated(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], Path]:
    """The command of a Python for aarch64, and the folder of the unpacked wheel."""
    wheels = sorted(REPOSITORY.glob("dist/clearway-*aarch64.whl"), key=os.path.getmtime)
    if not wheels:
        pytest.skip("no wheel for aarch64 in dist: `make wheel` makes one")
    try:
        command = emulated_python(KEPT)
    except AbsentError as why:
        pytest.skip(f"no Python for aarch64: {why}")
    place = tmp_path_factory.mktemp("wheel")
    zipfile.ZipFile(wheels[-1]).extractall(place)
    return command, place


def flown(command: list[str], mission: str, *folders: Path) -> list[str]:
    """The machine, and a hash of the track."""
    path = {"PYTHONPATH": os.pathsep.join(map(str, folders))} if folders else {}
    done = subprocess.run(
        [*command, "-c", FLOWN, mission],
        env={**os.environ, **path, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.nightly
@pytest.mark.parametrize("mission", sorted(list_built_in_missions()))
def test_built_in_missions_fly_the_same(mission: str, emulated: tuple[list[str], Path]) -> None:
    command, place = emulated
    machine, track = flown(command, mission, place, KEPT / "site")
    assert machine == "aarch64"
    assert track == flown([sys.executable], mission)[-1]
