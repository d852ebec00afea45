"""A working folder that a stranger filled runs nothing: no module, no settings, no program."""

from __future__ import annotations

import shlex
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

MARKER = "somebody-else-ran.txt"
RUNS = 'open({marker!r}, "a").write(__name__ + "\\n")\n'
PROGRAM = "#!/bin/sh\necho program $0 >> {marker}\n"
MATPLOTLIBRC = (
    "backend: module://evil_backend\nanimation.ffmpeg_path: ./ffmpeg\ntext.usetex: True\n"
)
NUMBA_CONFIG = "disable_jit: 1\ncuda_use_nvidia_binding: 1\n"
OWN_CODE = "own_"
"""Begins the modules of the samples that a user names, whose folder is meant to be looked into."""
MINE = """
import json, mimetypes, numpy
from mpl_toolkits import mplot3d
def beams(craft):
    raise ValueError(numpy.__name__)
"""
CHOSEN = (
    "assess --scan flight --topic /front/points --airframe-radius 0.5",
    "risk --count 2 --workers 2",
)
FURTHER = ("traffic log.ulg", "assess --scan sweep.laz --range 20")
ENDS = (0, 1, 3)
"""Exit statuses of a command that did what it is for."""


def installed_names() -> set[str]:
    return {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize",
            "evil_backend", "cuda"}  # fmt: skip


def plant(folder: Path, names: set[str]) -> Path:
    """Files that write a marker wherever they are run; its path."""
    marker = folder.parent / MARKER
    for name in names:
        (folder / f"{name}.py").write_text(RUNS.format(marker=str(marker)))
    (folder / "evil.pth").write_text(f"import os; os.system('echo pth >> {marker}')\n")
    (folder / "matplotlibrc").write_text(MATPLOTLIBRC)
    (folder / ".numba_config.yaml").write_text(NUMBA_CONFIG)
    for name in ("ffmpeg", "latex", "dvipng", "git", "python", "uname"):
        (folder / name).write_text(PROGRAM.format(marker=marker))
        (folder / name).chmod(0o755)
    return marker


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """As the installed script: its folder is on the path, and not the working folder."""
    script = tmp_path_factory.mktemp("bin") / "clearway"
    script.write_text("from clearway.__main__ import main\nif __name__ == '__main__': main()\n")
    return [sys.executable, str(script)]


@pytest.fixture(scope="module")
def samples(program: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hostile") / "samples"
    done = run(program, f"sample {folder}", folder.parent)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def marker(samples: Path) -> Path:
    return plant(samples, installed_names())


def run(program: list[str], words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [*program, *shlex.split(words)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def commands(folder: Path) -> list[str]:
    lines = (folder / "commands.txt").read_text().splitlines()
    return [line.removeprefix("clearway ") for line in lines if line.startswith("clearway ")]


def test_the_markers_work(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    marker = plant(tmp_path / "here", {"json"})
    subprocess.run([sys.executable, "-c", "import json"], cwd=tmp_path / "here", check=True)
    assert marker.read_text() == "json\n"


def test_a_folder_of_planted_modules_runs_nothing(
    program: list[str], samples: Path, marker: Path
) -> None:
    for words in CHOSEN:
        done = run(program, words, samples)
        assert "Traceback" not in done.stderr, done.stderr
        assert done.returncode in ENDS, (words, done.stderr)
        assert not marker.exists(), (words, marker.read_text())


@pytest.mark.nightly
def test_no_command_of_the_samples_runs_what_is_planted(
    program: list[str], samples: Path, marker: Path
) -> None:
    for words in [*commands(samples), *FURTHER]:
        if OWN_CODE not in words:
            done = run(program, words, samples)
            assert done.returncode in ENDS, (words, done.stderr)
            assert not marker.exists(), (words, marker.read_text())


def test_a_module_that_is_named_runs_and_its_neighbours_replace_nothing(
    program: list[str], tmp_path: Path
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    marker = plant(here, {"numpy", "numba", "clearway", "mpl_toolkits", "json", "signal", "winreg"})
    (here / "mine.py").write_text(MINE)
    done = run(program, "fly static-obstacles --planner mine:beams --no-plots", here)
    assert done.returncode == 2
    assert "mine" in done.stderr
    assert "raised ValueError: numpy" in done.stderr
    assert not marker.exists()


def test_settings_in_the_folder_change_no_library(tmp_path: Path) -> None:
    plant(tmp_path, set())
    told = subprocess.run(
        [sys.executable, "-c", "import clearway.__main__, numba, matplotlib; print(numba.config."
         "DISABLE_JIT, matplotlib.rcParams['animation.ffmpeg_path'], __import__('os').getcwd())"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert told.stdout.split() == ["0", "ffmpeg", str(tmp_path.resolve())]
