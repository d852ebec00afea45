"""`clearway traffic` as a user runs it: text, JSON, pictures, and bad input."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from clearway.cli.app import app
from in_process import clearway as run_here

PNG = b"\x89PNG\r\n\x1a\n"


def clearway(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run the command as installed."""
    command = shutil.which("clearway", path=Path(sys.executable).parent)
    assert command is not None
    return subprocess.run(
        [command, "traffic", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


def listed(*arguments: str | Path, cwd: Path) -> Any:
    """A run within this process: quick, and otherwise the same."""
    with contextlib.chdir(cwd):
        return CliRunner().invoke(app, ["traffic", *map(str, arguments)])


def rows(path: Path, *places: tuple[float, str, float, float]) -> Path:
    """Aircraft rows of time, address, latitude and altitude in feet, all northbound at 100 kt."""
    path.write_text(
        "".join(
            json.dumps(
                {"now": 1.7e9 + time_s, "hex": address, "lat": latitude, "lon": 5.0,
                 "alt_baro": altitude_ft, "gs": 100, "track": 0, "flight": address.upper()}
            ) + "\n"
            for time_s, address, latitude, altitude_ft in places
        )
    )  # fmt: skip
    return path


def two_aircraft(path: Path) -> Path:
    """One behind the other, 0.01 deg of latitude (1112 m) and 300 ft apart; then one leaves."""
    places = [(float(t), "aaaaaa", 45.0 + 0.0005 * t, 1000.0) for t in range(30)]
    places += [(float(t), "bbbbbb", 45.01 + 0.0005 * t, 1300.0) for t in (*range(20), 40)]
    return rows(path, *places)


def test_real_encounter_in_words(data_dir: Path, tmp_path: Path) -> None:
    run = clearway(data_dir / "adsb/tracks_brc_20min_20230830.jsonl", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    lines = run.stdout.splitlines()
    assert any("418 no position, 12 told twice" in line for line in lines)
    closest = lines[next(n for n, line in enumerate(lines) if line.startswith("distance")) + 1]
    assert closest.startswith("240 m ")
    assert "2023-08-30 08:16:23Z" in closest
    assert "N2436G" in closest
    assert "N26GB" in closest
    assert not list(tmp_path.iterdir())


def test_json_and_pictures(tmp_path: Path) -> None:
    file = two_aircraft(tmp_path / "day.jsonl")
    (tmp_path / "other").mkdir()
    again = two_aircraft(tmp_path / "other" / "day.jsonl")
    run = run_here("traffic", file, again, "--json", "--out", "out", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    assert json.loads((tmp_path / "out" / "traffic.json").read_text()) == result
    for name in ("day.png", "day-2.png"):
        assert (tmp_path / "out" / name).read_bytes().startswith(PNG)
    one = result["recordings"][0]
    assert (one["messages"], one["reports"], one["left_out"]) == (51, 51, {})
    assert (one["from"], one["to_s"]) == ("2023-11-14T22:13:20.000+00:00", 1.7e9 + 40)
    first, second = one["aircraft"]
    assert (first["address"], first["callsign"], first["reports"]) == ("aaaaaa", "AAAAAA", 30)
    assert (second["gaps"], second["longest_gap_s"], second["visits"]) == (1, 21.0, 1)
    (pair,) = one["pairs"]
    assert pair["distance_m"] == pytest.approx(1111.4, abs=1.0)
    assert pair["height_m"] == pytest.approx(91.44)
    assert pair["height_step_m"] == pytest.approx(30.48)
    assert pair["relative_mps"] == 0.0


def test_own_address(tmp_path: Path) -> None:
    file = two_aircraft(tmp_path / "day.jsonl")
    run = listed(file, "--own", "BBBBBB", cwd=tmp_path)
    assert run.exit_code == 0
    assert "own         bbbbbb" in run.stdout
    run = listed(file, "--own", "cccccc", cwd=tmp_path)
    assert run.exit_code == 2
    assert "own address 'cccccc' is not in it; valid: aaaaaa, bbbbbb" in run.stderr


def test_the_list_is_cut_and_says_so(tmp_path: Path) -> None:
    file = two_aircraft(tmp_path / "day.jsonl")
    short, whole = (listed(file, "--most", n, cwd=tmp_path).stdout for n in ("1", "0"))
    assert "aircraft (1 of 2; --most 0 lists all)" in short
    assert "AAAAAA" in short
    assert "lists all" not in whole
    assert len(whole.splitlines()) == len(short.splitlines()) + 1


def test_every_bad_file_is_told_at_once(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_bytes(b"")
    (tmp_path / "scan.pcd").write_bytes(b"# .PCD v0.7\n")
    two_aircraft(tmp_path / "good.jsonl")
    cut = (tmp_path / "good.jsonl").read_bytes()[:-9]
    (tmp_path / "cut.jsonl").write_bytes(cut)
    names = ["empty.csv", "scan.pcd", "good.jsonl", "cut.jsonl", "absent.json"]
    before = sorted(tmp_path.rglob("*"))
    run = run_here("traffic", *names, "--json", "--out", "out", cwd=tmp_path)
    assert run.returncode == 2
    assert run.stdout == ""
    assert sorted(tmp_path.rglob("*")) == before
    told = run.stderr.splitlines()
    # What is cut off is read up to there.
    assert [line.split(":")[0] for line in told] == [names[0], names[1], names[4]]
    causes = ("empty", "no known traffic recording", "No such")
    for line, cause in zip(told, causes, strict=True):
        assert cause in line
        assert len(line) <= 500


def test_output_that_cannot_be_written(tmp_path: Path) -> None:
    file = two_aircraft(tmp_path / "day.jsonl")
    run = listed(file, "--out", file, cwd=tmp_path)
    assert run.exit_code == 2
    assert "cannot be written" in run.stderr


def test_a_recording_without_positions_has_a_picture_too(tmp_path: Path) -> None:
    (tmp_path / "a.jsonl").write_text('{"now": 5, "hex": "abcdef"}\n')
    run = listed("a.jsonl", "--out", "out", cwd=tmp_path)
    assert run.exit_code == 0, run.stderr
    assert "no position" in run.stdout
    assert (tmp_path / "out" / "a.png").read_bytes().startswith(PNG)


def test_a_margin_that_no_mission_could_keep_is_refused_by_its_option(tmp_path: Path) -> None:
    done = run_here("traffic", "encounter.daa", "--fly", "1", "--margin", "1e9", cwd=tmp_path)
    assert done.returncode == 2
    assert "'--margin'" in done.stderr
