"""`clearway reach-set` and what all commands share, through the real entry point."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from in_process import clearway as run_here

COMMAND = shutil.which("clearway", path=os.fspath(Path(sys.executable).parent))


def run(*arguments, cwd):
    assert COMMAND, "the package is installed with its entry point"
    return subprocess.run([COMMAND, *arguments], cwd=cwd, capture_output=True, text=True)


def test_json_is_alone_on_output_and_states_its_terms(tmp_path):
    done = run("reach-set", "--json", "--no-plots", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    result = json.loads(line)
    assert result["method"] == "flying"
    assert (result["layers"], result["columns"], result["rows"]) == (10, 7, 5)
    assert result["range_m"] == 10.0
    assert result["pitch_limit_deg"] == 30.0
    assert result["side_exits"] > 0
    assert 400 <= result["nodes_with_side_exits"] <= 1500
    assert 0 < result["nodes"] < result["nodes_with_side_exits"]
    assert 0.0 <= result["smoothness_worst"] <= result["smoothness"] <= 1.0
    assert {"trajectories", "footprints", "cells_covered", "build_s"} <= set(result)
    assert not list(tmp_path.iterdir())


def test_reference_row_of_the_paper_s_table(tmp_path):
    done = run_here(
        *("reach-set", "--method", "harmonic", "--harmonic", "1", "--layers", "15"),
        *("--pitch-limit-deg", "none", "--json", "--no-plots"),
        cwd=tmp_path,
    )
    result = json.loads(done.stdout)
    assert result["pitch_limit_deg"] is None
    assert (result["nodes"], result["trajectories"], result["footprints"]) == (207, 81, 9)
    assert result["smoothness"] == pytest.approx(0.63, abs=0.005)


def test_text_and_picture(tmp_path):
    done = run_here(
        *("reach-set", "--layers", "4", "--speed", "5", "--out", "here", "--method", "chaotic"),
        *("--azimuth-deg=-60,30", "--columns", "6", "--rows", "2", "--start-pitch-deg", "-15"),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert "4 x 6 x 2 cells to 20 m" in done.stdout
    assert "-15 deg at the start, limit 30 deg" in done.stdout
    (picture,) = (tmp_path / "here").glob("*.png")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert str(Path("here") / picture.name) in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--method", "best"], "valid reach set methods are full, chaotic"),
        (["--method", "flying", "--spread", "3"], "unknown tuning spread"),
        (["--layers", "0"], "grid layers: a whole number from 1"),
        (["--range", "-1"], "range_edges_m"),
        (["--azimuth-deg", "wide"], "--azimuth-deg: 'wide'"),
        (["--azimuth-deg", "200"], "azimuth_edges_rad"),
        (["--speed", "0"], "--speed: 0 is not above 0 and at most 1000 m/s"),
        (["--speed", "1e9"], "--speed: 1e+09 is not above 0 and at most 1000 m/s"),
        (["--duration", "1e9"], "--duration: 1e+09 is not above 0 and at most 1000 s"),
        (["--duration", "nan"], "--duration"),
        (["--pitch-limit-deg", "90"], "--pitch-limit-deg: 90"),
        (["--start-pitch-deg", "45"], "beyond the pitch limit"),
        (["--movements", "7"], "neither 5 nor 9"),
        (["--method", "full"], "outgrows"),
        (["--range", "10", "--speed", "0.01"], "takes 1000 movements of 0.01 m, more than 100"),
        (["--layers", "200"], "takes 200 movements"),
        (["--columns", "0"], "grid columns: a whole number from 1 to 100,000 is needed, got 0"),
        (["--columns", "100000000"], "more than 100000 cells"),
        (["--speed", "nan"], "--speed"),
        (["--range", "nan"], "--range"),
        (["--speed", "20", "--range", "5"], "one movement of 20 m leads out of a grid of 5 m"),
        (["--layers", "x"], "--layers"),
        (["--colour"], "No such option"),
    ],
)
def test_bad_input_exits_with_2_and_a_message(arguments, words, tmp_path):
    done = run_here("reach-set", "--no-plots", "--json", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert not list(tmp_path.iterdir())


def test_a_file_in_the_way_of_the_output_folder(tmp_path):
    (tmp_path / "taken").write_text("")
    done = run_here("reach-set", "--layers", "3", "--out", "taken", cwd=tmp_path)
    assert done.returncode == 2
    assert "taken: cannot be written" in done.stderr


def test_version_and_help(tmp_path):
    from clearway import __version__

    assert run_here("--version", cwd=tmp_path).stdout.strip() == __version__
    helped = run_here("--help", cwd=tmp_path)
    assert helped.returncode == 0
    assert "reach-set" in helped.stdout


def test_help_imports_nothing_heavy():
    """What keeps `clearway --help` quick."""
    code = (
        "import sys, clearway.cli.app;"
        "print([m for m in ('numpy', 'numba', 'pydantic', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.nightly
def test_compare_counts_every_method_in_a_small_grid(tmp_path):
    options = ("--layers", "3", "--branches", "3", "--repetitions", "2", "--json", "--no-plots")
    done = run_here("reach-set", "compare", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    result = json.loads(line)
    assert result["full_footprints_counted"] is True
    assert len(result["methods"]) == 10
    for row in result["methods"]:
        assert row["nodes_with_side_exits"] <= row["bound_6_5"]
        assert row["footprints"] <= row["trajectories"] <= row["nodes"]
        assert row["cells_covered"] <= row["cells_reachable"]
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_compare_prints_every_method_beside_the_paper(tmp_path):
    done = run_here("reach-set", "compare", "--layers", "5", "--out", "here", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "961 footprints (counted)" in done.stdout
    assert "cannot be" in done.stdout
    assert "2483, 725, 0.90" in done.stdout
    assert "own spread: all." in done.stdout
    pictures = {path.name for path in (tmp_path / "here").glob("*.png")}
    assert {"chaotic-9.png", "flying.png", "nodes-against-coverage.png"} <= pictures
    assert len(pictures) == 11


@pytest.mark.nightly
def test_compare_as_json(tmp_path):
    done = run_here(
        *("reach-set", "compare", "--layers", "9", "--branches", "4", "--repetitions", "3"),
        *("--json", "--no-plots"),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    result = json.loads(line)
    assert result["full_footprints_counted"] is False
    assert result["full_footprints_stderr"] > 0
    assert result["pitch_limit_deg"] is None
    assert result["cells_reachable"] == 243
    assert result["cells_reachable_proven"] is True
    assert len(result["methods"]) == 10
    for row in result["methods"]:
        assert row["nodes_with_side_exits"] <= row["bound_6_5"]
        assert row["footprints"] <= row["trajectories"] <= row["nodes"]
        assert row["coverage_ratio"] == pytest.approx(row["footprints"] / result["full_footprints"])
        assert 0 < row["coverage_ratio_stderr"] < 1
        assert row["cells_covered"] <= row["cells_reachable"]
        assert row["dispersion"] > row["dispersion_mean"] > 0
        assert row["build_s"] > 0
    assert not list(tmp_path.iterdir())
