"""`clearway assess` as a user runs it: its result, its files, and every kind of bad input."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from clearway.cli.app import app
from in_process import clearway as run_here
from repository import REPOSITORY

SCENES = REPOSITORY / "examples" / "scenes"


def clearway(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run the command as installed."""
    command = shutil.which("clearway", path=Path(sys.executable).parent)
    assert command is not None
    return subprocess.run(
        [command, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, check=False
    )


def assessed(*arguments: str | Path, cwd: Path) -> Any:
    """A run within this process: quick, and otherwise the same."""
    with contextlib.chdir(cwd):
        return CliRunner().invoke(app, ["assess", *map(str, arguments)])


def refused(*arguments: str | Path, cwd: Path) -> str:
    """The message of a run that must end with status 2, say why, and leave nothing behind."""
    before = sorted(cwd.rglob("*"))
    run = assessed(*arguments, cwd=cwd)
    assert run.exit_code == 2, run.stderr
    assert isinstance(run.exception, SystemExit)
    assert run.stdout == ""
    assert sorted(cwd.rglob("*")) == before
    return run.stderr


def test_a_refusal_through_the_real_entry_point(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text("[grid]\nlayerz = 3\nrows = 0\n[scann]\n")
    run = clearway("assess", "scene.toml", cwd=tmp_path)
    assert run.returncode == 2
    assert run.stdout == ""
    assert [line.split(":")[:2] for line in run.stderr.splitlines()] == [
        ["scene.toml", " grid.rows"],
        ["scene.toml", " grid.layerz"],
        ["scene.toml", " scann"],
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


def test_a_scene_leaves_its_result_and_pictures(tmp_path: Path) -> None:
    run = run_here("assess", SCENES / "two-balls.toml", "--json", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    result: dict[str, Any] = json.loads(run.stdout)
    assert np.array(result["detected"]).shape == (10, 7, 5)
    assert result["scans"][0]["pattern_from"] == "simulated"
    reachability = np.array(result["reachability"], dtype=float)
    assert 0.0 <= np.nanmin(reachability) < 0.2
    assert np.nanmax(reachability) == 1.0
    folder = tmp_path / "clearway-out" / "assess-two-balls"
    assert sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")) == [
        "obstacle.png",
        "reachability.png",
        "result.json",
        "scene.toml",
        "visibility.png",
    ]
    assert json.loads((folder / "result.json").read_text()) == result
    again = run_here(
        "assess", folder / "scene.toml", "--json", "--no-plots", "--out", "b", cwd=tmp_path
    )
    unlike = {"name": "", "provenance": {}}
    assert {**json.loads(again.stdout), **unlike} == {**result, **unlike}
    left = sorted(path.name for path in (tmp_path / "b").iterdir() if not path.name.startswith("."))
    assert left == ["result.json", "scene.toml"]


@pytest.mark.parametrize("name", sorted(path.name for path in SCENES.glob("*.toml")))
def test_the_examples_run(tmp_path: Path, name: str) -> None:
    run = assessed(SCENES / name, "--no-plots", cwd=tmp_path)
    assert run.exit_code == 0, run.stderr
    assert run.stdout.startswith("scene ")
    assert "trajectories" in run.stdout


def test_a_real_scan_says_where_its_beams_are_from(data_dir: Path, tmp_path: Path) -> None:
    scan = data_dir / "lidar/pcd/vls128_1585897255376374245.pcd"
    common = ("--scan", scan, "--range", "50", "--no-plots")
    estimated = assessed(*common, cwd=tmp_path)
    assert estimated.exit_code == 0, estimated.stderr
    assert "beams       estimated" in estimated.stdout
    stated = assessed(*common, "--pattern", "vls128", "--json", cwd=tmp_path)
    result = json.loads(stated.stdout)
    assert result["scans"][0]["pattern_from"] == "stated"
    assert result["scans"][0]["pattern"] == "vls128"
    assert result["grid"]["range_m"][-1] == 50.0
    assert result["reach_set"]["speed_mps"] == 5.0
    hits = np.array(result["hits"])
    kept = np.linalg.norm(_points(scan), axis=1) <= 50.0
    assert 0 < hits.sum() < kept.sum()
    assert (np.array(result["detected"])[hits > 0] > 0.0).all()


def _points(path: Path) -> Any:
    from clearway.io.scans.scan_formats import read_points

    return read_points(path).points_m


def test_options_take_the_place_of_the_files_keys(tmp_path: Path) -> None:
    run = assessed(
        SCENES / "two-balls.toml",
        *("--range", "12", "--layers", "6", "--azimuth-deg", "-30,60", "--rating", "visible"),
        *("--method", "primitives", "--json", "--no-plots"),
        cwd=tmp_path,
    )
    result = json.loads(run.stdout)
    assert result["grid"]["range_m"] == [0, 2, 4, 6, 8, 10, 12]
    assert result["grid"]["azimuth_deg"][0] == pytest.approx(-30.0)
    assert result["rating_name"] == "visible"
    assert result["reach_set"]["method"] == "primitives"


def test_points_that_are_not_finite_are_counted_on_standard_error(tmp_path: Path) -> None:
    points = np.random.default_rng(1).uniform(-8.0, 8.0, (300, 3))
    points[:7] = np.nan
    points[7:9, 1] = np.inf
    np.save(tmp_path / "scan.npy", points)
    run = assessed("--scan", "scan.npy", "--json", "--no-plots", cwd=tmp_path)
    assert run.exit_code == 0, run.stderr
    assert "9 points left out: not finite" in run.stderr
    assert sum(json.loads(run.stdout)["scans"][0]["points"].values()) >= 291


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[grid]\nlayerz = 3\n", "grid.layerz: unknown key (did you mean 'layers'?)"),
        ("[grid]\nlayers = 'ten'\n", 'grid.layers: should be a valid integer, got "ten"'),
        ("[grid]\nazimuth_deg = [45, -45]\n", "azimuth_deg: edges must be at least two and ascend"),
        ("[grid\n", "no valid TOML"),
        ("[scan]\nfile = 'absent.pcd'\n", "absent.pcd: cannot be read: No such file"),
        ("[reach_set]\nspeed_mps = 0.01\n", "reach set: 0.01 m/s need 1,000 movements"),
        (
            "[grid]\nrange_m = 10\n[reach_set]\nspeed_mps = 999\n",
            "at most 100 m/s are rated, 10 times its range",
        ),
    ],
)
def test_bad_scene_files(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "scene.toml").write_text(text)
    stderr = refused("scene.toml", cwd=tmp_path)
    assert message in stderr


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("absent.pcd", None, "cannot be read: No such file"),
        ("empty.pcd", b"", "the file is empty"),
        ("short.las", b"LASF" + bytes(50), "truncated"),
        ("nan.csv", b"nan,nan,nan\n", "no usable point"),
        ("wide.csv", b"-5000,0,0\n5000,0,0\n", "points extend 10,000 x 0 x 0 m"),
        ("scan.e57", b"ASTM-E57", "valid suffixes: .pcd"),
    ],
)
def test_bad_scans(tmp_path: Path, name: str, content: bytes | None, message: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    stderr = refused("--scan", name, "--range", "50", cwd=tmp_path)
    assert message in stderr
    assert name in stderr


def test_a_truncated_real_scan(data_dir: Path, tmp_path: Path) -> None:
    content = (data_dir / "lidar/pcd/vls128_1585897255376374245.pcd").read_bytes()
    (tmp_path / "cut.pcd").write_bytes(content[: len(content) // 2])
    stderr = refused("--scan", "cut.pcd", "--range", "50", cwd=tmp_path)
    assert "truncated: the header promises 208680 points" in stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "nothing to assess"),
        (("absent.toml",), "absent.toml: cannot be read"),
        (("--scan", "a.csv", "--range", "-3"), "grid: range_m: edges"),
        (("--scan", "a.csv", "--azimuth-deg", "wide"), "--azimuth-deg: 'wide' is no angle"),
        (("--scan", "a.csv", "--pattern", "vlp17"), "known are vlp16"),
        (
            ("--scan", "a.csv", "--rating", "best"),
            "'total', 'printed', 'visible', 'evidence', 'calibrated' or your own",
        ),
        (("--scan", "a.csv", "--out", "a.csv"), "cannot be written"),
        (("--layers", "many"), "Invalid value for '--layers'"),
    ],
)
def test_bad_options(tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    (tmp_path / "a.csv").write_text("5,0,0\n6,1,0\n")
    assert message in refused(*arguments, cwd=tmp_path)
