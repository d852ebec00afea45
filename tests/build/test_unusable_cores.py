"""A core that is stale, absent, damaged or of another machine: the message and the exit status."""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from clearway.base.core_file import find_changed_sources
from clearway_build.placed import place
from clearway_build.translate import READ
from repository import REPOSITORY

CORE = Path("clearway/base/_core.abi3.so")
STAMP = CORE.with_name("_core.stamp")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """The package and its core, copied with the times of their changes."""
    if not (REPOSITORY / "src" / STAMP).is_file():
        pytest.skip("the core of this checkout has no stamp: `make core` makes both")
    unwanted = shutil.ignore_patterns("__pycache__")
    shutil.copytree(REPOSITORY / "src" / "clearway", tmp_path / "clearway", ignore=unwanted)
    return tmp_path


def refused(source: Path, **settings: str) -> str:
    """What a flight says that cannot begin."""
    command = [sys.executable, "-m", "clearway", "fly", "static-obstacles", "--no-plots"]
    done = subprocess.run(
        command,
        cwd=source,
        env={**os.environ, "CLEARWAY_CORE": "", "PYTHONPATH": str(source), **settings},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def test_a_core_older_than_a_loop_does_not_fly(source: Path) -> None:
    loop = (source / STAMP).read_text().splitlines()[0].split(" ", 2)[2]
    with (source / loop).open("a") as file:
        file.write("# changed\n")
    said = refused(source)
    assert f"the compiled core is older than {loop}" in said
    assert "Type `make core` in the checkout" in said


def test_an_absent_core_is_said_to_be_absent(source: Path) -> None:
    (source / CORE).unlink()
    said = refused(source)
    assert f"the compiled core is absent ({source / CORE})" in said
    assert "Type `make core`" in said
    assert "pip install" in said


def test_a_core_of_another_machine_is_named(source: Path) -> None:
    whole = bytearray((source / CORE).read_bytes())
    other, number = ("x86_64", 62) if platform.machine() == "aarch64" else ("aarch64", 183)
    whole[18:20] = number.to_bytes(2, "little")
    (source / CORE).write_bytes(whole)
    assert f"is built for {other}, this is {platform.machine()}" in refused(source)


def test_a_damaged_core_is_refused(source: Path) -> None:
    (source / CORE).write_bytes(b"no core")
    assert "cannot be loaded" in refused(source)


@pytest.mark.parametrize("share", [0.00001, 0.5, 0.999])
def test_a_core_that_is_cut_off_is_refused(source: Path, share: float) -> None:
    whole = (source / CORE).read_bytes()
    (source / CORE).write_bytes(whole[: int(share * len(whole))])
    said = refused(source)
    assert "cannot be loaded: the file is cut off" in said
    assert "Type `make core`" in said


def test_an_unknown_way_to_run_loops_is_refused(source: Path) -> None:
    assert "type one of numba, python" in refused(source, CLEARWAY_CORE="nunba")


def test_a_loop_edited_while_the_core_is_made_is_stale(tmp_path: Path) -> None:
    """The stamp tells what was translated, not what stands there when it is written."""
    source, core = tmp_path / "src", tmp_path / "core.so"
    (source / "clearway" / "base").mkdir(parents=True)
    loop = source / "clearway" / "loop.py"
    loop.write_text("edited")
    core.write_bytes(b"")
    read = tmp_path / "build" / "core" / "source" / READ
    read.parent.mkdir(parents=True)
    for content, stale in (("translated", ["clearway/loop.py"]), ("edited", [])):
        digest = hashlib.sha256(content.encode()).hexdigest()
        read.write_text(f"clearway/loop.py {digest}\n")
        place(tmp_path, core)
        assert find_changed_sources(source / STAMP, source) == stale
