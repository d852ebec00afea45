"""Wheels for two machines, made by the compiler from PyPI: their tags, and what is in them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from clearway.base.core_file import CORE, MACHINE_AT
from clearway.base.core_file import MACHINES as NUMBERS
from clearway_build.target import GLIBC, MACHINES, Target
from repository import REPOSITORY

pytestmark = pytest.mark.nightly


def built(folder: Path, *options: str, **settings: str) -> list[Path]:
    """What a build leaves; skips where the packages that it needs cannot be had."""
    command = [sys.executable, "-m", "build", "--outdir", str(folder), *options, str(REPOSITORY)]
    done = subprocess.run(
        command, env={**os.environ, **settings}, capture_output=True, text=True, check=False
    )
    if "No matching distribution" in done.stdout + done.stderr:
        pytest.skip("no index of packages to get ziglang from")
    assert done.returncode == 0, done.stdout + done.stderr
    return sorted(folder.iterdir())


@pytest.mark.parametrize("machine", MACHINES)
def test_a_wheel_is_what_its_tags_say(machine: str, tmp_path: Path) -> None:
    (wheel,) = built(tmp_path, "--wheel", CLEARWAY_TARGET=machine)
    assert wheel.name.endswith(f"-cp311-abi3-manylinux_2_17_{machine}.whl")
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
        told = packed.read(next(one for one in names if one.endswith("/WHEEL"))).decode()
        core = packed.read(f"clearway/base/{CORE}")
    assert f"Tag: {Target(machine).tag}\n" in told
    assert "Root-Is-Purelib: false" in told
    assert not [one for one in names if one.startswith("clearway_build") or one.endswith(".stamp")]
    assert NUMBERS[int.from_bytes(core[MACHINE_AT], "little")] == machine
    asked = {tuple(map(int, one.split(b"."))) for one in re.findall(rb"GLIBC_([0-9.]+)", core)}
    assert max(asked)[:2] <= GLIBC
    assert b"libstdc++" not in core


def test_the_source_distribution_builds_a_wheel(tmp_path: Path) -> None:
    source, wheel = sorted(built(tmp_path), key=lambda path: path.suffix)
    with tarfile.open(source) as packed:
        names = {name.split("/", 1)[-1] for name in packed.getnames()}
    assert {"hatch_build.py", "src/clearway_build/build.py"} <= names
    assert not [name for name in names if name.endswith((".so", ".stamp", ".o"))]
    assert "-cp311-abi3-linux_" in wheel.name
    with zipfile.ZipFile(wheel) as packed:
        assert f"clearway/base/{CORE}" in packed.namelist()
