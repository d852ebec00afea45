"""What missions, plans and scenes leave out: the vehicle decides, and what is stated wins."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clearway as cw
from clearway.io.toml import parse_model
from clearway.live.mission import Mission
from clearway.live.preflight.tight_turns import over_turns
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import check_scale
from clearway.vehicle.automaton import MovementAutomaton
from in_process import clearway

SQUARE = "waypoints_m = [[150, 0, 0], [150, 150, 0], [0, 150, 0], [0, 0, 0]]"
PLANE = f'[mission]\nname = "square"\n{SQUARE}\n[vehicle]\nspeed_mps = 5\n'
CHOSEN = {"grid.range_m": 50.0, "safety.margin_m": 2.0, "mission.reach_radius_m": 7.5}


def mission(**tables) -> MissionFile:
    tables["mission"] = {"name": "m", "waypoints_m": [[900, 0, 0]]} | tables.get("mission", {})
    return parse_model("test", tables, MissionFile)


def lines(apart_m: float, long_m: float) -> list[list[float]]:
    """The waypoints of a survey of four lines."""
    ends = [[[0.0, y, 30.0], [long_m, y, 30.0]] for y in apart_m * np.arange(4.0)]
    return [place for n, line in enumerate(ends) for place in line[:: (-1) ** n]][1:]


def values(file: MissionFile) -> tuple:
    return (file.grid.range_m, file.safety.margin_m, file.mission.reach_radius_m)


def test_a_plane_of_5_mps_with_nothing_else_stated_flies_a_square(tmp_path):
    path = tmp_path / "square.toml"
    path.write_text(PLANE)
    done = clearway("fly", path, "--no-plots", "--no-mcap", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert (done.returncode, told["waypoints_reached"], told["guarantee"]) == (0, 4, True)
    assert told["path_length_m"] <= 1.1 * 600.0
    line = next(
        one for one in done.stderr.splitlines() if one.startswith("note: not in the mission")
    )
    assert line in told["notes"]
    for key, value in CHOSEN.items():
        assert f"{key} = {value:g}" in line
    assert told["chosen"] == {**CHOSEN, "vehicle.movement_s": 1.0}
    flown = cw.read_mission(tmp_path / "clearway-out" / "square" / "mission.toml")
    assert values(flown) == tuple(CHOSEN.values())
    assert flown.scale_note is None  # All of it is stated now.


def test_what_is_stated_wins_and_what_is_not_follows_a_change():
    stated = mission(
        mission={"reach_radius_m": 4.0}, vehicle={"speed_mps": 8.0, "movement_s": 0.5},
        grid={"range_m": 60.0}, safety={"margin_m": 1.0},
    )  # fmt: skip
    assert (*values(stated), stated.vehicle.movement_s) == (60.0, 1.0, 4.0, 0.5)
    assert not stated.left_out
    assert stated.scale_note is None
    slow = mission(vehicle={"speed_mps": 5.0}, safety={"margin_m": 1.0})
    assert values(slow) == (50.0, 1.0, 7.5)
    assert values(slow.with_values("vehicle", speed_mps=10.0)) == (100.0, 1.0, 15.0)
    assert values(slow) == (50.0, 1.0, 7.5)  # Of which the changed one is no part.
    again = parse_model("again", slow.effective(), MissionFile)
    assert values(again) == values(slow)
    assert not again.left_out


@pytest.mark.parametrize("kind", ["plane", "multirotor", "inertialess"])
def test_at_1_mps_nothing_is_chosen(kind):
    file = mission(vehicle={"kind": kind})
    assert values(file) == (10.0, 0.6, 1.5)
    assert file.scale_note is None


def test_nothing_is_said_of_keys_that_do_not_count():
    fast = mission(vehicle={"kind": "multirotor", "speed_mps": 30.0})
    assert fast.left_out.keys() == {"grid.range_m", "safety.margin_m", "mission.reach_radius_m"}
    assert "movement_s" not in (fast.scale_note or "")
    assert "grid.range_m" not in mission(grid={"range_edges_m": [0, 10, 40]}).left_out


def test_edges_of_layers_and_sensors_of_ones_own_are_left_as_they_are():
    edges = mission(vehicle={"speed_mps": 5.0}, grid={"range_edges_m": [0, 10, 40]})
    assert edges.grid.to_grid().range_m == 40.0
    assert "range_m" not in edges.effective()["grid"]
    short = {"lidar": [{"max_range_m": 30.0}], "vehicle": {"speed_mps": 5.0}}
    assert mission(**short).grid.range_m == 30.0
    assert (
        mission(**short, sensor=[{"kind": "lidar", "settings": {"name": "b"}}]).grid.range_m == 50
    )
    both = [{"max_range_m": 30.0}, {"name": "far", "pattern": "vlp16"}]
    assert mission(lidar=both, vehicle={"speed_mps": 5.0}).grid.range_m == 50.0


def test_a_plant_flies_at_the_scale_of_its_own_movements():
    file = mission(vehicle={"plant": "quadrotor"})
    step = file.vehicle.to_automaton().step_m
    assert file.grid.range_m >= 10.0 * step - 1e-3 > 10.0


@settings(deadline=None)
@given(
    st.sampled_from(["plane", "multirotor", "inertialess"]),
    st.floats(0.5, 30.0),
    st.none() | st.floats(5.0, 400.0),
    st.floats(7.5, 45.0),
    st.floats(1.0, 200.0),
)
def test_every_mission_passes_its_own_checks(kind, speed, sees_m, turn, apart_m):
    """Of the file, of its scale, and of the mission."""
    vehicle = {"kind": kind, "speed_mps": speed}
    if kind != "multirotor":
        vehicle["turn_step_deg"] = turn
    far = [[900.0, 0.0, 0.0], [900.0, max(apart_m, 1.5), 0.0]]
    lidar = [{} if sees_m is None else {"max_range_m": sees_m}]
    file = mission(mission={"waypoints_m": far}, vehicle=vehicle, lidar=lidar)
    automaton = file.vehicle.to_automaton()
    check_scale(file, automaton, file.grid.to_grid())
    flown = file.to_mission()
    assert flown.reach_radius_m >= min(1.5, 0.5 * automaton.step_m)


def test_a_scene_follows_the_speed_that_it_states(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text("[reach_set]\nspeed_mps = 4.0\n")
    done = clearway("assess", scene, "--no-plots", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert told["grid"]["range_m"][-1] == 40.0
    assert "grid.range_m = 40, rating.safety_margin_m = 1.6" in done.stderr
    scene.write_text("[grid]\nrange_m = 20\n[reach_set]\nspeed_mps = 4.0\n")
    done = clearway("assess", scene, "--no-plots", "--json", cwd=tmp_path)
    assert json.loads(done.stdout)["grid"]["range_m"][-1] == 20.0
    assert cw.assess([], speed_mps=4.0).scene.grid.range_m == 40.0
    assert cw.assess([]).scene.grid.range_m == 10.0


# Waypoints that cannot be reached as asked


def survey(apart_m: float, speed: float = 5.0, **own) -> MissionFile:
    way = {"waypoints_m": lines(apart_m, 30.0 * speed)} | own
    start = {"position_m": [-50.0, 0.0, 30.0], "speed_mps": speed}
    return mission(mission=way, vehicle=start)


def told_of(file: MissionFile) -> str:
    return over_turns(file.to_mission(), file.vehicle.to_automaton()) or ""


def test_lines_that_are_too_close_are_told_of_with_what_would_do():
    told = told_of(survey(5.0))
    assert "goals 2, 4, 6 lie within the turning circle of 19.1 m radius" in told
    assert "2.5 m/s would do, or goals 10 m apart and mission.reach_radius_m = 7.5" in told
    assert not told_of(survey(5.0, speed=2.5))
    assert not told_of(survey(10.0))
    small = told_of(survey(25.0, reach_radius_m=4.0))
    assert "mission.reach_radius_m = 7.5 would do" in small
    assert not told_of(survey(25.0, reach_radius_m=7.5))
    assert not told_of(survey(50.0, reach_radius_m=4.0))  # No turn is too tight.
    assert not told_of(survey(5.0, pass_within_m=25.0))


@given(st.floats(0.5, 20.0), st.floats(1.6, 200.0))
def test_the_speed_that_would_do_does(speed, apart_m):
    told = told_of(survey(apart_m, speed=speed))
    if not told:
        return
    slower = float(told.split("; ")[1].split(" m/s")[0])
    assert slower < speed
    assert not told_of(survey(apart_m, speed=slower)) or 1.5 * slower < 1.5  # There it ends.


@pytest.mark.parametrize("kind", ["multirotor", "inertialess"])
def test_what_can_stop_turns_on_the_spot(kind):
    places = np.array(lines(2.0, 100.0))
    made = Mission("m", cw.State(np.zeros(3)), waypoints_m=places, reach_radius_m=0.5)
    assert over_turns(made, getattr(MovementAutomaton, kind)(5.0)) is None


@pytest.mark.parametrize("apart_m", [25.0, 10.0])
def test_a_survey_is_reached_or_told_of(apart_m, tmp_path):
    """Lines 25 m apart, closer than two turning radii, and ones that just do."""
    path = tmp_path / "survey.toml"
    places = json.dumps(lines(apart_m, 150.0))
    path.write_text(
        f'[mission]\nname = "survey"\nwaypoints_m = {places}\n'
        "[vehicle]\nspeed_mps = 5\nposition_m = [-50, 0, 30]\n"
    )
    done = clearway("fly", path, "--no-plots", "--no-mcap", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert told["reached"], told["reason"]
    assert "turning circle of" not in done.stderr


def test_a_flight_whose_time_is_up_says_so_and_was_told_of(tmp_path):
    path = tmp_path / "close.toml"
    places = json.dumps(lines(5.0, 150.0)[:3])
    path.write_text(
        f'[mission]\nname = "close"\nwaypoints_m = {places}\n'
        "[vehicle]\nspeed_mps = 5\nposition_m = [-50, 0, 30]\n[simulation]\ntime_limit_s = 60\n"
    )
    done = clearway("fly", path, "--no-plots", "--no-mcap", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert not told["reached"]
    assert told["reason"].startswith("its time was up ")
    assert "goal 2 lies within the turning circle" in done.stderr
