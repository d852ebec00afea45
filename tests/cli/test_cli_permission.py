"""What the system does not even let a command ask about is refused in a line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clearway.cli.report import BAD_INPUT, run_guarded
from in_process import clearway


def asked_about(path: Path) -> None:
    """As `Path.is_dir` does for an ordinary user in a folder that may not be looked into; who runs
    these tests may be one who may do everything."""
    raise PermissionError(13, os.strerror(13), str(path))


def test_it_is_named_with_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run_guarded(asked_about)(Path("no/x.pcd"))
    assert ended.value.code == BAD_INPUT
    assert capsys.readouterr().err == "no/x.pcd: cannot be read: Permission denied\n"


@pytest.mark.parametrize("length", [300, 5000])
@pytest.mark.parametrize(
    "command",
    [
        ("fly", "{}"),
        ("fly", "{}/mission.toml"),
        ("campaign", "{}"),
        ("compare", "{}"),
        ("replay", "{}"),
        ("assess", "--scan", "{}.pcd"),
        ("fly", "static-obstacles", "--no-plots", "--planner", "{}:make"),
    ],
)
def test_a_name_that_is_too_long_is_said_to_be(tmp_path, monkeypatch, command, length):
    monkeypatch.chdir(tmp_path)
    told = clearway(*(word.format("y" * length) for word in command))
    assert told.exit_code == 2
    (line,) = told.stderr.splitlines()
    assert "yyyy" in line
    assert line.endswith("File name too long")
    assert len(line) < 400
    assert not any(tmp_path.iterdir())
