"""Streams that are full, closed, or left: results and exit statuses are those of the work done."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from clearway.cli.report import INTERRUPTED
from own_process import CLEARWAY

SHELL = " ".join(f"'{word}'" for word in CLEARWAY)
FLY = "fly static-obstacles --no-plots"


def in_shell(line: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["sh", "-c", f"{SHELL} {line}"], cwd=cwd, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("line", ["--version", "--help", "reach-set --layers 5"])
def test_a_full_standard_output_is_said_in_a_line(line: str, tmp_path: Path) -> None:
    done = in_shell(f"{line} >/dev/full", tmp_path)
    assert done.returncode == 2
    assert done.stderr.endswith("standard output cannot be written: No space left on device\n")
    assert "Traceback" not in done.stderr


def test_what_cannot_be_said_changes_no_result(tmp_path: Path) -> None:
    assert in_shell(f"{FLY} --out full 2>/dev/full", tmp_path).returncode == 0
    closed = in_shell(f"{FLY} --out closed --json 2>&-", tmp_path)
    assert closed.returncode == 0
    assert json.loads(closed.stdout)["reached"]
    assert in_shell(f"{FLY} --out unread >&-", tmp_path).returncode == 0
    assert (tmp_path / "unread" / "summary.json").exists()


@pytest.mark.parametrize("gap_s", [0.05, pytest.param(0.4, marks=pytest.mark.nightly)])
def test_ctrl_c_twice_ends_a_study_and_its_workers(gap_s: float, tmp_path: Path) -> None:
    """As a terminal sends it: to the command and to all workers at once."""
    command = [*CLEARWAY, "encounters", "--count", "4000", "--workers", "2", "--out", "here"]
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # Whoever began the tests in a shell's background has it ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    time.sleep(4.0)
    for _ in range(2):
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(gap_s)
    _, told = process.communicate(timeout=60)
    assert process.returncode == INTERRUPTED
    assert told.strip().endswith("interrupted")
    assert "Traceback" not in told
    until = time.monotonic() + 30.0
    while is_there(process.pid):
        assert time.monotonic() < until, "workers are left"
        time.sleep(0.05)


def is_there(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
