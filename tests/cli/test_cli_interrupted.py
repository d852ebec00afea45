"""Ctrl-C ends a command with a word and 130 at any time, and costs no result that was there."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from own_process import CLEARWAY

INTERRUPTED_AT = """
import sys

class Interrupts:
    def find_spec(self, name, *_):
        if name == {module!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupts())
from clearway.__main__ import main
main()
"""


@pytest.mark.parametrize(
    "module", ["clearway.cli.app", "typer", "clearway.cli.fly", "clearway.missions.setup"]
)
def test_while_a_module_is_loaded(module: str, tmp_path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_AT.format(module=module), "fly", "static-obstacles"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 130
    assert done.stderr.strip().splitlines()[-1].endswith("interrupted")
    assert "Traceback" not in done.stderr


def test_while_pictures_are_drawn_the_flight_is_there(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [*CLEARWAY, "fly", "static-obstacles", "--dpi", "600", "--out", "out"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith("wrote "):
            process.send_signal(signal.SIGINT)
            break
    _, told = process.communicate(timeout=60)
    assert (process.returncode, told) == (130, "interrupted\n")
    left = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"mission.toml", "track.csv", "decisions.jsonl", "summary.json", "run.mcap"} <= left
    assert not [name for name in left if name.endswith((".png", ".part"))]
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["reached"]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


BUSY = """
import hashlib, signal, sys
from clearway.cli.interrupts import end_soon_on_interrupt
from clearway.io.staging import stage_folder
end_soon_on_interrupt()
{before}
with stage_folder("out") as scratch:
    (scratch / "half.txt").write_text("half")
    print("ready", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"", b"", {rounds})  # Returns to Python at its end alone.
"""


def processor_time_s(pid: int) -> float:
    ticks = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def interrupted(script: str, cwd: Path) -> tuple[int, str]:
    process = subprocess.Popen(
        [sys.executable, "-c", script], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    busy_s = processor_time_s(process.pid) + 0.2
    while processor_time_s(process.pid) < busy_s:  # Until it is in the library for sure.
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=120)
    return process.returncode, told


def test_while_a_library_looks_at_no_signal(tmp_path: Path) -> None:
    """It would for ever; the process is ended where it is, and leaves nothing half done."""
    assert interrupted(BUSY.format(before="", rounds=2**31 - 1), tmp_path) == (130, "interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_a_session_that_ends_by_itself_is_left_to_do_so(tmp_path: Path) -> None:
    before = "signal.signal(signal.SIGINT, lambda *_: print('landing', file=sys.stderr))"
    status, told = interrupted(BUSY.format(before=before, rounds=12_000_000), tmp_path)
    assert (status, told) == (0, "landing\n")
    assert (tmp_path / "out" / "half.txt").read_text() == "half"
