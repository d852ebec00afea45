"""`clearway compare` and `fly --planner` through their real entry point."""

import json

import pytest

from in_process import clearway as run_here
from own_process import run_clearway as run


def test_a_comparison_is_one_table_one_file_and_one_picture(tmp_path):
    done = run(
        "compare",
        "balls-100",
        "--planners",
        "clearway,straight",
        "--seeds",
        2,
        "--json",
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["seeds"] == [0, 1]
    clearway, straight = result["planners"]
    assert (clearway["planner"], clearway["safe"], clearway["crashed"]) == ("clearway", 2, 0)
    assert (straight["planner"], straight["reached"], straight["crashed"]) == ("straight", 1, 1)
    assert straight["runs"][0]["reached"] is not straight["runs"][1]["reached"]
    assert [one["mission"] for one in clearway["runs"]] == ["balls-100-0", "balls-100-1"]
    assert {one["planner"] for one in straight["runs"]} == {"straight"}
    folder = tmp_path / "clearway-out" / "compare-balls-100"
    assert json.loads((folder / "comparison.json").read_text()) == result
    assert (folder / "tracks.png").stat().st_size > 10_000


def test_the_table_names_every_planner_and_an_unsafe_first_one_ends_with_1(tmp_path):
    done = run_here(
        "compare", "static-obstacles", "--planners", "straight,vfh", "--no-plots", cwd=tmp_path
    )
    assert done.returncode == 1
    assert "straight" in done.stdout
    assert "vfh" in done.stdout
    assert "1/1" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("compare", "forest", "--planners", "clearway,best"), "potential-field"),
        (("compare", "swamp"), "no such mission"),
        (("compare", "forest", "--seeds", "0"), "seeds"),
        (("fly", "forest:x"), "whole number"),
        (("fly", "static-obstacles", "--planner", "best"), "potential-field"),
    ],
)
def test_bad_requests_are_refused_with_what_there_is(tmp_path, arguments, said):
    done = run_here(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stdout == ""
    assert not list(tmp_path.iterdir())


def test_a_baseline_leaves_its_track_log_and_pictures(tmp_path):
    done = run_here(
        "fly", "static-obstacles", "--planner", "straight", "--out", "out", "--json", cwd=tmp_path
    )
    assert done.returncode == 1, done.stderr
    result = json.loads(done.stdout)
    assert result["planner"] == "straight"
    assert result["crashed_s"] == pytest.approx(8.0, abs=0.1)
    assert result["crashed"] == "obstacle 0 'first obstacle' (ball)"
    assert result["escape_mode"] is None
    assert result["guarantee"] is False
    names = {path.name for path in (tmp_path / "out").iterdir() if not path.name.startswith(".")}
    assert {"flight.png", "obstacle-distance.png", "tracking.png", "summary.json"} <= names
    log = (tmp_path / "out" / "decisions.jsonl").read_text().splitlines()
    assert len(log) == result["decisions"]
    assert all(json.loads(line)["explanation"] for line in log)
