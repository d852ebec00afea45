"""The examples of bringing something of one's own, run as a user runs them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import clearway
from repository import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
OWN = ("own_planner", "own_rating", "own_sensor", "own_vehicle")
MODULES = {
    "clearway.sim.baselines",
    "clearway.avoidance.rate.fusion",
    "clearway.live.mission",
    "clearway.vehicle.automaton",
    "clearway.sensors",
}
"""What examples may import beside the promised names: modules that the documentation names."""


def printed(name: str, folder: Path) -> list[str]:
    """Lines of one example, which must draw its picture into the folder."""
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py"), str(folder / "out")],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    picture = folder / "out" / f"{name}.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 10_000
    assert [path.name for path in folder.iterdir()] == ["out"]
    return done.stdout.splitlines()


def row(lines: list[str], label: str) -> list[str]:
    """Words after a label at the start of a line."""
    (line,) = (line for line in lines if line.startswith(label))
    return line.removeprefix(label).split()


@pytest.mark.parametrize("name", OWN)
def test_only_names_that_are_promised_or_documented(name: str) -> None:
    text = (EXAMPLES / f"{name}.py").read_text()
    used = set(re.findall(r"\bcw\.(\w+)", text))
    assert len(used) > 5
    assert used <= set(clearway.__all__)
    assert set(re.findall(r"^from (clearway[\w.]*) import", text, re.MULTILINE)) <= MODULES
    # Notebook style: cells of code, and of what it teaches.
    assert text.count("\n# %%") >= 7
    assert re.search(r"^# %% \[markdown\]\n# # Bring your own", text)


@pytest.mark.nightly
def test_own_rating(tmp_path: Path) -> None:
    lines = printed("own_rating", tmp_path)
    own, wary = row(lines, "total (clearway's own)"), row(lines, "wary")
    assert own[0] == wary[0] == "yes"
    assert min(float(own[1]), float(wary[1])) >= 0.6
    # Whoever distrusts what is hidden rates the same cells lower.
    assert float(wary[5]) < float(own[5]) - 0.01


def test_own_vehicle(tmp_path: Path) -> None:
    lines = printed("own_vehicle", tmp_path)
    plane, climber = row(lines, "plane (4.4)"), row(lines, "climber")
    assert plane[1] == climber[1] == "yes"
    assert min(float(plane[2]), float(climber[2])) >= 1.0
    # Climbing at 20 degrees costs it 23 % of its speed.
    assert float(climber[4]) > float(plane[4]) + 2.0


def test_own_planner(tmp_path: Path) -> None:
    lines = printed("own_planner", tmp_path)
    ours, swerve = row(lines, "clearway"), row(lines, "swerve")
    assert ours[0] == "yes"
    assert float(ours[1]) >= 0.6
    assert ours[3:5] == ["0", "no"]
    assert swerve[0] == "yes"
    assert any("towards the waypoint" in line for line in lines)


@pytest.mark.nightly
def test_own_sensor(tmp_path: Path) -> None:
    lines = printed("own_sensor", tmp_path)
    assert "answers all questions of a range sensor: True" in lines
    alone, both = row(lines, "lidar alone"), row(lines, "lidar and radar")
    # 15 m of sight are less than a turning radius of 19 m; the radar sees the tower at 60 m.
    assert alone[0] == "NO"
    assert float(alone[4]) <= 15.0
    assert both[0] == "yes"
    assert float(both[1]) >= 3.0
    assert both[3] == "0"
    assert float(both[4]) > 40.0


def test_own_plant_flies_where_it_is_run() -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "own_plant.py")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "safe" in done.stdout
