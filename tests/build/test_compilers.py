"""Compilers that are absent or of no use: what is said, and the exit status."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from clearway_build.compiler import ZIG, requirements
from clearway_build.errors import BuildError
from clearway_build.target import HERE, Target, chosen_target
from repository import REPOSITORY

FAKE = """#!/bin/sh
case "$*" in *probe.cpp*|--version) exec g++ "$@" ;; esac
echo 'loops_0.cpp:7:1: error: {complaint}' >&2
exit 1
"""


def build(**settings: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "clearway_build", "--flavour", "checked"],
        cwd=REPOSITORY / "src",
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        check=False,
    )


def program(path: Path, text: str) -> Path:
    path.write_text(text)
    path.chmod(0o755)
    return path


@pytest.mark.parametrize(
    ("compiler", "said"),
    [("/no/such/c++", "not found"), ("false", "does not know C++20"), ('"', "cannot be run")],
)
def test_a_compiler_of_no_use_is_named_with_what_to_type(compiler: str, said: str) -> None:
    done = build(CXX=compiler)
    assert done.returncode == 2
    assert done.stderr.startswith(f"CXX={compiler}: {said}")
    assert "Set CXX to a C++20 compiler, or unset it" in done.stderr
    assert "Traceback" not in done.stderr


def test_where_there_is_none_all_that_was_tried_is_listed(tmp_path: Path) -> None:
    done = build(PATH=str(tmp_path), CXX="")
    assert done.returncode == 2
    for tried in ("g++: not found", "clang++: not found", "ziglang: not installed"):
        assert f"  {tried}\n" in done.stderr
    assert f"Type `sudo apt install g++`, or `pip install {ZIG}`." in done.stderr
    assert "Traceback" not in done.stderr


def test_what_a_compiler_complains_of_is_shown(tmp_path: Path) -> None:
    complaint = f"of {os.getpid()}"
    compiler = program(tmp_path / "compiler", FAKE.format(complaint=complaint))
    done = build(CXX=str(compiler))
    assert done.returncode == 2
    assert f"error: {complaint}" in done.stderr
    assert "cannot be compiled by" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_compiler_from_pypi_is_asked_for_only_where_it_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CXX", raising=False)
    assert requirements(Target("aarch64")) == [ZIG]
    program(tmp_path / "clang++", "#!/bin/sh\nexit 0\n")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert requirements(HERE) == []
    (tmp_path / "clang++").unlink()
    assert requirements(HERE) == [ZIG]


def test_an_unknown_machine_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLEARWAY_TARGET", "vax")
    with pytest.raises(BuildError, match="type one of x86_64, aarch64"):
        chosen_target()
