"""`clearway fly` through its real entry point: good missions, overrides, bad input."""

import csv
import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from in_process import clearway as run_here
from own_process import run_clearway as run

SHORT = """
[mission]
name = "short"
waypoints_m = [[14, 0, 0]]

[[lidar]]
beams_per_cell = [10, 5]
sigma_m = 0.03

[[obstacle]]
shape = "ball"
position_m = [7, 0.2, 0]
radius_m = 1
"""


def mission(tmp_path, text=SHORT, name="short.toml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_a_flight_leaves_its_track_log_configuration_and_pictures(tmp_path):
    done = run("fly", mission(tmp_path), "--out", "out", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["reached"] is True
    assert result["waypoints_reached"] == 1
    assert result["min_obstacle_distance_m"] >= 0.6
    assert result["min_intruder_distance_m"] is None
    assert result["margin_violations"] == result["emergencies"] == 0
    assert set(result["decision_ms"]) == {"p50", "p99", "max"}
    rows = list(csv.DictReader((tmp_path / "out" / "track.csv").read_text().splitlines()))
    times = [float(row["time_s"]) for row in rows]
    assert list(rows[0]) == ["time_s", "x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad"]
    assert max(b - a for a, b in pairwise(times)) <= 0.05 + 1e-9
    assert times[-1] == pytest.approx(result["time_s"], abs=1e-3)
    lines = (tmp_path / "out" / "decisions.jsonl").read_text().splitlines()
    log = [json.loads(line) for line in lines]
    assert len(log) == result["decisions"]
    assert all(entry["explanation"] and entry["why_now"] for entry in log)
    pictures = {path.name for path in (tmp_path / "out").glob("*.png")}
    assert {"flight.png", "obstacle-distance.png", "tracking.png", "snapshot-1.png"} <= pictures
    assert {"reachability.png", "obstacle.png", "visibility.png"} <= pictures
    assert not list(tmp_path.glob(".*part*"))


def test_all_problems_of_a_mission_are_told_a_line_each(tmp_path):
    keys = [f"unknown_key_number_{number}" for number in range(18)]
    path = mission(tmp_path, SHORT + "\n[vehicle]\n" + "".join(f"{key} = 1\n" for key in keys))
    done = run_here("fly", path, "--no-plots", cwd=tmp_path)
    assert done.returncode == 2
    lines = done.stderr.splitlines()
    assert len(lines) == 18
    assert all(f"{path}: vehicle.{key}: unknown key" in done.stderr for key in keys)


def test_the_effective_configuration_flies_the_same_mission_again(tmp_path):
    first = run_here(
        "fly",
        mission(tmp_path),
        "--out",
        "a",
        "--seed",
        5,
        "--rating",
        "visible",
        "--no-plots",
        cwd=tmp_path,
    )
    again = run_here(
        "fly", tmp_path / "a" / "mission.toml", "--out", "b", "--no-plots", cwd=tmp_path
    )
    assert first.returncode == again.returncode == 0, again.stderr
    tracks = [(tmp_path / folder / "track.csv").read_bytes() for folder in "ab"]
    assert tracks[0] == tracks[1]
    assert not list((tmp_path / "a").glob("*.png"))


MET = """
[mission]
name = "met"
waypoints_m = [[20, 0, 0]]

[safety]
escape = "off"

[[intruder]]
name = "one [with] a name that is long enough to be folded"
appears_s = 3
position_m = [3, 0, 0]
velocity_mps = [-2, 0, 0]
"""


def test_what_happens_in_flight_is_told_in_a_line_each_as_it_is_named(tmp_path):
    done = run("fly", mission(tmp_path, MET), "--no-plots", "--no-mcap", cwd=tmp_path)
    told = [line for line in done.stderr.splitlines() if " s: EMERGENCY: " in line]
    log = map(json.loads, (tmp_path / "clearway-out/met/decisions.jsonl").read_text().splitlines())
    met = [f"{one['time_s']:.1f} s: {one['explanation']}" for one in log if "emerg" in one["mode"]]
    assert told == met
    assert met[0].endswith("intruder one [with] a name that is long enough to be folded")


def test_a_mission_that_is_not_reached_ends_with_1(tmp_path):
    late = SHORT + "\n[simulation]\ntime_limit_s = 3\n"
    done = run_here("fly", mission(tmp_path, late), "--no-plots", "--json", cwd=tmp_path)
    assert done.returncode == 1
    assert json.loads(done.stdout)["reached"] is False
    told = run_here("fly", mission(tmp_path, late), "--no-plots", cwd=tmp_path)
    assert re.search(
        r"^reached +NO.*\nwhy not +its time was up [0-9.]+ m from goal 1 of 1$",
        told.stdout,
        re.MULTILINE,
    )


BAD = {
    "unknown key": (SHORT + "\n[vehicle]\nspeed = 2\n", "vehicle.speed", "speed_mps"),
    "wrong type": (SHORT.replace("[[14, 0, 0]]", '"there"'), "mission.waypoints_m", "there"),
    "no mission": ("[grid]\nrange_m = 5\n", "mission", "missing"),
    "impossible grid": (SHORT + "\n[grid]\ncolumns = 0\n", "grid.columns", "0"),
    "unknown rating": (SHORT + '\n[rating]\nname = "best"\n', "rating.name", "total"),
    "not TOML": ("mission = [", "no valid TOML", "bad.toml"),
    "NaN": (SHORT.replace("7, 0.2, 0", "nan, 0, 0"), "obstacle[0].position_m", "finite"),
    "radius below 0": (SHORT.replace("radius_m = 1", "radius_m = -1"), "radius_m", "-1"),
    "waypoints too near": (
        SHORT.replace("[[14, 0, 0]]", "[[14, 0, 0], [14.5, 0, 0]]"),
        "waypoints_m[1]",
        "reach radius",
    ),
    "no such cloud": (
        SHORT + '\n[point_cloud]\nfile = "none.las"\npoint_radius_m = 0.1\n',
        "none.las",
        "read",
    ),
    "too slow for the grid": (
        SHORT + "\n[vehicle]\nspeed_mps = 0.01\n",
        "vehicle.speed_mps",
        "too short for a grid of",
    ),
    "too fast to turn away": (
        SHORT + "\n[vehicle]\nspeed_mps = 20\n[grid]\nrange_m = 10\n",
        "grid.range_m",
        "turning radius",
    ),
    "start inside an obstacle": (
        SHORT.replace("[7, 0.2, 0]", "[0.5, 0, 0]"),
        "the start lies 0.50 m inside",
        "refused",
    ),
    "no such pattern": (
        SHORT.replace("beams_per_cell = [10, 5]", 'pattern = "vlp99"'),
        "vlp99",
        "vlp16",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_missions_are_refused_with_place_and_cause(tmp_path, case):
    text, place, cause = BAD[case]
    done = run_here("fly", mission(tmp_path, text, "bad.toml"), "--out", "out", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert place in done.stderr
    assert cause in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert not (tmp_path / "out").exists()


def test_what_the_map_shows_to_be_impossible_is_refused_before_take_off(tmp_path):
    walled = SHORT.replace(
        "position_m = [7, 0.2, 0]", 'name = "tank"\nknown = "both"\nposition_m = [14, 0, 0]'
    )
    walled = walled.replace("radius_m = 1\n", "radius_m = 4\n")
    done = run_here("fly", mission(tmp_path, walled), "--out", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert "waypoint 1" in done.stderr
    assert "tank" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["static-obstacle", "missing.toml"])
def test_an_unknown_mission_says_what_there_is(tmp_path, name):
    done = run_here("fly", name, cwd=tmp_path)
    assert done.returncode == 2
    assert name in done.stderr
    if not name.endswith(".toml"):
        assert "static-obstacles" in done.stderr


def test_a_bad_override_is_refused(tmp_path):
    done = run_here("fly", "static-obstacles", "--rating", "best", cwd=tmp_path)
    assert done.returncode == 2
    assert "visible" in done.stderr


def test_a_folder_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    done = run_here("fly", mission(tmp_path), "--no-plots", "--out", "file/out", cwd=tmp_path)
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert Path(tmp_path / "file").read_text() == ""


def test_results_into_a_device_are_refused_as_what_cannot_be_written(tmp_path):
    done = run_here("fly", mission(tmp_path), "--out", "/dev/null", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "/dev/null: cannot be written: --out is a device; a folder is needed\n"


@pytest.mark.parametrize("tables", ["[rules]\nterrain_m = 30\n", "[vehicle]\nspeed_mps = 1e-9\n"])
def test_a_mission_that_is_called_as_its_file_is_told_with_the_file(tmp_path, tables):
    done = run_here("fly", mission(tmp_path, SHORT + tables), cwd=tmp_path)
    assert done.returncode == 2
    assert "short.toml: mission 'short': " in done.stderr
