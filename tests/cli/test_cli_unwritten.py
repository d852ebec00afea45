"""What commands leave where their files cannot be written after all: the result, and one line.

`RLIMIT_FSIZE` is the disk that is full: folders can be made, and files cannot grow.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
from pathlib import Path

import pytest

from in_process import clearway
from own_process import CLEARWAY

FEW = "--workers 1 --out out"
COMMANDS = {
    "fly brief.toml --out out": "reached            yes",
    "fly brief.toml --no-plots --json --out out": '"reached": true',
    "traffic day.jsonl.gz --out out": "aircraft",
    "assess my-scene.toml --out out": "trajectories",
}
LONGER = {
    "traffic day.jsonl.gz --fly 1 --out out": "in place of",
    "assess --scan flight.mcap --all --airframe-radius 0.5 --out out": "scan",
    "compare my-mission.toml --planners clearway,straight --seeds 1 --out out": "straight",
    f"risk model.txt --vehicle copter --count 4 {FEW}": "mid-air collision",
    "risk model.txt --vehicle copter --only 1 --out out": "clearway",
    "campaign my.toml --replay my-mission/straight/0 --out out": "my-mission/straight/0",
    f"encounters --count 3 {FEW}.csv": "off path: farthest",
    f"faults wind --flights 1 {FEW}": "wind",
    "map masts.csv --out out": "obstacles",
    "reach-set --out out": "trajectories",
    "pursuit --out out": "won for good",
    "alerts encounter.daa --out out": "corrective",
    "reproduce table-6.1 --out out": "6.1",
    "automaton measure quadrotor --flights 1 --held-out 1 --out out.toml": "closed form",
}


BRIEF = """
[mission]
name = "brief"
waypoints_m = [[6, 0, 0]]

[[lidar]]
beams_per_cell = [6, 4]
"""


@pytest.fixture(scope="module")
def samples(samples: Path) -> Path:
    (samples / "brief.toml").write_text(BRIEF)
    return samples


def on_a_full_disk(line: str, cwd: Path, most_bytes: int = 0) -> subprocess.CompletedProcess[str]:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, resource.RLIM_INFINITY))

    return subprocess.run(
        [*CLEARWAY, *line.split()],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        # Python itself would leave half of what it has made of a module, and trip over it later.
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=limit,
    )


@pytest.mark.parametrize(
    ("line", "result"),
    [
        *COMMANDS.items(),
        *(pytest.param(*one, marks=pytest.mark.nightly) for one in LONGER.items()),
    ],
)
def test_a_result_is_told_although_its_files_cannot_be_written(
    line: str, result: str, samples: Path
) -> None:
    done = on_a_full_disk(line, samples)
    assert done.returncode == 2, done.stderr
    assert result in done.stdout
    if "--json" in line:
        assert "provenance" in json.loads(done.stdout)
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("out")
    assert "cannot be written: File too large" in done.stderr.splitlines()[-1]
    assert not [one for one in samples.iterdir() if one.name.startswith(("out", ".out"))]


def test_a_recording_that_cannot_be_written_is_one_line(samples: Path) -> None:
    """Room for the logs, none for all of run.mcap."""
    done = on_a_full_disk("fly my-mission.toml --no-plots --out run", samples, 150_000)
    assert done.returncode == 2, done.stderr
    assert done.stderr.splitlines()[-1] == "run: cannot be written: File too large"
    lines = done.stderr.replace("escape", "").splitlines()
    assert not [line for line in lines if "cap" in line or "panicked" in line]
    assert not (samples / "run").exists()


def test_a_picture_that_cannot_be_written_costs_no_log(samples: Path) -> None:
    """Room for the logs, none for a picture of many dots."""
    line = "fly brief.toml --no-mcap --dpi 600 --out drawn"
    done = on_a_full_disk(line, samples, most_bytes=300_000)
    assert done.returncode == 2, done.stderr
    assert done.stderr.splitlines()[-1] == "drawn: cannot be written: File too large"
    logs = {path.name for path in (samples / "drawn").iterdir()}
    assert {"decisions.jsonl", "mission.toml", "summary.json", "track.csv"} <= logs
    assert not [name for name in logs if name.endswith(".png")]
    again = clearway(*line.replace("600", "50").split(), cwd=samples)
    assert again.returncode == 0, again.stderr
    assert logs < {path.name for path in (samples / "drawn").iterdir()}


def test_a_campaign_tells_its_table_and_goes_on_from_its_journal(samples: Path) -> None:
    line = "campaign my.toml --only forest/straight/* --workers 1 --out out-campaign"
    done = on_a_full_disk(line, samples, most_bytes=6000)
    assert done.returncode == 2, done.stderr
    assert "forest" in done.stdout
    assert "results.parquet: cannot be written: " in done.stderr.splitlines()[-1]
    again = clearway(*line.split(), cwd=samples)
    assert "0 flights flown, 2 in " in again.stderr
    assert again.stdout == done.stdout


def test_a_journal_that_cannot_grow_is_told_and_gone_on_with(samples: Path) -> None:
    line = "campaign my.toml --only forest/straight/* --workers 1 --out out-torn"
    done = on_a_full_disk(line, samples, most_bytes=1500)
    assert done.returncode == 2, done.stderr
    assert "journal.jsonl: cannot be written: File too large" in done.stderr.splitlines()[-1]
    again = clearway(*line.split(), cwd=samples)
    assert "1 flights flown, 2 in " in again.stderr


def test_what_was_there_stays_where_nothing_can_take_its_place(samples: Path) -> None:
    table, journal = samples / "kept.csv", samples / "kept.jsonl"
    table.write_text("kept\n")
    done = on_a_full_disk("encounters --count 1 --workers 1 --out kept.csv", samples)
    assert done.returncode == 2
    assert table.read_text() == "kept\n"
    study = "risk model.txt --vehicle copter --count 1 --workers 1 --journal kept.jsonl"
    done = on_a_full_disk(study, samples)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1] == "kept.jsonl: cannot be written: File too large"
    assert clearway(*study.split(), cwd=samples).returncode in (0, 1, 3)
    assert len(journal.read_text().splitlines()) == 2


def test_a_name_that_the_terminal_lacks_letters_for_costs_no_flight(tmp_path: Path) -> None:
    way = 'name = "ünï 🚁"\nwaypoints_m = [[3, 0, 0]]'
    (tmp_path / "x.toml").write_text(f"[mission]\n{way}\n", encoding="utf-8")
    done = subprocess.run(
        [*CLEARWAY, "fly", "x.toml", "--no-plots", "--no-mcap", "--out", "kept"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0, done.stderr
    assert r"\xfcn\xef \U0001f681" in done.stdout
    assert (tmp_path / "kept" / "summary.json").is_file()


def test_files_are_written_although_nobody_reads_the_result(samples: Path) -> None:
    read, written = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [*CLEARWAY, "fly", "brief.toml", "--no-plots", "--out", "unread"],
            cwd=samples,
            stdout=written,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        os.close(written)
    assert done.returncode == 141, done.stderr
    assert done.stderr.splitlines()[-1].startswith("wrote ")
    assert (samples / "unread" / "summary.json").is_file()
